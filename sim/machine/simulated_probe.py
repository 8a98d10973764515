"""The probe of a run, from its options."""

import numpy as np

from touchatlas.patch.entry_points import PROBES, added, load_added
from touchatlas.planner.tracking.options import Tip
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.machine.faults import with_faults
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.options import IDEAL, SCANNING, TRIGGER, ProbeOptions
from touchatlas.sim.machine.probes import SimulatedProbe, machine_probe
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.probe import Probe
from touchatlas.sim.world.units import millimetre_of


def probe_of(
    options: RunOptions, obj: ImplicitObject | MeshObject, rng: np.random.Generator
) -> SimulatedProbe:
    """The probe of a run whose options are complete; all its random numbers are of one generator.

    Parameters
    ----------
    options : RunOptions
    obj : ImplicitObject or MeshObject
    rng : numpy.random.Generator

    Notes
    -----
    A package adds a probe to ``touchatlas.probes`` as a function of object, options and rng.
    """
    assert options.noise is not None and options.tolerance is not None
    probe: SimulatedProbe
    if options.probe.name == IDEAL:
        probe = Probe(obj, options.noise, rng)
    elif options.probe.name in added(PROBES):
        probe = load_added(PROBES, options.probe.name)(obj, options, rng)
    else:
        probe = machine_probe(obj, options.probe, options.noise, _millimetre(obj), rng)
    return with_faults(probe, options.fault, options.tolerance, lambda: Feet(obj), rng)


def radius_of_centres(options: ProbeOptions, obj: ImplicitObject | MeshObject) -> float:
    """Radius of the ball whose centres the probe of some options gives, length; 0 of one that gives
    contacts.

    >>> from touchatlas.sim import make_object
    >>> radius_of_centres(ProbeOptions("trigger"), make_object("cube"))
    2.0
    """
    if options.name == TRIGGER or (options.name == SCANNING and not options.normals):
        own = Tip().radius * _millimetre(obj)
        return own if options.radius is None else options.radius
    return 0.0


def _millimetre(obj: ImplicitObject | MeshObject) -> float:
    """A millimetre in the unit of an object."""
    return millimetre_of("mm" if isinstance(obj, ImplicitObject) else obj.unit, obj.diagonal)

"""The probe of a run, from its options."""

import numpy as np

from touchatlas.patch.entry_points import PROBES, added, load_added
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.machine.faults import with_faults
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.options import IDEAL
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
        unit = "mm" if isinstance(obj, ImplicitObject) else obj.unit
        millimetre = millimetre_of(unit, obj.diagonal)
        probe = machine_probe(obj, options.probe, options.noise, millimetre, rng)
    return with_faults(probe, options.fault, options.tolerance, lambda: Feet(obj), rng)

"""probe.toml: what was found out about a probe, for whoever drives or simulates it."""

import tomllib
from dataclasses import asdict, fields
from pathlib import Path

from touchatlas.atlas.files import check_path
from touchatlas.planner.drivers.guarded import MILLIMETRES
from touchatlas.planner.drivers.qualification import Qualification
from touchatlas.planner.tracking.options import Tip

# Millimetres in each unit that a file may name.
_MILLIMETRES = {"um": 1e-3, "cm": 10.0, "m": 1e3, **MILLIMETRES}


def probe_toml(
    found: Qualification, ball_radius: float, unit: str, source: str, machine: str = ""
) -> str:
    """The text of probe.toml; ``machine`` is what holds the probe where it is simulated.

    The table ``tip`` is what drivers take, the table ``qualified`` what a reader wants to know; the
    rest are options of an exploration that is simulated. Lengths are in the unit, forces in N.
    """
    qualified = {
        "ball_radius": ball_radius,
        "points": found.points,
        "P_Form.Sph.1x25": found.form_1x25,
        "P_Form.Sph.Scan": found.form_scan,
        "P_Size.Sph": found.size,
    }
    lines = [f"# {' '.join(source.split())}"]
    lines += [f"# {sentence}" for sentence in found.said]
    lines += [f'unit = "{unit}"'] if unit else []
    lines += [f"noise = {found.tip.noise_std!r}", "", "[probe]"]
    lines += [f'name = "{"trigger" if found.form_scan is None else "scanning"}"']
    lines += [f'machine = "{machine}"'] if machine else []
    lines += [f"radius = {found.tip.radius!r}"]
    lines += ["", "[tip]", *(f"{name} = {value!r}" for name, value in known_of(found).items())]
    known = {name: value for name, value in qualified.items() if value is not None}
    lines += ["", "[qualified]", *(f'"{name}" = {value!r}' for name, value in known.items())]
    return "\n".join(lines) + "\n"


def known_of(found: Qualification) -> dict[str, float]:
    """The entries of a tip that were measured or stated."""
    bending = () if found.bends else ("stiffness", "stiffness_std")
    return {name: value for name, value in asdict(found.tip).items() if name not in bending}


def read_tip(path, unit: str = "") -> Tip:
    """The tip of a probe.toml.

    Parameters
    ----------
    path : path-like
    unit : str
        That of the lengths that are wanted, where both this and the file's are known.

    Raises
    ------
    ValueError
        In one sentence: no file, no TOML, no table ``tip``, or an entry that a tip has not.
    """
    check_path(path, "the path of a probe.toml")
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; touchatlas qualify writes one as probe.toml")
    try:
        held = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} cannot be read as TOML ({error}); correct it") from None
    table, own = held.get("tip"), held.get("unit", "")
    if not isinstance(table, dict):
        raise ValueError(f"{path} has no table [tip]; touchatlas qualify writes one")
    names = [field.name for field in fields(Tip)]
    if unknown := [name for name in table if name not in names]:
        raise ValueError(f"{path} has {unknown[0]} in [tip]; there are {', '.join(names)}")
    try:
        tip = Tip(**table)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if not (unit and own):
        return tip
    for name in (unit, own):
        if name not in _MILLIMETRES:
            known = ", ".join(_MILLIMETRES)
            raise ValueError(f"{path}: there is no unit {name!r}; give one of {known}")
    return tip.in_unit(_MILLIMETRES[own] / _MILLIMETRES[unit])

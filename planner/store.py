"""Save and load a planner: one JSON file, written whole or not at all.

The file holds all attributes of a planner and of its parts. Of classes it can name those listed
here alone, so that reading one runs no code of others.
"""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from enum import Enum
from typing import Any

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.files import check_path, write_whole
from touchatlas.atlas.whole_file import DamagedError, FileKind, load_whole
from touchatlas.patch.geometry.contour import SamplingPlane
from touchatlas.planner.attempts import Attempts, Pending, Target
from touchatlas.planner.known import DeviationRatio, KnownArea
from touchatlas.planner.options import PlannerLevels, PlannerOptions
from touchatlas.planner.planner import Planner
from touchatlas.planner.probe_plan import ProbePlan, Reason
from touchatlas.planner.stop import Forecast, Stop, StopReason

# The version is that of the file, no unit.
_FILE = FileKind("planner", "one that save_planner wrote", 12, "begin with a new planner")
# Made without their constructors, of all their attributes.
_MADE = (Planner, Attempts, DeviationRatio, KnownArea)
_VALUES = (ProbePlan, SamplingPlane, Pending, Target, Stop, Forecast, PlannerOptions, PlannerLevels)
_RECORDS: dict[str, type] = {kind.__name__: kind for kind in (*_MADE, *_VALUES)}
_GENERATORS = ("MT19937", "PCG64", "PCG64DXSM", "Philox", "SFC64")


def save_planner(path, planner: Planner, atlas: Atlas) -> None:
    """Write a planner to a file, with its pending plans and its random numbers, and by which
    samples and ways the atlas of its touches is known again. If that fails, the file stays as it
    was.

    Save the atlas (``save_atlas``) before it: the loaded planner with the loaded atlas plans what
    these two would have planned. After a crash between the two, the last plan is still pending.

    Raises
    ------
    ValueError
        When the arguments are no path, no planner of this package and no Atlas.
    OSError
        When the file cannot be written.
    """
    if type(planner) is not Planner:
        raise ValueError(
            f"got {type(planner).__name__} for the planner; call save_planner(path, planner, atlas)"
        )
    _check_atlas(atlas)
    check_path(path)
    state = json.dumps(_encoded(planner))
    counts = [atlas.point_count, len(atlas.ways)]
    known = {"counts": counts, "sha256": _fingerprint(atlas, counts)}
    digest = _digest(known, state)
    whole = {"format": _FILE.number, "atlas": known, "sha256": digest, "planner": state}
    write_whole(path, json.dumps(whole).encode())


def load_planner(path, atlas: Atlas) -> Planner:
    """Read a Planner that ``save_planner`` wrote, to go on with its atlas.

    The atlas may have learned more touches since the planner was saved.

    Raises
    ------
    ValueError
        When the arguments are no path and no Atlas, the file is missing, cut off, altered, or of
        another format, or the planner was saved with another atlas.
    """
    _check_atlas(atlas)
    known, planner = load_whole(path, _FILE, _read, _checked)
    if _fingerprint(atlas, known["counts"]) != known["sha256"]:
        raise ValueError(
            f"{path} was saved with another atlas than this one, which has other samples, ways, "
            "tolerance or options; load the atlas that was saved with it, or begin with a new "
            "planner"
        )
    return planner


def _check_atlas(atlas) -> None:
    if not isinstance(atlas, Atlas):
        raise ValueError(f"got {type(atlas).__name__} for the atlas; give the one of the planner")


def _fingerprint(atlas: Atlas, counts: Sequence[int]) -> str:
    """Digest of the first samples and ways of an atlas, so many of each, and of how it learns;
    empty where it has fewer.

    The index of a sample or way never changes, so an atlas that learns more keeps it.
    """
    first = [array[:n] for array, n in zip((atlas.pool.points, atlas.ways), counts, strict=True)]
    if [len(array) for array in first] != list(counts):
        return ""
    learns = json.dumps([atlas.tolerance, atlas.scale, asdict(atlas.options)], sort_keys=True)
    learned = b"".join(array.astype("<f8").tobytes() for array in first)
    return hashlib.sha256(learns.encode() + learned).hexdigest()


def _digest(known: dict[str, Any], state: str) -> str:
    """Digest of what is said of the atlas, and of the planner."""
    both = json.dumps([known, state], sort_keys=True)
    return hashlib.sha256(both.encode()).hexdigest()


def _read(data: bytes) -> tuple[Any, Any]:
    """The number of the format of a file, and all it holds."""
    whole = json.loads(data)
    return whole["format"], whole


def _checked(whole: Any) -> tuple[dict[str, Any], Planner]:
    """What is said of the atlas in a file, and its planner, after the digest of both."""
    known = whole["atlas"]
    counts = known["counts"]
    if [type(n) for n in counts] != [int, int] or min(counts) < 0 or not known["sha256"]:
        raise DamagedError("it says nothing of its atlas")
    if _digest(known, whole["planner"]) != whole["sha256"]:
        raise DamagedError("its digest is that of other bytes")
    return known, _planner(json.loads(whole["planner"]))


def _planner(state: Any) -> Planner:
    """The planner of a state; DamagedError where it is that of another class or version."""
    planner = _decoded(state)
    if not isinstance(planner, Planner):
        raise DamagedError("it holds no planner")
    if not _is_alike(planner, Planner((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))):
        raise DamagedError("it is that of another version")
    return planner


def _is_alike(one: Any, new: Any) -> bool:
    """Whether a planner, or a part, has the attributes of a new one, and so have its parts."""
    if type(one) is not type(new) or vars(one).keys() != vars(new).keys():
        return False
    parts = {name: part for name, part in vars(new).items() if isinstance(part, _MADE)}
    return all(_is_alike(vars(one)[name], part) for name, part in parts.items())


def _encoded(value: Any) -> Any:
    """A value as JSON: a number or word as it is, else the name of its class and its parts."""
    if isinstance(value, np.generic):
        return _encoded(value.item())
    if value is None or isinstance(value, bool | str | int | float):
        return value
    if callable(value):
        # Where arms end is asked of the atlas, to which a pending plan is bound again.
        return None
    return {type(value).__name__: _parts(value)}


def _parts(value: Any) -> list[Any]:
    """What a value is made of."""
    if isinstance(value, np.ndarray):
        return [value.dtype.str, list(value.shape), value.ravel().tolist()]
    if isinstance(value, Enum):
        return [value.value]
    if isinstance(value, np.random.Generator):
        return [_encoded(value.bit_generator.state)]
    if isinstance(value, dict):
        return [[_encoded(key), _encoded(one)] for key, one in value.items()]
    if isinstance(value, list | tuple | set):
        return [_encoded(one) for one in value]
    if type(value).__name__ not in _RECORDS:
        raise TypeError(f"a planner with a {type(value).__name__} cannot be saved")
    return [[name, _encoded(one)] for name, one in vars(value).items()]


def _decoded(value: Any) -> Any:
    """The value that ``_encoded`` made JSON of."""
    if not isinstance(value, dict):
        return value
    ((kind, parts),) = value.items()
    if kind in _MAKERS:
        return _MAKERS[kind](parts)
    record, attributes = _RECORDS[kind], {name: _decoded(one) for name, one in parts}
    if record in _MADE:
        made = object.__new__(record)
        vars(made).update(attributes)
        return made
    # Constructors check values.
    return record(**attributes)


def _mapping(parts: list[Any]) -> dict[Any, Any]:
    return {_decoded(key): _decoded(one) for key, one in parts}


def _generator(parts: list[Any]) -> np.random.Generator:
    state = _decoded(parts[0])
    if state["bit_generator"] not in _GENERATORS:
        raise DamagedError("its random numbers are of no generator of numpy")
    bits = getattr(np.random, state["bit_generator"])()
    bits.state = state
    return np.random.Generator(bits)


_MAKERS: dict[str, Callable[[list[Any]], Any]] = {
    "ndarray": lambda parts: np.array(parts[2], np.dtype(parts[0])).reshape(parts[1]),
    "Generator": _generator,
    "dict": _mapping,
    "list": lambda parts: [_decoded(one) for one in parts],
    "tuple": lambda parts: tuple(map(_decoded, parts)),
    "set": lambda parts: set(map(_decoded, parts)),
    "Reason": lambda parts: Reason(*parts),
    "StopReason": lambda parts: StopReason(*parts),
}

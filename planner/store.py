"""Save and load a planner: one JSON file, written whole or not at all.

The file holds all attributes of a planner and of its parts. Of classes it can name those listed
here alone, so that reading one runs no code of others.
"""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.check.faults import Fault
from touchatlas.atlas.check.free_disc import FreeDisc
from touchatlas.atlas.files import DamagedError, FileKind, check_path, load_whole, write_whole
from touchatlas.patch.geometry.contour import SamplingPlane
from touchatlas.planner.attempts import Attempts, Pending, Target
from touchatlas.planner.cost_model import CostModel
from touchatlas.planner.known import Areas, KnownArea
from touchatlas.planner.options import PlannerLevels, PlannerOptions
from touchatlas.planner.places import Places
from touchatlas.planner.planner import Planner
from touchatlas.planner.probe_plan import ProbePlan, Reason
from touchatlas.planner.stop import Forecast, Stop, StopReason

# The version is that of the file, no unit.
_FILE = FileKind("planner", "one that save_planner wrote", 16, "begin with a new planner")
# What a planner is made of; constructors check values.
_PARTS = (Attempts, Areas, KnownArea, ProbePlan, SamplingPlane, Pending, Target, Stop)
_RECORDS: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        *(Planner, *_PARTS, Forecast, FreeDisc, Fault),
        *(PlannerOptions, PlannerLevels, CostModel),
    )
}
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
    if vars(planner).keys() != vars(Planner((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))).keys():
        raise DamagedError("it is that of another version")
    return planner


def _encoded(value: Any) -> Any:
    """A value as JSON: a number or word as it is, else the name of its class and its parts."""
    if isinstance(value, np.generic):
        return _encoded(value.item())
    if value is None or isinstance(value, bool | str | int | float):
        return value
    if callable(value):
        # Where arms end is asked of the atlas, to which a pending plan is bound again.
        return None
    if isinstance(value, Places):
        # They are those of the atlas, and computed from it again.
        return None
    for name, (kind, parts, _) in _KINDS.items():
        if isinstance(value, kind):
            return {name: parts(value)}
    if type(value).__name__ not in _RECORDS:
        raise TypeError(f"a planner with a {type(value).__name__} cannot be saved")
    return {type(value).__name__: [[name, _encoded(one)] for name, one in vars(value).items()]}


def _decoded(value: Any) -> Any:
    """The value that ``_encoded`` made JSON of."""
    if not isinstance(value, dict):
        return value
    ((name, parts),) = value.items()
    if name in _KINDS:
        return _KINDS[name][2](parts)
    record, attributes = _RECORDS[name], {key: _decoded(one) for key, one in parts}
    if record is not Planner:
        return record(**attributes)
    planner = object.__new__(Planner)
    vars(planner).update(attributes)
    return planner


def _generator(parts: list[Any]) -> np.random.Generator:
    state = _decoded(parts[0])
    if state["bit_generator"] not in _GENERATORS:
        raise DamagedError("its random numbers are of no generator of numpy")
    bits = getattr(np.random, state["bit_generator"])()
    bits.state = state
    return np.random.Generator(bits)


def _each(values) -> list[Any]:
    return [_encoded(one) for one in values]


# The parts of a value of each class, and the value of these parts.
_KINDS: dict[str, tuple[type, Callable[[Any], list[Any]], Callable[[list[Any]], Any]]] = {
    "ndarray": (
        np.ndarray,
        lambda array: [array.dtype.str, list(array.shape), array.ravel().tolist()],
        lambda parts: np.array(parts[2], np.dtype(parts[0])).reshape(parts[1]),
    ),
    "Generator": (np.random.Generator, lambda rng: _each([rng.bit_generator.state]), _generator),
    "dict": (
        dict,
        lambda mapping: [_each(pair) for pair in mapping.items()],
        lambda parts: {_decoded(key): _decoded(one) for key, one in parts},
    ),
    "list": (list, _each, lambda parts: [_decoded(one) for one in parts]),
    "tuple": (tuple, _each, lambda parts: tuple(map(_decoded, parts))),
    "Reason": (Reason, lambda reason: [reason.value], lambda parts: Reason(*parts)),
    "StopReason": (StopReason, lambda reason: [reason.value], lambda parts: StopReason(*parts)),
}

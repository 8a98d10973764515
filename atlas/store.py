"""Save and load an atlas: one .npz file without pickle, written whole or not at all.

The file holds what was learned. What follows from it, such as cells, is computed after loading.
"""

import io
import json
import zipfile
from dataclasses import asdict
from typing import Any

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.faces.law_arrays import law_arrays, law_of_arrays
from touchatlas.atlas.files import write_whole
from touchatlas.atlas.graph.lost_ends import LostEnds
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.records.options import AtlasOptions
from touchatlas.atlas.residual.binned_samples import PatchSamples
from touchatlas.atlas.residual.hyperparameters import ResidualScale
from touchatlas.atlas.residual.learn_residuals import enter, solve_patch_residual
from touchatlas.atlas.whole_file import DamagedError, FileKind, load_whole
from touchatlas.patch.fit.fit_patch import FitOptions

# The version is that of the file, no unit.
_FILE = FileKind("atlas", "the atlas.npz of a run", 9, "explore again")
_LAW = "count", "std", "edges", "share", "sharp"
_POOL = "points", "normals", "across", "edges", "visited"


def atlas_bytes(atlas: Atlas) -> bytes:
    """The bytes that ``save_atlas`` writes; they are equal for atlases that learned the same."""
    header = {
        "format": _FILE.number,
        "tolerance": atlas.tolerance,
        "scale": atlas.scale if atlas.scale_is_given or atlas.point_count else None,
        "touches": atlas.touches,
        "options": asdict(atlas.options),
        "residual_scale": asdict(atlas.residual_scale),
        "law": {name: getattr(atlas.known_law, name) for name in _LAW},
    }
    table, membership = atlas.table, atlas.membership
    neighbours = [sorted(atlas.neighbours[row]) for row in range(len(atlas.neighbours))]
    arrays = {
        "header": np.frombuffer(json.dumps(header, sort_keys=True).encode(), np.uint8),
        "lengths": table.lengths,
        **{f"table_{name}": getattr(table, name) for name in table.names},
        **{f"sample_{name}": getattr(membership.pool, name) for name in _POOL},
        **_packed("fitted", membership.fitted),
        **_packed("owned", membership.owned),
        **_packed("neighbours", neighbours),
        **{f"ends_{name}": column for name, column in vars(atlas.edge_ends).items()},
        **{f"rims_{name}": getattr(atlas.rims.ends, name) for name in LostEnds.NAMES},
        **_residual_arrays(table),
        **law_arrays(atlas.known_law),
    }
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def save_atlas(path, atlas: Atlas) -> None:
    """Write an atlas to a file. If that fails, the file stays as it was.

    Raises
    ------
    ValueError
        When the arguments are no path and no Atlas.
    OSError
        When the file cannot be written.
    """
    if not isinstance(atlas, Atlas):
        raise ValueError(f"got {type(atlas).__name__} for the atlas; call save_atlas(path, atlas)")
    _FILE.check_path(path)
    write_whole(path, atlas_bytes(atlas))


def load_atlas(path) -> Atlas:
    """Read an atlas written by ``save_atlas``.

    Raises
    ------
    ValueError
        When the path is none, or the file is missing, cut off, altered, or of another format.
    """
    return load_whole(path, _FILE, _read, lambda content: _restored(*content))


def _read(data: bytes) -> tuple[Any, tuple[dict[str, np.ndarray], Any]]:
    """The number of the format of a file, and its arrays and header."""
    file = io.BytesIO(data)
    if not zipfile.is_zipfile(file):
        raise DamagedError("it has no end")
    with np.load(file, allow_pickle=False) as parts:
        arrays = {name: parts[name] for name in parts.files}
    header = json.loads(arrays["header"].tobytes())
    return header["format"], (arrays, header)


def _restored(arrays, header) -> Atlas:
    """The atlas from the arrays and the header of a file."""
    options = header["options"]
    atlas = Atlas(
        header["tolerance"],
        AtlasOptions(**{**options, "fit": FitOptions(**options["fit"])}),
        header["scale"],
    )
    _check_lengths(arrays)
    atlas.touches = header["touches"]
    atlas.residual_scale = ResidualScale(**header["residual_scale"])
    table, membership = atlas.table, atlas.membership
    table.extend({name: arrays[f"table_{name}"] for name in table.names})
    table.lengths = arrays["lengths"]
    _fill_residuals(table, arrays)
    membership.pool.add(*(arrays[f"sample_{name}"] for name in _POOL))
    membership.fitted.extend(_unpacked("fitted", arrays))
    membership.owned.extend(_unpacked("owned", arrays))
    for row, neighbours in enumerate(_unpacked("neighbours", arrays)):
        atlas.neighbours.append(i for i in neighbours.tolist() if i < row)
    for name in vars(atlas.edge_ends):
        _fill_column(atlas.edge_ends, name, arrays[f"ends_{name}"])
    for name in LostEnds.NAMES:
        _fill_column(atlas.rims.ends, name, arrays[f"rims_{name}"])
    atlas.mark_stale(table.rows.tolist())
    atlas.known_law = law_of_arrays(arrays, header["law"], membership.pool)
    return atlas


def _check_lengths(arrays) -> None:
    """Raise DamagedError unless columns of one kind are equally long."""
    for kind in ("table", "sample", "ends", "rims"):
        counts = {n: len(a) for n, a in arrays.items() if n.startswith(f"{kind}_")}
        if len(set(counts.values())) > 1:
            raise DamagedError("its columns are not equally long")
    for kind in ("fitted", "owned", "neighbours"):
        counts = arrays[f"{kind}_counts"]
        if len(counts) != len(arrays["table_alive"]) or counts.sum() != len(arrays[kind]):
            raise DamagedError(f"{kind} and {kind}_counts do not agree")


def _fill_column(ends, name: str, column) -> None:
    """Enter a column of ends, which is empty so far; DamagedError where it is not of its kind."""
    empty = getattr(ends, name)
    if column.shape[1:] != empty.shape[1:] or column.dtype != empty.dtype:
        raise DamagedError("a column of ends has another shape or type")
    setattr(ends, name, column)


def _residual_arrays(table: PatchTable) -> dict[str, np.ndarray]:
    """The data that the residuals are solved from, since they are solved again after loading."""
    rows = sorted(table.residuals)
    parts = [table.residuals[row] for row in rows]
    samples = [part.samples for part in parts]
    columns = [np.concatenate([s.feet[0].T, s.terms[:, 0], s.height, s.weight]) for s in samples]
    width = table.basis.size + 5
    return {
        "residual_rows": np.array(rows, np.int64),
        "residual_counts": np.array([s.weight.shape[1] for s in samples], np.int64),
        "residual_shapes": np.array([part.shape for part in parts]).reshape(-1, 4),
        "residual_noise": np.array([s.noise[0] for s in samples]),
        "residual_samples": np.concatenate([np.zeros((width, 0)), *columns], axis=1),
    }


def _fill_residuals(table: PatchTable, arrays) -> None:
    """Solve and enter the residuals of a file."""
    ends = np.cumsum(arrays["residual_counts"])[:-1]
    parts = np.split(arrays["residual_samples"], ends, axis=1)
    for i, row in enumerate(arrays["residual_rows"].tolist()):
        feet, (*terms, height, weight) = parts[i][:3].T, parts[i][3:]
        samples = PatchSamples(
            *(feet[None], np.array(terms)[:, None], height[None], weight[None]),
            arrays["residual_noise"][[i]],
        )
        enter(table, row, solve_patch_residual(table.basis, samples, arrays["residual_shapes"][i]))


def _packed(name: str, parts) -> dict[str, np.ndarray]:
    """Lists of integers as one array and their lengths."""
    counts = np.array([len(part) for part in parts], np.int64)
    whole = np.concatenate([np.zeros(0, np.int32), *parts]).astype(np.int32)
    return {f"{name}_counts": counts, name: whole}


def _unpacked(name: str, arrays) -> list[np.ndarray]:
    """Lists of integers from one array and their lengths."""
    counts = arrays[f"{name}_counts"]
    return np.split(arrays[name], np.cumsum(counts)[:-1]) if len(counts) else []

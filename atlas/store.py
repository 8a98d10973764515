"""Save and load an atlas: one .npz file without pickle, written whole or not at all.

The file holds what was learned. The surface that follows from it is computed after loading.
"""

import io
import json
import zipfile
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.body.saved_faces import face_arrays, known_of_arrays, pieces_of
from touchatlas.atlas.files import DamagedError, FileKind, check_path, load_whole, write_whole
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.mesh.surface import with_fewer_patches
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.records.options import AtlasOptions, Levels
from touchatlas.atlas.samples import crossings
from touchatlas.atlas.samples.crossings import Crossings
from touchatlas.atlas.samples.evidence import WIDTH, TouchEvidence
from touchatlas.atlas.samples.lost_ends import LostEnds
from touchatlas.atlas.samples.sample_pool import NAMES
from touchatlas.patch.geometry.arrays import real

# The version is that of the file, no unit.
_FILE = FileKind("atlas", "the atlas.npz of a run", 21, "explore again")
_LAW = "count", "looked", "std", "is_few"


def atlas_bytes(atlas: Atlas) -> bytes:
    """The bytes that ``save_atlas`` writes; they are equal for atlases that learned the same."""
    header = {
        "format": _FILE.number,
        "tolerance": atlas.tolerance,
        "scale": atlas.scale if atlas.scale_is_given or atlas.point_count else None,
        "scale_is_given": atlas.scale_is_given,
        "touches": atlas.touches,
        "settled": atlas.settled,
        "tip_radius": atlas.pool.tip_radius,
        "systematic_std": atlas.systematic_std,
        "options": asdict(atlas.options),
        "law": {name: getattr(atlas.known_body, name) for name in _LAW}
        | {"is_one_face": atlas.known_body.is_one_face},
    }
    arrays = {
        "header": np.frombuffer(json.dumps(header, sort_keys=True).encode(), np.uint8),
        **{f"sample_{name}": getattr(atlas.pool, name) for name in NAMES},
        **{f"rims_{name}": getattr(atlas.rims.ends, name) for name in LostEnds.NAMES},
        "ways": atlas.ways,
        "innovations": atlas.innovations,
        "evidence": atlas.evidence.table,
        "crossings": atlas.evidence.crossings.table,
        "bad_contacts": atlas.bad_contacts,
        **face_arrays(atlas.known_body),
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
    check_path(path)
    write_whole(path, atlas_bytes(atlas))


def load_atlas(path, finished: bool = True) -> Atlas:
    """Read an atlas written by ``save_atlas``.

    Parameters
    ----------
    path
    finished : bool
        Whether patches that ``finish`` made few stay so. To go on, all are taken again.

    Raises
    ------
    ValueError
        When the path is none, or the file is missing, cut off, altered, or of another format.
    """
    return load_whole(path, _FILE, _read, lambda content: _restored(*content, finished))


def load_labels(path) -> tuple[Atlas, list[Piece], np.ndarray, bool]:
    """Read what an atlas of a file learned, without the surface that follows: the atlas, its
    pieces, the piece of each sample (n,), -1 for none, and whether all were one face."""

    def made(content):
        arrays, header = content
        atlas, of = _learned(arrays, header), arrays["label_of"].astype(int)
        of = of if len(of) else np.full(len(atlas.pool), NONE)
        return atlas, pieces_of(arrays), of, header["law"]["is_one_face"] is True

    return load_whole(path, _FILE, _read, made)


def _read(data: bytes) -> tuple[Any, tuple[dict[str, np.ndarray], Any]]:
    """The number of the format of a file, and its arrays and header."""
    file = io.BytesIO(data)
    if not zipfile.is_zipfile(file):
        raise DamagedError("it has no end")
    with np.load(file, allow_pickle=False) as parts:
        arrays = {name: parts[name] for name in parts.files}
    header = json.loads(arrays["header"].tobytes())
    return header["format"], (arrays, header)


def _restored(arrays, header, finished: bool) -> Atlas:
    """The atlas from the arrays and the header of a file, ``finished`` if it was."""
    atlas = _learned(arrays, header)
    known = known_of_arrays(arrays, header["law"], atlas.pool, atlas.levels)
    innovations, settled = atlas.innovations, atlas.settled
    # The surface ends at the rims of the atlas, which tell where it is drawn.
    atlas.know(replace(known, is_few=False))
    if known.is_few is True and finished:
        atlas.know(with_fewer_patches(atlas.known_body, atlas.tolerance))
    atlas.innovations, atlas.settled = innovations, settled
    return atlas


def _learned(arrays, header) -> Atlas:
    """The atlas without its surface."""
    levels = Levels(**header["options"].pop("levels"))
    options = AtlasOptions(**header["options"], levels=levels)
    atlas = Atlas(header["tolerance"], options, header["scale"])
    atlas.scale_is_given = header["scale_is_given"] is True
    _check_lengths(arrays)
    atlas.touches = header["touches"]
    atlas.pool.tip_radius = _length(header["tip_radius"])
    atlas.systematic_std = _length(header["systematic_std"])
    atlas.pool.add(*(arrays[f"sample_{name}"] for name in NAMES))
    for name in LostEnds.NAMES:
        empty, column = getattr(atlas.rims.ends, name), arrays[f"rims_{name}"]
        if column.shape[1:] != empty.shape[1:] or column.dtype != empty.dtype:
            raise DamagedError("a column of ends has another shape or type")
        setattr(atlas.rims.ends, name, column)
    atlas.ways = arrays["ways"]
    if atlas.ways.shape[1:] != (2, 3) or atlas.ways.dtype != float:
        raise DamagedError("its ways have another shape or type")
    if not np.isfinite(atlas.ways).all():
        raise DamagedError("its ways are not finite")
    atlas.innovations = _rows(arrays["innovations"], 6, "innovations")
    atlas.bad_contacts = _rows(arrays["bad_contacts"], 3, "bad contacts")
    rows = _rows(arrays["evidence"], WIDTH, "evidence")
    touches = tuple(TouchEvidence(*row) for row in rows.tolist())
    found = Crossings.of_table(_rows(arrays["crossings"], crossings.WIDTH, "crossings"))
    atlas.evidence = replace(atlas.evidence, touches=touches, crossings=found)
    atlas.settled = int(header["settled"])
    return atlas


def _rows(found, width: int, name: str) -> np.ndarray:
    """The rows (k, width) of a file that have a name; DamagedError where they are none."""
    if found.shape[1:] != (width,) or found.dtype != float or not np.isfinite(found).all():
        raise DamagedError(f"its {name} have another shape or type, or are not finite")
    return np.asarray(found)


def _length(number) -> float:
    """A length of a header; DamagedError where it is none."""
    if not 0.0 <= real(number) < np.inf:
        raise DamagedError("a length of its tip is none")
    return float(number)


def _check_lengths(arrays) -> None:
    """Raise DamagedError unless columns of one kind are equally long."""
    for kind in ("sample", "rims"):
        counts = {n: len(a) for n, a in arrays.items() if n.startswith(f"{kind}_")}
        if len(set(counts.values())) > 1:
            raise DamagedError("its columns are not equally long")

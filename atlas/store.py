"""Save and load an atlas: one packed .npz, no pickle, whole or not at all."""

import io
import json
import os
import zipfile
from dataclasses import asdict
from pathlib import Path

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasOptions
from touchatlas.atlas.patch_samples import PatchSamples
from touchatlas.atlas.rough import enter, rough_patch
from touchatlas.atlas.table import Table
from touchatlas.atlas.texture import Texture
from touchatlas.patch.fit import FitOptions

FORMAT = 2


def save_atlas(path, atlas: Atlas) -> None:
    """Write an atlas to a file: all of it, or the file stays as it was."""
    header = {
        "format": FORMAT,
        "tolerance": atlas.tolerance,
        "touches": atlas.touches,
        "options": asdict(atlas.options),
        "texture": asdict(atlas.texture),
    }
    lengths = [len(points) for points, _ in atlas.samples]
    arrays = {
        "header": np.frombuffer(json.dumps(header, sort_keys=True).encode(), np.uint8),
        "sample_counts": np.array(lengths, np.int64),
        "sample_points": _stack([p for p, _ in atlas.samples]),
        "sample_normals": _stack([n for _, n in atlas.samples]),
        "kin_counts": np.array([len(k) for k in atlas.kin], np.int64),
        "kin": np.array([j for k in atlas.kin for j in sorted(k)], np.int64),
        "frontier_points": atlas.frontier.points,
        "frontier_normals": atlas.frontier.normals,
        "frontier_home": atlas.frontier.home,
        "frontier_depth": atlas.frontier.depth,
        "length_sums": atlas.length_sums,
    }
    arrays |= {f"table_{name}": getattr(atlas.table, name) for name in atlas.table.names}
    arrays |= _rough_arrays(atlas.table)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    write_whole(path, buffer.getvalue())


def load_atlas(path) -> Atlas:
    """Read an atlas written by ``save_atlas``; boundaries are drawn anew from the patches.

    Raises
    ------
    ValueError
        When the file is missing, cut off, altered, or of a later format.
    """
    try:
        with np.load(io.BytesIO(Path(path).read_bytes()), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(arrays["header"].tobytes())
    except FileNotFoundError:
        raise ValueError(f"{path} does not exist; give the atlas.npz of a run") from None
    except (zipfile.BadZipFile, ValueError, KeyError, EOFError, OSError) as error:
        raise ValueError(
            f"{path} is no whole atlas file ({error}); it was cut off or altered"
        ) from None
    if header["format"] != FORMAT:
        raise ValueError(
            f"{path} has format {header['format']}; this version reads {FORMAT}: use the version "
            "that wrote it, or explore again"
        )
    options = header["options"]
    atlas = Atlas(
        header["tolerance"], AtlasOptions(**{**options, "fit": FitOptions(**options["fit"])})
    )
    _fill(atlas, arrays, header)
    return atlas


def _rough_arrays(table: Table) -> dict[str, np.ndarray]:
    """What the residuals were solved from: they are solved again when read."""
    rows = sorted(table.rough)
    parts = [table.rough[row] for row in rows]
    samples = [part.samples for part in parts]
    columns = [np.concatenate([s.feet[0].T, s.terms[:, 0], s.height, s.weight]) for s in samples]
    width = table.basis.size + 5
    return {
        "rough": np.array(rows, np.int64),
        "rough_counts": np.array([s.weight.shape[1] for s in samples], np.int64),
        "rough_shapes": np.array([part.shape for part in parts]).reshape(-1, 4),
        "rough_noise": np.array([s.noise[0] for s in samples]),
        "rough_samples": np.concatenate([np.zeros((width, 0)), *columns], axis=1),
    }


def _fill_rough(table: Table, arrays) -> None:
    ends = np.cumsum(arrays["rough_counts"])[:-1]
    parts = np.split(arrays["rough_samples"], ends, axis=1)
    for i, row in enumerate(arrays["rough"].tolist()):
        feet, (*terms, height, weight) = parts[i][:3].T, parts[i][3:]
        samples = PatchSamples(
            *(feet[None], np.array(terms)[:, None], height[None], weight[None]),
            arrays["rough_noise"][[i]],
        )
        enter(table, row, rough_patch(table.basis, samples, arrays["rough_shapes"][i]))


def _fill(atlas: Atlas, arrays, header) -> None:
    atlas.touches = header["touches"]
    atlas.texture = Texture(**header["texture"])
    atlas.table.extend({name: arrays[f"table_{name}"] for name in atlas.table.names})
    _fill_rough(atlas.table, arrays)
    ends = np.cumsum(arrays["sample_counts"])[:-1]
    points, normals = arrays["sample_points"], arrays["sample_normals"]
    atlas.samples = list(zip(np.split(points, ends), np.split(normals, ends), strict=True))
    ends = np.cumsum(arrays["kin_counts"])[:-1]
    atlas.kin.extend(set(k.tolist()) for k in np.split(arrays["kin"], ends))
    if not len(arrays["kin_counts"]):
        atlas.samples = []
        atlas.kin.clear()
    for name in ("points", "normals", "home", "depth"):
        setattr(atlas.frontier, name, arrays[f"frontier_{name}"])
    atlas.length_sums = arrays["length_sums"]
    for row in range(len(atlas)):
        atlas.tiling.add(row)
    atlas.retile()


def _stack(parts) -> np.ndarray:
    return np.concatenate(parts) if parts else np.zeros((0, 3))


def write_whole(path, data: bytes) -> None:
    """Write a file so that a crash or a full disk leaves the old one or the new one."""
    path = Path(path)
    part = path.with_name(path.name + ".part")
    try:
        with open(part, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except OSError:
        part.unlink(missing_ok=True)
        raise

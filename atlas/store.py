"""Save and load an atlas: one packed .npz, no pickle, whole or not at all."""

import io
import json
import os
import tokenize
import zipfile
from dataclasses import asdict
from pathlib import Path

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.graph.creases import Crease
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.records.options import AtlasOptions
from touchatlas.atlas.residual.binned_samples import PatchSamples
from touchatlas.atlas.residual.hyperparameters import ResidualScale
from touchatlas.atlas.residual.learn_residuals import enter, solve_patch_residual
from touchatlas.patch.fit.fit_patch import FitOptions

FORMAT = 3
# What reading raises when a file is not as it was written.
_DAMAGE = (
    zipfile.BadZipFile,
    ArithmeticError,
    ValueError,
    LookupError,
    TypeError,
    RuntimeError,
    SyntaxError,
    tokenize.TokenError,
    EOFError,
    OSError,
)


def save_atlas(path, atlas: Atlas) -> None:
    """Write an atlas to a file: all of it, or the file stays as it was."""
    header = {
        "format": FORMAT,
        "tolerance": atlas.tolerance,
        "touches": atlas.touches,
        "options": asdict(atlas.options),
        "texture": asdict(atlas.residual_scale),
    }
    pool, membership = atlas.membership.pool, atlas.membership
    arrays = {
        "header": np.frombuffer(json.dumps(header, sort_keys=True).encode(), np.uint8),
        "sample_points": pool.points,
        "sample_normals": pool.normals,
        "sample_across": pool.across,
        "lengths": atlas.table.lengths,
        "sample_edges": pool.edges,
        **_packed("members", membership.fitted),
        **_packed("brought", membership.owned),
        **_packed("kin", [sorted(k) for k in atlas.neighbours]),
        "frontier_points": atlas.frontier.points,
        "frontier_normals": atlas.frontier.normals,
        "frontier_home": atlas.frontier.home,
        "frontier_depth": atlas.frontier.depth,
        **_packed_creases(atlas),
    }
    arrays |= {f"ends_{name}": column for name, column in vars(atlas.edge_ends).items()}
    arrays |= {f"table_{name}": getattr(atlas.table, name) for name in atlas.table.names}
    arrays |= _residual_arrays(atlas.table)
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    write_whole(path, buffer.getvalue())


def load_atlas(path) -> Atlas:
    """Read an atlas written by ``save_atlas``; boundaries are drawn anew from the patches.

    Raises
    ------
    ValueError
        When the file is missing, cut off, altered, or of a later format.
    """
    if Path(path).exists() and not Path(path).is_file():
        raise ValueError(f"{path} is a folder or device; give the atlas.npz of a run")
    try:
        data = io.BytesIO(Path(path).read_bytes())
        if not zipfile.is_zipfile(data):
            raise zipfile.BadZipFile("it has no end")
        with np.load(data, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(arrays["header"].tobytes())
    except FileNotFoundError:
        raise ValueError(f"{path} does not exist; give the atlas.npz of a run") from None
    except _DAMAGE as error:
        raise _damaged(path, error) from None
    if isinstance(header, dict) and header.get("format", 0) > FORMAT:
        raise ValueError(
            f"{path} has format {header['format']}; this version reads up to {FORMAT}: update it"
        )
    try:
        return _restored(arrays, header)
    except (*_DAMAGE, AttributeError) as error:
        raise _damaged(path, error) from None


def _damaged(path, error: Exception) -> ValueError:
    return ValueError(
        f"{path} is no whole atlas file ({error}); it was cut off or altered: give another copy"
    )


def _restored(arrays, header) -> Atlas:
    """The atlas of what a file holds, of any format up to this one."""
    if header["format"] == 1:
        arrays |= _from_format_1(arrays)
        header["texture"] = {}
    options = header["options"]
    atlas = Atlas(
        header["tolerance"], AtlasOptions(**{**options, "fit": FitOptions(**options["fit"])})
    )
    if header["format"] < 3:
        arrays["table_moments"] = atlas.table.products.moments_of(arrays["table_gram"])
        arrays["table_variance"] = atlas.table.products.quadratic_forms(arrays["table_covariance"])
    _check_lengths(arrays)
    _fill(atlas, arrays, header)
    if header["format"] == 1:
        atlas.refit_all()
    return atlas


def _residual_arrays(table: PatchTable) -> dict[str, np.ndarray]:
    """What the residuals were solved from: they are solved again when read."""
    rows = sorted(table.residuals)
    parts = [table.residuals[row] for row in rows]
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


def _fill_residuals(table: PatchTable, arrays) -> None:
    ends = np.cumsum(arrays["rough_counts"])[:-1]
    parts = np.split(arrays["rough_samples"], ends, axis=1)
    for i, row in enumerate(arrays["rough"].tolist()):
        feet, (*terms, height, weight) = parts[i][:3].T, parts[i][3:]
        samples = PatchSamples(
            *(feet[None], np.array(terms)[:, None], height[None], weight[None]),
            arrays["rough_noise"][[i]],
        )
        enter(table, row, solve_patch_residual(table.basis, samples, arrays["rough_shapes"][i]))


def _check_lengths(arrays) -> None:
    """Columns of one thing are equally long.

    Raises
    ------
    ValueError
        Naming those that are not.
    """
    for kind in ("table", "sample", "frontier", "ends", "crease"):
        counts = {n: len(a) for n, a in arrays.items() if n.startswith(f"{kind}_")}
        counts.pop("sample_counts", None)
        if len(set(counts.values())) > 1:
            raise ValueError(f"columns are not equally long: {counts}")
    for kind in ("members", "brought", "kin"):
        counts = arrays[f"{kind}_counts"]
        if len(counts) != len(arrays["table_alive"]) or counts.sum() != len(arrays[kind]):
            raise ValueError(f"{kind} and {kind}_counts do not agree")


def _fill(atlas: Atlas, arrays, header) -> None:
    atlas.touches = header["touches"]
    atlas.table.extend({name: arrays[f"table_{name}"] for name in atlas.table.names})
    atlas.residual_scale = ResidualScale(**header["texture"])
    atlas.table.lengths = arrays["lengths"]
    _fill_residuals(atlas.table, arrays)
    membership = atlas.membership
    points, normals, across = (arrays[f"sample_{name}"] for name in ("points", "normals", "across"))
    membership.pool.add(points, normals, across, arrays.get("sample_edges", False))
    membership.fitted.extend(_unpacked("members", arrays))
    membership.owned.extend(_unpacked("brought", arrays))
    atlas.neighbours.extend(set(k.tolist()) for k in _unpacked("kin", arrays))
    for name in ("points", "normals", "home", "depth"):
        setattr(atlas.frontier, name, arrays[f"frontier_{name}"])
    if header["format"] > 1:
        _fill_creases(atlas, arrays)
    for row in range(atlas.table.size):
        atlas.cells.add(row, bool(atlas.table.alive[row]))
    atlas.cells.retile()


def _packed_creases(atlas: Atlas) -> dict[str, np.ndarray]:
    pairs = sorted(atlas.creases.pairs)
    creases = [atlas.creases.pairs[pair] for pair in pairs]
    return {
        "crease_pairs": np.array(pairs, np.int64).reshape(-1, 2),
        "crease_sign": np.array([crease.sign for crease in creases], np.int8),
        "crease_anchor": np.array([crease.anchor for crease in creases]).reshape(-1, 3),
    }


def _fill_creases(atlas: Atlas, arrays) -> None:
    names = ("crease_pairs", "crease_sign", "crease_anchor")
    for (i, j), sign, anchor in zip(*(arrays[name] for name in names), strict=True):
        atlas.creases.enter(int(i), int(j), Crease(int(sign), anchor))
    for name in vars(atlas.edge_ends):
        setattr(atlas.edge_ends, name, arrays[f"ends_{name}"])


def _from_format_1(arrays) -> dict[str, np.ndarray]:
    """What a file of format 1 lacks: which samples a patch learned from, their planes, the
    sites and anchors. The patches have to be fitted anew from the samples they brought."""
    count = len(arrays["sample_counts"])
    index = np.arange(len(arrays["sample_points"]), dtype=np.int32)
    split = np.split(index, np.cumsum(arrays["sample_counts"])[:-1]) if count else []
    nothing = [index[:0]] * count
    return {
        "table_alive": np.ones(count),
        "table_site": arrays["table_origin"],
        "table_anchor": arrays["table_mean"],
        "table_learned": arrays["table_count"],
        "table_sensor": arrays["table_noise"],
        "lengths": _lengths(arrays),
        "rough": np.zeros(0, np.int64),
        "rough_counts": np.zeros(0, np.int64),
        "rough_shapes": np.zeros((0, 4)),
        "rough_noise": np.zeros(0),
        "rough_samples": np.zeros((0, 0)),
        "sample_across": np.zeros_like(arrays["sample_points"]),
        **_packed("members", nothing),
        **_packed("brought", split),
    }


def _lengths(arrays) -> np.ndarray:
    """Sums over the log feature lengths of the patches of a file of format 1."""
    lengths = np.log(arrays["table_radius"] / arrays["table_turn"])
    return np.array([float(len(lengths)), lengths.sum(), (lengths * lengths).sum()])


def _packed(name: str, parts) -> dict[str, np.ndarray]:
    """Lists of integers as one array and their lengths."""
    counts = np.array([len(part) for part in parts], np.int64)
    whole = np.concatenate([np.zeros(0, np.int32), *parts]).astype(np.int32)
    return {f"{name}_counts": counts, name: whole}


def _unpacked(name: str, arrays) -> list[np.ndarray]:
    counts = arrays[f"{name}_counts"]
    return np.split(arrays[name], np.cumsum(counts)[:-1]) if len(counts) else []


def write_whole(path, data: bytes) -> None:
    """Write a file so that a crash or a full disk leaves the old one or the new one."""
    path = Path(path)
    if path.exists() and not path.is_file():
        raise OSError(f"{path} is a folder or a device; give the path of a file")
    part = path.with_name(path.name + ".part")
    try:
        with open(part, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        error.filename = str(path)
        raise

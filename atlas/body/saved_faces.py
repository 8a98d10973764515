"""Faces as arrays of a file, and back: the pieces, the kinds of which have names, and the labels.

Faces are read touch by touch, so that the samples alone would not give the same ones again.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from touchatlas.atlas.body.choose import KnownBody, body_of_faces, body_of_one
from touchatlas.atlas.body.read_faces import faces_of_labels, samples_of
from touchatlas.atlas.files import DamagedError
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.samples.sample_pool import SamplePool

_MOST = Kind.QUARTIC.terms


def face_arrays(known: KnownBody) -> dict[str, np.ndarray]:
    """The pieces and labels of faces; without faces, none."""
    pieces = known.faces.pieces if known.faces else []
    of = known.faces.patch_of if known.faces else np.zeros(0, int)
    return {
        "faces_std": np.array(known.faces.std if known.faces else 0.0),
        "label_of": of.astype(np.int32),
        "piece_kind": np.array([piece.kind.name.lower() for piece in pieces], str),
        "piece_origin": np.array([piece.origin for piece in pieces]).reshape(-1, 3),
        "piece_axes": np.array([piece.axes for piece in pieces]).reshape(-1, 3, 3),
        "piece_scale": np.array([piece.scale for piece in pieces], float),
        "piece_coefficients": _padded([piece.coefficients for piece in pieces], 1),
        "piece_covariance": _padded([piece.covariance for piece in pieces], 2),
    }


def known_of_arrays(
    arrays, header: dict[str, Any], pool: SamplePool, levels: Levels = Levels()
) -> KnownBody:
    """What a file knows of the samples of a pool.

    Raises
    ------
    DamagedError
        Its parts do not agree.
    """
    known, of, pieces = dict(header), arrays["label_of"].astype(int), pieces_of(arrays)
    is_one, count, looked = known.pop("is_one_face"), known["count"], known["looked"]
    sound = all(type(x) is int for x in (count, looked)) and 0 <= looked <= count <= len(pool)
    sound = sound and len(of) <= count and (len(of) == count or is_one is True)
    if not (sound and of.min(initial=NONE) >= NONE and of.max(initial=NONE) < len(pieces)):
        raise DamagedError("it says nothing of the samples that obey laws")
    found = KnownBody(**known)
    if len(of):
        samples = samples_of(pool, len(of), float(arrays["faces_std"]), levels)
        labels = Labels(Evidence(samples, SampleGraph(samples)))
        labels.resume(pieces, of)
        found = replace(found, faces=faces_of_labels(labels))
    if not count:
        return found
    samples, body = samples_of(pool, count, header["std"], levels), None
    if not is_one and found.faces is not None:
        body = body_of_faces(found.faces, samples)
    return replace(found, body=body_of_one(samples) if body is None else body)


def pieces_of(arrays) -> list[Piece]:
    """The pieces of a file."""
    columns = [arrays[f"piece_{name}"] for name in ("kind", "origin", "axes", "scale")]
    out = []
    for k, (kind, origin, axes, scale) in enumerate(zip(*columns, strict=True)):
        law = Kind[kind.upper()]
        size = law.terms
        own = arrays["piece_coefficients"][k, :size], arrays["piece_covariance"][k, :size, :size]
        out.append(Piece(law, origin, axes, float(scale), *own))
    return out


def _padded(parts, dimensions: int) -> np.ndarray:
    """(p, 21, ...) arrays (t, ...) of as many dimensions, padded with zeros."""
    out = np.zeros((len(parts),) + (_MOST,) * dimensions)
    for k, part in enumerate(parts):
        out[(k,) + (slice(len(part)),) * dimensions] = part
    return out

"""Invariants: what must hold of every atlas, checked from its parts."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from touchatlas.atlas.body.choose import body_of_one
from touchatlas.atlas.body.read_faces import samples_of
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.mesh.surface import with_fewer_patches
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import evenly

# Largest error of the square of a unit vector, no unit: far above rounding. Doubled, nothing else
# passes.
_ROUNDING = 1e-6
# Samples at which a free-form body is compared with one that is fitted again. Doubled, it takes
# longer.
_COMPARED = 64


def violations(state: AtlasState) -> list[str]:
    """A sentence for each invariant that does not hold; empty for a sound atlas."""
    found = [*_measured(state)]
    # What follows from something is not checked where that is unsound.
    return found or [*_known_body(state)] or [*_body_of_one(state)]


def _measured(state: AtlasState) -> Iterator[str]:
    """Samples, ends at which contact was lost, and ways have finite places, unit normals and
    tangents; noise is not negative, and steps are above zero."""
    pool, ends = state.pool, state.rims.ends
    if not np.isfinite(pool.points).all():
        yield "a sample's point is not finite"
    if not _are_unit(pool.normals):
        yield "a sample's normal is not of unit length"
    if not _are_unit(pool.across[pool.across.any(axis=1)]):
        yield "the normal of a sample's plane is not of unit length"
    if not (np.isfinite(pool.noise) & (pool.noise >= 0.0)).all():
        yield "the noise of a sample is no length"
    if not np.isfinite(ends.points).all():
        yield "an end at which contact was lost is not finite"
    if not (_are_unit(ends.tangents) and _are_unit(ends.normals)):
        yield "tangent or normal of an end at which contact was lost is not of unit length"
    if not ((ends.steps > 0) & np.isfinite(ends.steps)).all():
        yield "an end at which contact was lost has no sampling step"
    if not np.isfinite(state.ways).all():
        yield "the end of a way of the probe is not finite"


def _known_body(state: AtlasState) -> Iterator[str]:
    """The body is of samples that are there, and faces name faces and pieces that are there."""
    known, count = state.known_body, len(state.pool)
    if not 0 <= known.looked <= known.count <= count:
        yield "the body is of more samples than there are"
    if (known.body is None) != (known.count == 0):
        yield "there is a body without samples, or none of them"
    faces = known.faces
    if faces is not None and len(faces.of) > known.count:
        yield "faces have more samples than the body"
    elif faces is not None:
        if not ((faces.of >= NONE) & (faces.of < len(faces))).all():
            yield "a sample is of a face that is not there"
        if not np.array_equal(faces.points, state.pool.points[: len(faces.of)]):
            yield "the samples of the faces are not those of the pool"


def _body_of_one(state: AtlasState) -> Iterator[str]:
    """A body of one face is the one that its samples give when it is fitted again."""
    known = state.known_body
    if known.body is None or not known.is_one_face:
        return
    body = body_of_one(samples_of(state.pool, known.count, known.body.samples.std, state.levels))
    body.rims = known.body.rims
    again = replace(known, is_few=False, body=body)
    if known.is_few:
        again = with_fewer_patches(again, state.tolerance)
    assert again.body is not None
    body = again.body.with_air(state.ways, known.body.rims)
    points = evenly(state.pool.points[: known.count], _COMPARED)
    one, other = known.body.field.at(points), body.field.at(points)
    if not np.allclose(one.distance, other.distance, rtol=0.0, atol=1e-3 * state.sample_std):
        yield "the body is not that of its samples"


def _are_unit(vectors) -> bool:
    """Whether vectors (n, 3) are of unit length."""
    return bool(np.allclose((vectors * vectors).sum(axis=1), 1.0, atol=_ROUNDING))

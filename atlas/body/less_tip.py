"""The body less the tip: contacts of a ball whose centres were learned, and what they show.

The centres of a ball of radius r that touches a body lie on the body's offset by r. The contact is
the centre less r times the normal n there, so the normal may be off by an angle e at the price of
r e² / 2. A convex edge of radius r of the centres is a sharp edge of contacts, and a crease of the
centres is a concave corner that the ball cannot enter.
"""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.choose import KnownBody, body_of_faces, body_of_one
from touchatlas.atlas.body.read_faces import faces_of_labels, samples_of
from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import Labels
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.relabel.moves import refit
from touchatlas.atlas.samples.rims import Rims
from touchatlas.atlas.samples.sample_pool import SamplePool


def contacts(pool: SamplePool, body: Body) -> SamplePool:
    """The samples of a pool of centres, moved by the radius of the tip against the normals of their
    body."""
    found, normals = SamplePool(), body.field.at(pool.points).normal
    points = pool.points - pool.tip_radius * normals
    own = pool.across, pool.edges, pool.noise, pool.contours, True
    found.add(points, normals, *own)
    return found


def rims_less_tip(rims: Rims, pool: SamplePool, radius: float) -> Rims:
    """The rims of a surface of centres, moved by a radius (length) to contacts, those of a pool."""
    found = Rims(pool)
    for name in found.ends.NAMES:
        setattr(found.ends, name, getattr(rims.ends, name))
    found.ends.points = rims.ends.points - radius * rims.ends.normals
    return found


def less_tip(known: KnownBody, pool: SamplePool, radius: float, levels: Levels) -> KnownBody:
    """What the contacts of a pool show, by the labels of what their centres show. Concave edges are
    rounded by the ball of a radius, length, that did not enter them."""
    if known.body is None:
        return known
    samples = samples_of(pool, known.count, known.std, levels)
    found = replace(known, is_few=False)
    if not known.is_one_face and known.faces is not None:
        faces = _with_closed_corners(_read_again(samples, known.faces), radius)
        if (body := body_of_faces(faces, samples)) is not None:
            return replace(found, faces=faces, body=body)
    return replace(found, faces=None, body=body_of_one(samples))


def _read_again(samples: ContourSamples, faces: Faces) -> Faces:
    """The faces of contacts by the labels of those of their centres."""
    labels = Labels(Evidence(samples, SampleGraph(samples)))
    labels.resume(faces.pieces, faces.patch_of)
    refit(labels)
    # What lay on the rounding of an edge by the tip lies on both of its faces.
    labels.relax()
    labels.drop_empty()
    refit(labels)
    return faces_of_labels(labels)


def _with_closed_corners(faces: Faces, radius: float) -> Faces:
    """Faces whose sharp concave edges are rounded by the ball that did not enter them. The edge
    itself may have any radius from zero to that of the ball: a uniform law."""
    edges = tuple(
        replace(edge, radius=radius, radius_std=float(radius / np.sqrt(3.0)))
        if edge.kind is EdgeKind.SHARP_CONCAVE and edge.radius < radius
        else edge
        for edge in faces.edges
    )
    return replace(faces, edges=edges)

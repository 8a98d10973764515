"""Two levels without a riser: the deviation tells that the surface may go over anywhere."""

import igl
import numpy as np

from tests.lawful import known_body, lawful_object
from touchatlas.atlas.contouring.body_surface import body_surface, shape_edge
from touchatlas.atlas.mesh.levels import with_unknown_risers
from touchatlas.patch.geometry.normal_error import SURE


def drawn(name: str):
    body = known_body(name, 40)
    return body, body_surface(body, shape_edge(body))


def far_points(surface, height: float):
    """Distances (n,) of points of the low step about its riser from a surface where these are
    more than a fifth of the height, and the largest deviations (n,) of the triangles there."""
    points = lawful_object("low step").sample(40_000, np.random.default_rng(0))[0]
    points = points[(np.abs(points[:, 0] - 30.0) < 2.5) & (points[:, 1] > 19.0)]
    tree = igl.AABB()
    tree.init(surface.vertices, surface.faces)
    square, face, _ = tree.squared_distance(surface.vertices, surface.faces, points)
    far = np.sqrt(square) > 0.2 * height
    return np.sqrt(square[far]), surface.deviation[surface.faces[face[far]]].max(axis=1)


def test_the_deviation_tells_what_a_riser_that_is_no_face_may_hide():
    """The riser is 0.4 high. Where it was met by few contours the surface is off by up to all of
    it. Beyond the nearest triangles of both levels it tells nothing, so that not all is said."""
    height = 0.4
    body, surface = drawn("low step")
    off, before = far_points(surface, height)
    off, after = far_points(with_unknown_risers(body, surface), height)
    assert len(off) > 50
    assert (off > SURE * after).mean() < 0.5 * (off > SURE * before).mean()


def test_faces_that_meet_change_nothing():
    """Neither a box nor a cylinder has levels."""
    for name in ("box", "cylinder"):
        body, surface = drawn(name)
        told = with_unknown_risers(body, surface)
        assert (told.deviation == surface.deviation).all()

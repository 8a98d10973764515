"""What an atlas doubts: nothing where all is well, else the cause and its places."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
import trimesh

from tests.explored import learned_at_once, spread_touches
from tests.meshes import surface_of
from touchatlas.atlas import Atlas, doubts, extract_surface
from touchatlas.planner.stop import Forecast, Stop, StopReason
from touchatlas.sim import make_object
from touchatlas.sim.study.bodies import cup, slab
from touchatlas.sim.study.explorations import shifted
from touchatlas.sim.world.mesh_object import MeshObject

# Ten tolerances, fifty deviations of the noise.
SHIFT = np.array([0.6, -0.5, 0.6])


@lru_cache
def touches_of_ball(count: int = 16):
    return spread_touches(make_object("sphere"), count)


@lru_cache
def ball(moment: int | None = None) -> Atlas:
    """A ball that sixteen touches hold; from a moment on the object has moved."""
    touches = touches_of_ball()
    if moment is not None:
        touches = [shifted(t, SHIFT) if k >= moment else t for k, t in enumerate(touches)]
    return learned_at_once(touches, 0.1)


@lru_cache
def surface():
    return extract_surface(ball())


def names(found) -> list[str]:
    return [doubt.name for doubt in found]


def test_nothing_speaks_against_a_ball():
    assert doubts(ball(), surface()) == ()


def learned(body, count: int) -> Atlas:
    return learned_at_once(spread_touches(body, count, 0.01), 0.1)


@pytest.mark.parametrize(("count", "known"), [(5, False), (8, True)])
def test_lost_contact_is_doubted_with_the_places_where_the_rim_is_unsure(count, known):
    """Five touches meet the rim of half a ball at too few places, eight at enough."""
    atlas = learned(cup(0.5), count)
    found = {doubt.name: doubt for doubt in doubts(atlas, extract_surface(atlas))}["lost contact"]
    assert "lost contact" in found.words
    assert ("everywhere" not in found.words) == known == (len(found.places) == 0)


def test_a_rim_where_contact_was_lost_is_no_hole():
    """The boundary of a bowl that fourteen touches know is its rim; what is cut out is a hole."""
    atlas = learned(cup(0.5), 14)
    bowl = extract_surface(atlas)
    assert "holes" not in names(doubts(atlas, bowl))
    cut = bowl.only(np.linalg.norm(bowl.vertices - [0.0, 0.0, 33.0], axis=1) > 8.0)
    (found,) = (doubt for doubt in doubts(atlas, cut) if doubt.name == "holes")
    assert (found.places[:, 2] > 25.0).all()


def test_what_a_planner_left_is_said_with_its_places():
    places = [[0.0, 0.0, 33.0], [33.0, 0.0, 0.0]]
    found = doubts(ball(), surface(), places, "touches no longer improve what is known")
    assert names(found) == ["unfinished", "open places"]
    assert found[1].places.tolist() == places and "2 places are" in found[1].words


@pytest.mark.parametrize("reason", list(StopReason))
def test_a_planners_stop_is_a_doubt_unless_the_surface_is_known(reason):
    place = np.array([[0.0, 0.0, 33.0]])
    stop = Stop(reason, Forecast(0.75, place), place[:0])
    found = doubts(ball(), surface(), stopped=stop)
    if reason is StopReason.KNOWN:
        assert found == ()
        assert doubts(ball(), surface(), stopped=reason.value) == ()
        return
    assert names(found) == ["unfinished", "open places"]
    assert f"{reason.value}, with 75.0% of the surface about its touches known" in found[0].words
    assert found[1].places.tolist() == place.tolist()


def test_places_that_no_pin_reaches_are_taken_from_the_stop():
    place = np.array([[0.0, 0.0, 33.0]])
    stop = Stop(StopReason.KNOWN, Forecast(1.0, place[:0]), place)
    assert names(doubts(ball(), surface(), stopped=stop)) == ["unreachable"]
    assert doubts(ball(), surface(), stopped=None) == ()


def test_a_moved_object_is_told_with_its_move():
    """Places where contours before and after cross tell the move as well as their noise lets them:
    to a third of the noise of 0.02."""
    moved = [doubt for doubt in doubts(ball(8), surface()) if doubt.name == "moved"]
    assert len(moved) == 1 and len(moved[0].places)
    size = float(moved[0].words.split("moved by ")[1].split()[0])
    assert size == pytest.approx(np.linalg.norm(SHIFT), abs=0.02)
    assert "contradicting samples" not in names(doubts(ball(8), surface()))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_of_few_touches_no_move_is_told(count):
    atlas = learned_at_once(touches_of_ball()[:count], 0.1)
    assert "moved" not in names(doubts(atlas))


def test_a_bad_contact_is_told_with_its_place():
    """A contour of one touch lies ten tolerances inside the ball, as if the probe had bent."""
    touches = list(touches_of_ball(12))
    bad = touches[5].contours[0]
    inward = -touches[5].approach * np.ones((len(bad.points), 1))
    bent = replace(bad, points=bad.points + inward)
    touches[5] = replace(touches[5], contours=(bent, *touches[5].contours[1:]))
    found = {doubt.name: doubt for doubt in doubts(learned_at_once(touches, 0.1), surface())}
    assert "moved" not in found
    places = found["contradicting samples"].places
    away = np.linalg.norm(places[:, None] - bent.points, axis=2).min(axis=1)
    assert len(places) and away.min() < 2.0


def test_a_hole_is_told_with_its_place():
    top = surface().vertices[:, 2] > 30.0
    found = doubts(ball(), surface().only(~top))
    assert names(found) == ["holes"]
    assert found[0].places[:, 2] == pytest.approx(30.0, abs=1.0)


def test_approaches_that_point_inward_are_told():
    """They turn the ball inside out; the ways, which would tell each of them, are not known."""
    touches = [replace(t, approach=-t.approach, way=None) for t in touches_of_ball()]
    atlas = learned_at_once(touches, 0.1)
    found = doubts(atlas, extract_surface(atlas))
    assert names(found) == ["inside out"] and "approach of a touch must point" in found[0].words


def joined(*meshes):
    """A Surface of the triangles of meshes."""
    return surface_of(trimesh.util.concatenate(meshes))


@pytest.mark.parametrize(
    ("apart", "one", "other", "told"),
    [
        (20.0, False, True, True),
        (20.0, True, False, True),
        (20.0, True, True, True),
        (20.0, False, False, False),
        (0.0, False, True, False),
    ],
)
def test_each_piece_that_is_inside_out_is_told_but_no_cavity(apart, one, other, told):
    """A large ball and a small one, beside it or within, either inverted or not."""
    large, small = (trimesh.creation.icosphere(2, radius) for radius in (10.0, 5.0))
    small.apply_translation([apart, 0.0, 0.0])
    for mesh, inverted in ((large, one), (small, other)):
        if inverted:
            mesh.invert()
    assert ("inside out" in names(doubts(ball(), joined(large, small)))) == told


def test_what_is_no_atlas_and_no_surface_is_refused():
    for swapped in (None, surface()):
        with pytest.raises(ValueError, match=r"for the atlas; call doubts\(atlas, surface\)"):
            doubts(swapped, ball())
    with pytest.raises(ValueError, match="got int for the surface; give the Surface that"):
        doubts(ball(), 3)


def test_pieces_are_counted():
    height = surface().vertices[:, 2]
    found = doubts(ball(), surface().only(np.abs(height) > 5.0))
    assert names(found) == ["pieces", "holes"] and "2 pieces" in found[0].words


def test_no_surface_is_a_doubt():
    assert names(doubts(Atlas(0.1))) == ["no surface"]


def test_two_close_sheets_are_told():
    """A plate three tolerances thick, and one of ten."""
    found = []
    for thickness in (3.0, 10.0):
        # Contours of triangles are traced sooner than those of the field.
        plate = MeshObject("plate", *slab(thickness).mesh(0.1))
        atlas = learned_at_once(spread_touches(plate, 12, 0.02), 1.0)
        found.append("close sheets" in names(doubts(atlas, surface())))
    assert found == [True, False]


def test_doubts_are_ready_for_json():
    doubt, *_ = doubts(ball(8), surface())
    as_dict = doubt.as_dict()
    assert set(as_dict) == {"name", "words", "places"} and len(as_dict["places"]) <= 5

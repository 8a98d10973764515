"""All touches at once make the atlas that one after the other makes, byte for byte."""

import numpy as np
import pytest

from tests.explored import spread_touches
from tests.kept import kept_once
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas, Scan, Touch, TouchStatus, save_atlas
from touchatlas.sim import make_object
from touchatlas.sim.study.bodies import cup

TOLERANCE = 0.1


@kept_once
def spread(count: int) -> list[Touch]:
    return spread_touches(make_object("bottle"), count)


def without_contact(touch: Touch) -> Touch:
    return Touch(touch.number, touch.contact, touch.approach, (), TouchStatus.NO_CONTACT, 0.0, 0.0)


def with_lost_ends() -> list[Touch]:
    """The last four of 16 touches met nothing, so that earlier ones say what errors are."""
    touches = spread(16)
    return [*touches[:12], *map(without_contact, touches[12:])]


TOUCHES = {
    "none": list,
    "one": lambda: spread(16)[:1],
    "smooth": lambda: spread(16),
    "with lost ends": with_lost_ends,
    "some twice": lambda: [*spread(16)[:10], *spread(16)[6:10], *spread(16)[10:12]],
    "with edges": lambda: explored_sharp("block").touches[:12],
    "with rims": lambda: spread_touches(cup(0.5), 12, 0.02),
}


def saved(atlas: Atlas, path) -> bytes:
    save_atlas(path, atlas)
    return path.read_bytes()


# Twelve touches of a body with edges take ten seconds, and wait for nothing.
KINDS = [
    pytest.param(kind, marks=pytest.mark.slow) if kind == "with edges" else kind for kind in TOUCHES
]


@pytest.mark.parametrize("kind", KINDS)
def test_all_touches_at_once_make_the_atlas_of_one_after_the_other(kind, tmp_path):
    touches, one, both = TOUCHES[kind](), Atlas(TOLERANCE), Atlas(TOLERANCE)
    changes = [one.add(touch) for touch in touches]
    found = both.add_all(touches)
    assert [change.refused for change in found] == [change.refused for change in changes]
    assert saved(both, tmp_path / "all.npz") == saved(one, tmp_path / "one.npz")


def test_touches_go_on_from_what_is_known(tmp_path):
    """A scan, a few touches, and then the others at once."""
    touches, atlases = spread(16), (Atlas(TOLERANCE), Atlas(TOLERANCE))
    contours = [contour for touch in touches[:3] for contour in touch.contours]
    points = np.concatenate([contour.points for contour in contours])
    for atlas in atlases:
        atlas.add(Scan(points, 0.02, approach=[0.0, 0.0, 1.0], outside=points[0] * 1.5))
        for touch in touches[3:5]:
            atlas.add(touch)
    for touch in touches[5:]:
        atlases[0].add(touch)
    atlases[1].add_all(iter(touches[5:]))
    assert saved(atlases[0], tmp_path / "a.npz") == saved(atlases[1], tmp_path / "b.npz")


def test_what_comes_before_a_refusal_is_learned(tmp_path):
    touches, one, both = spread(16)[:12], Atlas(TOLERANCE), Atlas(TOLERANCE)
    for touch in touches[:6]:
        one.add(touch)
    with pytest.raises(ValueError, match="give a Touch"):
        both.add_all([*touches[:6], "no touch", *touches[6:]])
    for touch in touches[6:]:
        one.add(touch)
    both.add_all(touches[6:])
    assert saved(both, tmp_path / "a.npz") == saved(one, tmp_path / "b.npz")

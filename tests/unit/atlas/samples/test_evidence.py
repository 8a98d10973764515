"""What touches say of the probe: chi-square laws, its noise, planes and misses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from touchatlas.atlas.samples.corrected import without_bad
from touchatlas.atlas.samples.evidence import ProbeEvidence, TouchEvidence
from touchatlas.atlas.samples.plane_test import meeting_of, plane_test
from touchatlas.patch import Contour, ContourEnd, SamplingPlane

NOISE, RADIUS, SAMPLES = 0.02, 30.0, 41
ENDS = (ContourEnd.LENGTH_REACHED,) * 2


def touch_of_ball(rng, noise=NOISE, angles=(0.0, 1.05, 2.1)) -> tuple[Contour, ...]:
    """Three great circles through the north pole of a ball, up to 40 degrees from it."""
    s, out = np.linspace(-0.7, 0.7, SAMPLES), []
    for angle in angles:
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        points = RADIUS * (np.sin(s)[:, None] * along + np.cos(s)[:, None] * [0.0, 0.0, 1.0])
        points = points + noise * rng.normal(size=points.shape)
        plane = SamplingPlane([0.0, 0.0, RADIUS], np.cross(along, [0.0, 0.0, 1.0]))
        out.append(Contour(points, plane, NOISE, ENDS))
    return tuple(out)


def evidence_of(
    count: int, change=lambda contour, rng: contour, noise=NOISE, seed=0
) -> ProbeEvidence:
    rng, found = np.random.default_rng(seed), ProbeEvidence()
    for _ in range(count):
        contours = tuple(change(c, rng) for c in touch_of_ball(rng, noise))
        kept, bad = without_bad(contours)
        found = found.and_of(0, kept, np.array([0.0, 0.0, RADIUS]), len(bad))
    return found


def test_squares_of_a_sound_probe_follow_their_chi_square_laws():
    """Sums over 100 touches, within four of their standard deviations; that of short fits, whose
    windows overlap, within a tenth."""
    found = evidence_of(100)
    for name in ("across", "tilt", "miss"):
        square, freedom = found.sum(name), found.sum(f"{name}_freedom")
        assert square == pytest.approx(freedom, abs=4.0 * np.sqrt(2.0 * freedom)), name
    assert found.sum("within") == pytest.approx(found.sum("within_freedom"), rel=0.1)
    each = [touch.within for touch in found.touches]
    # The squares that short fits count as: the variance of their sum is twice their number.
    freedom = found.touches[0].within_freedom
    assert 0.5 * 2.0 * freedom < np.var(each) < 1.5 * 2.0 * freedom


def test_a_sound_probe_stays_as_it_is_bit_for_bit():
    """A false alarm of one kind in a thousand explorations: none in six of ten touches."""
    contact = np.array([0.0, 0.0, RADIUS])
    for seed in range(6):
        rng, found = np.random.default_rng(seed), ProbeEvidence()
        for _ in range(10):
            contours = touch_of_ball(rng)
            found = found.and_of(0, contours, contact, 0)
            same = found.corrected(contours, contact)
            assert all(a is b for a, b in zip(same, contours, strict=True)), seed


@pytest.mark.parametrize("factor", [1.5, 3.0])
def test_noise_larger_than_the_stated_is_found_by_the_first_touches(factor):
    """The posterior mean lies within 3 / sqrt(2 n) of the true factor."""
    found = evidence_of(4, noise=factor * NOISE)
    freedom = found.sum("within_freedom")
    assert found.noise_factor == pytest.approx(factor, rel=3.0 / np.sqrt(2.0 * freedom))
    [first, *_] = found.corrected(touch_of_ball(np.random.default_rng(1)), np.zeros(3))
    assert first.noise_std == pytest.approx(found.noise_factor * NOISE)


def test_noise_smaller_than_the_stated_is_not_believed():
    """A filter takes noise from neighbouring samples, and leaves the errors that they share."""
    assert evidence_of(10, noise=NOISE / 3.0).noise_factor == 1.0


def test_the_stated_noise_is_worth_as_many_samples_as_its_prior():
    """By hand: (p + S) / (p + n), for the lesser of the two kinds of squares."""
    touch = TouchEvidence(0, 100, 0, 900.0, 100.0, 1200.0, 100.0)
    assert ProbeEvidence((touch,), prior=50.0).noise_factor == pytest.approx(np.sqrt(950.0 / 150.0))


def test_fine_detail_and_turned_planes_are_no_noise():
    """Detail is within the planes alone, a turn across them alone."""

    def rough(contour, rng):
        across = np.cross(contour.plane.normal, [0.0, 0.0, 1.0])
        height = 5.0 * NOISE * rng.normal(size=(SAMPLES, 1))
        return replace(contour, points=contour.points + height * (across * 0.0 + [0, 0, 1.0]))

    assert evidence_of(5, rough).noise_factor == 1.0


def test_a_turned_plane_is_measured_and_replaced_by_that_of_the_samples():
    def turned(contour, rng):
        angle, normal = np.deg2rad(1.0), contour.plane.normal
        turn = np.cos(angle) * normal + np.sin(angle) * np.cross([0.0, 0.0, 1.0], normal)
        return replace(contour, plane=replace(contour.plane, normal=turn))

    found = evidence_of(2, turned)
    assert found.refutes("tilt") and found.noise_factor == 1.0
    assert np.rad2deg(found.touches[0].tilt_angle) == pytest.approx(1.0, abs=0.1)
    contours = tuple(turned(c, None) for c in touch_of_ball(np.random.default_rng(3)))
    for true, mended in zip(
        touch_of_ball(np.random.default_rng(3)), found.corrected(contours, np.zeros(3)), strict=True
    ):
        cosine = abs(true.plane.normal @ mended.plane.normal)
        # About the curve itself noise turns the plane by 0.02 / (2.1 sqrt(41)) = 0.085 degrees:
        # 2.1 is the spread of its heights.
        assert np.rad2deg(np.arccos(min(cosine, 1.0))) < 4.0 * 0.085


def test_a_contour_with_measured_normals_is_not_asked_for_its_plane():
    contour = touch_of_ball(np.random.default_rng(0))[0]
    normals = contour.points / np.linalg.norm(contour.points, axis=1)[:, None]
    assert plane_test(contour) is not None
    assert plane_test(replace(contour, normals=normals)) is None


def test_displaced_curves_are_found_and_moved_to_where_they_meet():
    """Each by ten deviations: what is left of their misses is of noise."""

    def displaced(contour, rng):
        step = rng.normal(size=3)
        return replace(contour, points=contour.points + 10.0 * NOISE * step / np.sqrt(step @ step))

    found = evidence_of(6, displaced)
    # One coordinate of a step of a random direction: its variance is a third.
    assert found.displacement == pytest.approx(10.0 * NOISE / np.sqrt(3.0), rel=0.6)
    rng, contact = np.random.default_rng(9), np.array([0.0, 0.0, RADIUS])
    contours = tuple(displaced(c, rng) for c in touch_of_ball(rng))
    before = meeting_of(contours, contact, 1e-3)
    moved = tuple(replace(c, noise_std=NOISE) for c in found.corrected(contours, contact))
    after = meeting_of(moved, contact, 1e-3)
    assert np.abs(before.misses).max() > 5.0 * NOISE > 10.0 * np.abs(after.misses).max()


def test_bad_contacts_are_left_out_and_are_no_noise():
    """One in fifty, off by 150 deviations: 19 of 20 are found, and no other sample."""
    rng, true, found, others = np.random.default_rng(2), 0, 0, 0
    for _ in range(40):
        contours, marks = [], []
        for contour in touch_of_ball(rng):
            off = rng.random(SAMPLES) < 0.02
            step = rng.normal(size=(SAMPLES, 3))
            step *= 150.0 * NOISE / np.linalg.norm(step, axis=1)[:, None]
            contours.append(replace(contour, points=contour.points + off[:, None] * step))
            marks.append(contours[-1].points[off])
        _, bad = without_bad(tuple(contours))
        marked = {tuple(point) for point in np.concatenate(marks)}
        true += len(marked)
        found += sum(tuple(point) in marked for point in bad)
        others += sum(tuple(point) not in marked for point in bad)
    assert found >= 0.95 * true > 50 and others == 0


def test_all_tests_of_an_exploration_share_one_chance():
    """1 / 2 + 1 / 6 + 1 / 12 + ... is 1."""
    touches = [ProbeEvidence((TouchEvidence(),) * count) for count in range(1, 200)]
    assert sum(one.chance for one in touches) == pytest.approx(1e-3, rel=0.01)


def test_evidence_is_the_same_after_its_row():
    touch = evidence_of(1).touches[0]
    assert np.array_equal(TouchEvidence(*touch.row.tolist()).row, touch.row)
    assert chi2.sf(touch.across, touch.across_freedom) > 1e-6

"""Studies of the patch over many draws, with their tables: run with ``-m slow -s``."""

from functools import cache

import numpy as np
import pytest

from touchatlas.patch import Contour, FitOptions, Patch, PatchFit, fit_patch
from touchatlas.patch.geometry.curvature import UMBILIC_FALSE_ALARM
from touchatlas.sim.study.fits import fit_jet, mesh_around, mesh_curvatures
from touchatlas.sim.study.scenes import Scene, draw_scene

pytestmark = pytest.mark.slow
NOISE = 0.02
SURFACES = ("ball", "ellipsoid", "torus", "bottle_neck", "mouse")
DEVIATIONS = 1.96


def fit_of(scene: Scene, contours=None) -> PatchFit:
    return fit_patch(scene.contact, contours or scene.contours, scene.normal)


def distance(patch: Patch, points) -> np.ndarray:
    """(n,) distance of points to a patch: three steps along the normals of where they arrive.

    One first-order distance would be too short where the patch curves.
    """
    foot = points
    for _ in range(3):
        foot = foot - patch.signed_distance(foot)[:, None] * patch.normal(foot)
    return np.linalg.norm(foot - points, axis=1)


# Bad contacts.


def spoilt(scene: Scene, count: int, deviations: float, rng) -> tuple[Contour, ...]:
    """The contours with some contacts moved along the normal, either way."""
    points = np.array([contour.points for contour in scene.contours])
    which = np.unravel_index(
        rng.choice(points[..., 0].size, count, replace=False), points.shape[:2]
    )
    away = deviations * scene.noise_std * rng.choice([-1.0, 1.0], count)
    points[which] += away[:, None] * scene.surface.normal(points[which])
    return tuple(
        Contour(p, c.plane, c.noise_std, c.ends)
        for p, c in zip(points, scene.contours, strict=True)
    )


BAD = {"none": (0, 0.0), "2 %": (1, 20.0), "5 %": (3, 20.0), "10 %": (6, 20.0), "one": (1, 50.0)}
LEVERAGE = "of several bad contacts on one curve the last may hide behind the others"


def bad(name: str):
    """A situation of ``BAD``; those with many bad contacts break the law now."""
    broken = pytest.mark.xfail(strict=True, reason=LEVERAGE)
    return pytest.param(name, marks=broken if name in ("5 %", "10 %") else ())


@pytest.mark.parametrize("name", [bad(name) for name in BAD])
def test_bad_contacts_are_left_out_and_cost_little(name):
    """Counted right in nine of ten draws; the median error grows by a fifth at most (a tenth of
    the samples are gone, and what else is known at their place), and that of no draw tenfold."""
    found = np.array([growth_by_bad_contacts(surface, name) for surface in SURFACES])
    median, worst, right = found.T
    assert right.min() >= 0.9 and median.max() <= 1.2 and worst.max() < 10.0


def growth_by_bad_contacts(surface: str, name: str) -> tuple[float, float, float]:
    """Factors by which median error and that of the worst draw grow; share counted right."""
    errors, right = [], []
    for draw in range(30):
        rng = np.random.default_rng([1, draw])
        scene = draw_scene(surface, NOISE, 0.0, rng)
        fits = fit_of(scene), fit_of(scene, spoilt(scene, *BAD[name], rng))
        errors.append([distance(f.patch, scene.verifying).mean() for f in fits])
        right.append(fits[1].outliers == BAD[name][0])
    clean, dirty = np.median(errors, axis=0) / NOISE
    worst, share = max(after / before for before, after in errors), float(np.mean(right))
    print(
        f"{surface:12} bad contacts: {name:5} error {clean:.2f} -> {dirty:.2f} deviations, "
        f"worst growth {worst:.1f}, counted right {share:.2f}"
    )
    return float(dirty / clean), worst, share


# Umbilics.


@cache
def gaps_on_balls(reach: float, noise: float, draws: int = 400) -> list[bool]:
    scenes = (
        draw_scene("ball", noise, 0.0, np.random.default_rng([2, draw]), reach=reach)
        for draw in range(draws)
    )
    return [not fit_of(scene).patch.curvatures.umbilic for scene in scenes]


def test_patches_of_balls_are_seldom_called_other_than_umbilic():
    """No oftener than stated; less often where the prior, not the noise, is most of the
    deviation, for a ball is smoother than it expects."""
    for reach in (10.0, 15.0, 20.0):
        for noise in (0.02, 0.1):
            alarms = gaps_on_balls(reach, noise)
            print(f"reach {reach:.0f}, noise {noise}: false alarms {np.mean(alarms):.4f}")
            rate, draws = UMBILIC_FALSE_ALARM, len(alarms)
            assert np.mean(alarms) < rate + 4.0 * np.sqrt(rate * (1.0 - rate) / draws)


# Intervals, and curvatures against peers.


CELLS = [(noise, tilt) for noise in (0.02, 0.05) for tilt in (0.0, 30.0)]


@cache
def cell_scenes(surface: str, noise: float, tilt: float, draws: int = 50) -> list[Scene]:
    return [
        draw_scene(surface, noise, np.deg2rad(tilt), np.random.default_rng([3, draw]))
        for draw in range(draws)
    ]


@cache
def cell_fits(surface: str, noise: float, tilt: float) -> list[PatchFit]:
    return [fit_of(scene) for scene in cell_scenes(surface, noise, tilt)]


def curvature_errors(fit: PatchFit, scene: Scene) -> np.ndarray:
    known = fit.patch.curvatures
    return np.array([known.k1 - scene.k1, known.k2 - scene.k2])


def shares_within(cell) -> np.ndarray:
    """(draws, 2) shares of verifying points, and of k1 and k2, within 1.96 deviations."""
    return np.array(
        [
            [
                np.mean(
                    np.abs(fit.patch.signed_distance(scene.verifying))
                    <= DEVIATIONS * fit.patch.deviation(scene.verifying)
                ),
                np.mean(
                    np.abs(curvature_errors(fit, scene)) <= DEVIATIONS * fit.patch.curvatures.std
                ),
            ]
            for fit, scene in zip(cell_fits(*cell), cell_scenes(*cell), strict=True)
        ]
    )


@pytest.mark.parametrize("surface", SURFACES)
def test_intervals_hold_as_often_as_they_say(surface):
    """92 % or more, and of curvatures no more than 98 %, within three standard errors of a mean of
    50 draws; points of one patch err together, so the error is that of the draws' shares. Heights
    between sections have the deviation of surfaces as rough as random ones, of which 92 to 98 %
    hold (``tests/laws/test_patch_closed_forms.py``); these are smoother."""
    held = []
    for noise, tilt in CELLS:
        shares = shares_within((surface, noise, tilt))
        mean, slack = shares.mean(axis=0), 3.0 * shares.std(axis=0) / np.sqrt(len(shares))
        print(
            f"{surface:12} noise {noise}, tilt {tilt:2.0f}: heights {mean[0]:.3f}, "
            f"curvatures {mean[1]:.3f}"
        )
        held.append((mean >= 0.92 - slack) & (mean <= np.array([1.0, 0.98]) + slack))
    assert np.all(held)


def peers_errors(scene: Scene, rng) -> np.ndarray:
    """(2, 2) errors of k1 and k2 by a jet of degree 4 on the same points, and by a mesh."""
    exact = np.array([scene.k1, scene.k2])
    samples = np.concatenate([contour.points for contour in scene.contours])
    jet = fit_jet(scene.contact, samples, scene.normal, FitOptions().degree)
    mesh = mesh_curvatures(*mesh_around(scene, rng))[0]
    return np.array([[jet.k1, jet.k2], mesh]) - exact


@pytest.mark.parametrize("surface", SURFACES)
def test_curvatures_are_better_than_those_of_peers(surface):
    """Medians over 50 draws, relative as in ``touchatlas chart``: to the largest curvature."""
    for noise, tilt in CELLS:
        cell, rows = (surface, noise, tilt), []
        for draw, (fit, scene) in enumerate(zip(cell_fits(*cell), cell_scenes(*cell), strict=True)):
            peers = peers_errors(scene, np.random.default_rng([4, draw]))
            errors = np.concatenate([curvature_errors(fit, scene)[None], peers])
            size = max(abs(scene.k1), abs(scene.k2), 1.0 / scene.reach)
            rows.append(np.sqrt((errors**2).mean(axis=1)) / size)
        ours, jet, mesh = np.median(rows, axis=0)
        print(
            f"{surface:12} noise {noise}, tilt {tilt:2.0f}: ours {ours:.4f}, jet {jet:.4f}, "
            f"libigl {mesh:.4f}"
        )
        assert ours <= jet and ours <= mesh


# The torus, where three sections say least.


def test_three_curves_on_a_torus_err_within_three_deviations():
    """In each of 30 draws, root mean square over the verifying points."""
    ratios = []
    for draw in range(30):
        scene = draw_scene("torus", NOISE, 0.0, np.random.default_rng([5, draw]))
        patch = fit_of(scene).patch
        ratio = patch.signed_distance(scene.verifying) / patch.deviation(scene.verifying)
        ratios.append(np.sqrt(np.mean(ratio**2)))
    print(f"torus: error in deviations, median {np.median(ratios):.2f}, max {np.max(ratios):.2f}")
    assert np.max(ratios) < 3.0

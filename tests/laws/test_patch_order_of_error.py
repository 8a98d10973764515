"""The error of a patch falls with its radius by the order that its sections do not determine."""

import numpy as np
import pytest

from tests.laws.patch_scenes import MONGE, WavyGraph, contours_of
from tests.truths import UP
from touchatlas.patch import FitOptions, PatchFit, fit_patch


def rms_error(fit: PatchFit, height, reach) -> float:
    """Over the disc of 0.7 reach."""
    i = np.arange(300) + 0.5
    r, a = 0.7 * reach * np.sqrt(i / 300), i * np.pi * (3.0 - np.sqrt(5.0))
    x, y = r * np.cos(a), r * np.sin(a)
    distance = fit.patch.signed_distance(np.column_stack([x, y, height(x, y)]))
    return float(np.sqrt(np.mean(distance**2)))


@pytest.fixture(scope="module")
def errors_by_reach():
    """errors[sections][options]: (reaches, graphs) errors of noise-free patches."""
    reaches = {3: (2.0, 1.0), 4: (0.5, 0.25), 5: (4.0, 2.0)}
    graphs = [WavyGraph(seed) for seed in range(8)]
    return {
        sections: {
            options: np.array(
                [
                    [
                        rms_error(
                            fit_patch(
                                np.zeros(3), contours_of(g, reach, sections), UP, options=options
                            ),
                            g,
                            reach,
                        )
                        for g in graphs
                    ]
                    for reach in reaches[sections]
                ]
            )
            for options in (MONGE, FitOptions())
        }
        for sections in reaches
    }


@pytest.mark.parametrize("options", [MONGE, FitOptions()], ids=["monge", "default"])
@pytest.mark.parametrize("sections", [3, 4, 5])
def test_halving_the_radius_divides_the_error_by_the_order_that_is_not_seen(
    sections, options, errors_by_reach
):
    """m sections determine all of degree m - 1, and leave out R^m: for three a cubic, for four a
    quartic. For five the quartic is complete and leaves out R^5. Geometric means over graphs.

    Radii are such that the next order is small (which for four sections has the larger factor),
    and rounding, 1e-6 of the radius times what the prior holds, is smaller yet.
    """
    far, near = np.log2(errors_by_reach[sections][options]).mean(axis=1)
    assert far - near == pytest.approx(sections, abs=0.2)


@pytest.mark.parametrize("sections", [3, 4, 5])
def test_default_errs_no_more_than_the_monge_quartic_at_any_radius(sections, errors_by_reach):
    """Both leave the same terms undetermined: 5 % for how the priors distribute them."""
    errors = errors_by_reach[sections]
    ratio = np.log(errors[FitOptions()] / errors[MONGE]).mean(axis=1)
    assert (ratio < np.log(1.05)).all()

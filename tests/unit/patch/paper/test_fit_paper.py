"""Constants of fit_paper."""

import pytest

from touchatlas.patch.paper.fit_paper import MULTIPLIER_FRACTION


def test_default_multiplier_is_the_papers_at_a_radius_of_20():
    assert pytest.approx(0.3) == MULTIPLIER_FRACTION * 20.0**2

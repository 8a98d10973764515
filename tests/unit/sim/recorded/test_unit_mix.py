"""One curve in another unit than the others: warned of, and held by the deviations."""

import numpy as np
import pytest

from tests.truths import graph_contours, quadric_height
from touchatlas.sim.recorded.curves import Curve
from touchatlas.sim.recorded.fit_file import fit_file
from touchatlas.sim.recorded.scans import SideOptions, read_scans
from touchatlas.sim.recorded.unit_mix import other_unit, rescaled

K1, K2 = -0.017, -0.042
UNITS = [0.001, 0.1, 10.0, 25.4, 1000.0]


def curves(seed=0, lengths=(12.0, 12.0, 12.0), noise=0.02, counts=(41, 41, 41)):
    rng = np.random.default_rng(seed)
    angles = np.deg2rad([0.0, 60.0, 120.0])
    return [
        Curve(name, contour.points, None)
        for name, angle, half, count in zip("abc", angles, lengths, counts, strict=True)
        for contour in graph_contours(
            quadric_height(K1, K2, 0.4), half, count, noise, rng, angles=[angle]
        )
    ]


def write(path, listed):
    rows = [",".join(map(str, [c.name, *p])) for c in listed for p in c.points.tolist()]
    path.write_text("\n".join(["curve,x,y,z", *rows]) + "\n")
    return path


@pytest.mark.parametrize("factor", UNITS)
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_the_curve_and_the_factor_are_found(factor, noise):
    for seed in range(3):
        listed = curves(seed, lengths=(12.0, 10.5, 11.0), noise=noise)
        listed[seed] = Curve(listed[seed].name, factor * listed[seed].points, None)
        found = other_unit(listed)
        assert found.place == seed and repr(listed[seed].name) in found.name
        assert found.factor == pytest.approx(1.0 / factor)
        restored = rescaled(listed, found)[seed].points
        assert np.abs(restored - listed[seed].points / factor).max() < 1e-12 * 1000.0


@pytest.mark.parametrize("factor", UNITS)
def test_deviations_hold_the_truth_where_the_unit_is_mixed_at_the_origin(tmp_path, factor):
    for seed in range(4):
        listed = curves(seed)
        listed[1] = Curve("b", factor * listed[1].points, None)
        path = write(tmp_path / "mixed.csv", listed)
        try:
            report = fit_file(path, outward=np.array([0.0, 0.0, 1.0]))
        except ValueError as error:
            assert "curve 'b' may be in another unit" in str(error)
            continue
        large = max(factor, 1.0 / factor)
        assert "curve 'b' may be in another unit" in report.warnings[0]
        assert f" {large:g} " in report.warnings[0] or f"/{large:g} " in report.warnings[0]
        c = report.patch.curvatures
        assert (np.abs(np.array([c.k1, c.k2]) - [K1, K2]) < 2.0 * c.std).all()


def test_curves_of_unlike_length_and_spacing_by_one_probe_are_no_other_unit(tmp_path):
    """One curve is 2.5 times or ten times as long, as sparse, and as noisy as the others."""
    for long, short in ((12.0, 4.8), (12.0, 1.2)):
        listed = curves(lengths=(short, long, short))
        assert other_unit(listed) is None
    report = fit_file(write(tmp_path / "unlike.csv", curves(lengths=(4.8, 12.0, 4.8))))
    assert not report.warnings


def test_a_file_in_another_unit_is_said(tmp_path):
    """Of two files of one surface, the second in inches, unless it says so itself."""
    one, other = write(tmp_path / "one.csv", curves()), tmp_path / "other.csv"
    inches = [Curve(c.name, c.points / 25.4, None) for c in curves(1)]
    side = SideOptions(approach=np.array([0.0, 0.0, 1.0]))
    found = read_scans([one, write(other, inches)], sides=side)
    assert any("in another unit" in words and "25.4" in words for words in found.said)
    assert not any("another unit" in w for w in read_scans([one, one], sides=side).said)
    other.write_text("# unit: inch\n" + other.read_text())
    assert not any("another unit" in w for w in read_scans([one, other], sides=side).said)

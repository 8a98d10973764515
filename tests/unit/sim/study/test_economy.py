"""The study of touches against error: the oracle, the sweep, its sums and pictures, the command."""

import csv

import numpy as np
import pytest

from tests.command import touchatlas
from touchatlas.atlas import Atlas
from touchatlas.planner import StopReason, explore
from touchatlas.planner.options import NAMES
from touchatlas.sim import Probe, make_object
from touchatlas.sim.folder.run_options import fit_scale
from touchatlas.sim.study.compare import gap_closed
from touchatlas.sim.study.economy import COLUMNS, ECONOMY, cells_of
from touchatlas.sim.study.economy_costs import COSTS, OTHERS, summary
from touchatlas.sim.study.economy_pictures import styles
from touchatlas.sim.study.figures import image_bytes
from touchatlas.sim.study.oracle import Oracle, errors, worst
from touchatlas.sim.study.study import run
from touchatlas.sim.study.surface_judge import OPTIONS, EconomyOptions, judged

pytestmark = pytest.mark.usefixtures("no_processes")
METHODS = ("tolerance", "oracle")


@pytest.fixture(scope="module")
def swept(tmp_path_factory, no_processes):
    """Folder and rows of the sphere to 1 % of its diagonal."""
    folder = tmp_path_factory.mktemp("chart")
    return folder, swept_again(folder)


def swept_again(folder, watch=lambda done, total: None):
    options = EconomyOptions(tolerances=(1e-2,))
    return run(ECONOMY.study, cells_of(("sphere",), 1, 0, METHODS, options), folder, watch)


def row(method, seed, length, met="yes"):
    cells = dict.fromkeys(COLUMNS, "1") | {"method": method, "seed": seed, "met": met}
    return cells | {"tracked": str(0.5 * length), "travel": str(0.5 * length)}


def test_the_oracle_touches_the_true_point_of_largest_error():
    obj = make_object("sphere")
    points, normals = obj.sample(300, np.random.default_rng(1))
    atlas = Atlas(2e-3 * obj.diagonal, scale=fit_scale(obj.noise_std, obj.diagonal))
    planner = Oracle(*obj.start(), points, normals)
    probe, touched = Probe(obj, obj.noise_std, np.random.default_rng(2)), []
    for _ in range(OPTIONS.most):
        before = errors(atlas, points)
        plan = planner.ask(atlas)
        if plan is None or np.mean(before <= atlas.tolerance) >= planner.options.coverage:
            break
        if touched:
            place = int(((points - plan.reference_point) ** 2).sum(axis=1).argmin())
            assert np.array_equal(points[place], plan.reference_point)
            assert before[place] == before.max()
            unknown = points[np.isinf(before)]
            if len(unknown):
                away = np.linalg.norm(unknown[:, None] - np.array(touched), axis=2).min(axis=1)
                own = np.linalg.norm(points[place] - np.array(touched), axis=1).min()
                assert own == pytest.approx(away.max())
        touch = probe(plan)
        planner.tell(touch, atlas.add(touch))
        touched.append(touch.contact)
    assert len(touched) < OPTIONS.most
    assert np.mean(errors(atlas, points) <= atlas.tolerance) >= planner.options.coverage


def test_nothing_is_worst_where_all_errors_are_zero():
    assert worst(np.zeros(3), np.eye(3), np.zeros((1, 3))) is None


def test_the_oracle_makes_the_same_touches_as_a_planner():
    obj = make_object("sphere")
    atlas = Atlas(1e-2 * obj.diagonal, scale=fit_scale(obj.noise_std, obj.diagonal))
    oracle = Oracle(*obj.start(), *obj.sample(300, np.random.default_rng(1)))
    probe = Probe(obj, obj.noise_std, np.random.default_rng(2))
    steps = list(explore(atlas, oracle, probe, 3))
    reach, step = oracle.options.reach, oracle.options.step
    for plan in (one.plan for one in steps[1:]):
        assert len(plan.planes) == oracle.options.curves
        assert plan.step / plan.reach == pytest.approx(step / reach)


def test_our_planner_meets_the_tolerance_on_a_sphere(swept):
    folder, rows = swept
    with open(folder / "atlas.csv") as file:
        written = list(csv.DictReader(file))
    assert written == rows and tuple(written[0]) == COLUMNS
    ours, oracle = (next(r for r in rows if r["method"] == name) for name in METHODS)
    assert {r["method"] for r in rows} <= {*METHODS, *OTHERS}
    for one in (ours, oracle):
        assert one["met"] == "yes" and one["ended"] == StopReason.KNOWN.value
        assert 0.0 < float(one["mean_error"]) < float(one["p95_error"]) <= 1e-2
        assert float(one["known_share"]) >= 0.99 and float(one["seconds"]) > 0.0
        whole = float(one["tracked"]) + float(one["travel"])
        assert float(one["length_to_99"]) <= whole * (1.0 + 1e-4)  # five digits are written
        assert int(float(one["touches_to_99"])) <= int(one["touches"])


def test_tolerances_below_two_noises_are_left_out():
    # The blob's noise is 1.7e-4 of its diagonal, the ellipsoid's 1.0e-4.
    found = {cell.given[:2] for cell in cells_of(("blob", "ellipsoid"), 1, 0)}
    assert ("ellipsoid", 3e-4) in found and ("blob", 3e-4) not in found
    assert len(found) == 2 * len(OPTIONS.tolerances) - 1


def test_a_surface_that_is_no_surface_is_not_met():
    assert judged(None, make_object("sphere"), np.zeros((1, 3)), 1.0)["met"] == 0.0


def test_ratios_are_of_runs_that_both_met():
    rows = [row("tolerance", "0", 4), row("random", "0", 8), row("oracle", "0", 2)]
    rows += [row("tolerance", "1", 4), row("random", "1", 400, "no"), row("oracle", "1", 1)]
    found = {one["method"]: one for one in summary(rows)}
    assert found["random"]["met"] == 1 and found["random"]["runs"] == 2
    assert found["random"]["length"] == 0.5 and found["oracle"]["length"] == 3.0
    # Ours takes 4 where random takes 8 and the oracle 2.
    same = ("object", "tolerance", "seed")
    closed = gap_closed(rows, same, "method", "tolerance", COSTS["length"])
    assert closed == pytest.approx([4.0 / 6.0])


def test_every_method_has_its_own_colour_and_marker():
    found = styles([{"method": name} for name in (*NAMES, *OTHERS, "oracle", "gpis", "another")])
    assert [*found][0] == "tolerance" and len(found) == len(NAMES) + len(OTHERS) + 3
    for values in zip(*found.values(), strict=True):
        assert len(set(values)) == len(found)


@pytest.mark.slow
def test_a_picture_of_each_object_and_one_of_all_is_drawn(swept):
    drawn = ECONOMY.pictures(swept[1], [])
    assert [*drawn] == ["sphere", "atlas"]
    assert all(image_bytes(figure).startswith(b"\x89PNG") for figure in drawn.values())


def test_the_command_says_what_is_no_object_and_what_does_not_go_together(tmp_path):
    where = ["--out", str(tmp_path / "chart")]
    wrong = touchatlas("chart", "--atlas", "spher", *where, cwd=tmp_path)
    assert wrong.returncode == 2 and "did you mean sphere?" in wrong.stderr
    both = touchatlas("chart", "--atlas", "--stability", *where, cwd=tmp_path)
    assert both.returncode == 2 and "give one of them" in both.stderr

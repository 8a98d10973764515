"""touchatlas fit: known surfaces in known frames, the contract of --json, files, refusals."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.command import assert_refused, ran, touchatlas
from tests.truths import BALL_RADIUS, ball_height, graph_contours, moved, quadric_height
from touchatlas.patch.geometry.arrays import cross
from touchatlas.sim.recorded.fit_file import METHODS, fit_file, parse_vector
from touchatlas.sim.recorded.fit_flags import MEANING
from touchatlas.sim.recorded.fit_meanings import DIAGNOSIS_NUMBERS, FIT_NUMBERS
from touchatlas.sim.recorded.fit_report import FILES
from touchatlas.sim.study.cases import random_rotation

K1, K2, ANGLE = -0.017, -0.042, 0.4
ROTATION = random_rotation(np.random.default_rng(5))
SHIFT = np.array([5.0, 80.0, -3.0])


def write_csv(path, contours, planes=False, contacts=()):
    lines = ["curve,x,y,z" + ",nx,ny,nz" * planes]
    for name, contour in zip("abcdefgh", contours, strict=False):
        plane = contour.plane.normal.tolist() * planes
        lines += [",".join(map(str, [name, *p, *plane])) for p in contour.points.tolist()]
    lines += [",".join(map(str, ["", *p])) + ",,," * planes for p in contacts]
    path.write_text("\n".join(lines) + "\n")
    return path


def quadric_contours(noise=0.0, seed=0, scale=1.0):
    rng = np.random.default_rng(seed)
    contours = graph_contours(quadric_height(K1, K2, ANGLE), 12.0, 25, noise, rng)
    return moved(contours, ROTATION, SHIFT, scale)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fits")
    write_csv(folder / "exact.csv", quadric_contours(), planes=True)
    write_csv(folder / "noisy.csv", quadric_contours(0.02))
    write_csv(folder / "large.csv", quadric_contours(0.02, scale=1000.0))
    ball = graph_contours(ball_height, 12.0, 25, 0.02, np.random.default_rng(1))
    write_csv(folder / "ball.csv", moved(ball, ROTATION, SHIFT))
    write_csv(folder / "two.csv", ball[:2])
    write_csv(folder / "raster.csv", [moved([ball[0]], np.eye(3), 0.01 * k)[0] for k in range(3)])
    (folder / "nan.csv").write_text("curve,x,y,z\na,0,0,nan\n")
    return folder


@pytest.mark.parametrize("method", METHODS)
def test_exact_quadric_gives_its_curvatures_and_frame(folder, method):
    """The paper's (5) flattens between the curves, but takes k1, k2 and the frame from them."""
    found = fit_file(folder / "exact.csv", method, 0.0).as_dict()
    assert found["k1"] == pytest.approx(K1, abs=1e-8)
    assert found["k2"] == pytest.approx(K2, abs=1e-8)
    assert found["frame"]["origin"] == pytest.approx(SHIFT, abs=1e-6)
    axes = np.array(found["frame"]["axes"])
    assert axes[2] == pytest.approx(ROTATION[:, 2], abs=1e-6)
    e1 = ROTATION @ [np.cos(ANGLE), np.sin(ANGLE), 0.0]
    assert abs(axes[0] @ e1) == pytest.approx(1.0, abs=1e-6)
    assert axes[0] == pytest.approx(cross(axes[1], axes[2]), abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_noisy_quadric_is_within_its_deviations(folder, method):
    found = fit_file(folder / "noisy.csv", method).as_dict()
    for name, true in (("k1", K1), ("k2", K2)):
        assert abs(found[name] - true) < 4.0 * found[name + "_std"]
    tilt = np.arccos(np.array(found["frame"]["axes"][2]) @ ROTATION[:, 2])
    # The origin wanders along the surface by about the noise, and the normal turns with it.
    assert tilt < 4.0 * found["normal_std"] + 0.05 * abs(K2)
    assert found["noise_std"] == pytest.approx(0.02, rel=0.3)
    assert found["flags"][:2] == ["noise estimated", "outward side assumed"]


def test_summary_tells_how_many_points_lie_within_the_radius(tmp_path):
    """The nearest end of a curve bounds the patch, however far the others go."""
    contours = graph_contours(ball_height, 12.0, 25, 0.02, np.random.default_rng(1))
    short = replace(contours[2], points=contours[2].points[5:])
    path = write_csv(tmp_path / "short.csv", [*contours[:2], short])
    used, everything = fit_file(path).summary()["points used"].split(" of ")
    assert everything == "70" and 45 < int(used) < 65


@pytest.mark.parametrize("first", [9, 11, 12])
def test_one_short_arm_does_not_make_the_patch_small(tmp_path, first):
    """What the five other arms tell is kept: curvatures as sure as with four of them."""
    contours = graph_contours(ball_height, 12.0, 25, 0.02, np.random.default_rng(1))
    short = replace(contours[2], points=contours[2].points[first:])
    report = fit_file(write_csv(tmp_path / "arm.csv", [*contours[:2], short]))
    assert report.patch.radius > 11.0 and "one-sided curves" in report.flags
    whole = fit_file(write_csv(tmp_path / "whole.csv", contours))
    assert (report.patch.curvatures.std < 4.0 * whole.patch.curvatures.std).all()
    error = np.array([report.patch.curvatures.k1, report.patch.curvatures.k2]) + 1.0 / BALL_RADIUS
    # Six deviations: the umbilic bias is two of them.
    assert (np.abs(error) < 6.0 * report.patch.curvatures.std).all()


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.02])
@pytest.mark.parametrize("count", [49, 401])
def test_a_curve_that_runs_over_an_edge_is_used_on_this_side_only(tmp_path, count, noise):
    """A ball that breaks by 27 degrees at x = 6: curvatures are those of the ball."""

    def height(x, y):
        return ball_height(x, y) - 0.5 * np.maximum(0.0, x - 6.0)

    contours = graph_contours(height, 12.0, count, noise, np.random.default_rng(2))
    report = fit_file(write_csv(tmp_path / "edge.csv", contours))
    assert {"edge crossed"} <= set(report.flags)
    assert "residuals exceed noise" not in report.flags
    curvatures = report.patch.curvatures
    error = np.array([curvatures.k1, curvatures.k2]) + 1.0 / BALL_RADIUS
    # Six deviations, as above; without noise, what degree 6 leaves of a ball.
    assert (np.abs(error) < 6.0 * curvatures.std + 1e-5).all()


def test_noise_in_another_unit_is_doubted(folder):
    assert "noise exceeds residuals" in fit_file(folder / "noisy.csv", noise=20.0).flags
    assert "residuals exceed noise" in fit_file(folder / "noisy.csv", noise=2e-5).flags
    assert not {"noise exceeds residuals", "residuals exceed noise"} & set(
        fit_file(folder / "noisy.csv", noise=0.02).flags
    )


@pytest.mark.parametrize("count", [3, 4, 5])
@pytest.mark.parametrize("noise", [None, 0.02])
def test_a_displaced_curve_is_named_and_not_blamed_on_the_noise(tmp_path, count, noise):
    """Curve b lies twenty noises above the others. Without it the curvatures are right to six
    deviations, as above."""
    angles = np.deg2rad([0, 60, 120, 30, 90][:count])
    rng = np.random.default_rng(count)
    curves = graph_contours(quadric_height(K1, K2, ANGLE), 12.0, 25, 0.02, rng, angles=angles)
    curves = [
        replace(c, points=c.points + [0.0, 0.0, 0.4 * (i == 1)]) for i, c in enumerate(curves)
    ]
    path = write_csv(tmp_path / "displaced.csv", curves)
    report = fit_file(path, noise=noise)
    found = report.as_dict()
    assert "curves do not meet" in found["flags"]
    assert not {"noise exceeds residuals", "residuals exceed noise"} & set(found["flags"])
    # 25 points determine an estimated noise to 10 % or so.
    assert found["point_noise_std"] == pytest.approx(0.02, rel=1e-9 if noise else 0.4)
    diagnosis = found["diagnosis"]
    assert "contradiction" in diagnosis["doubts"]
    assert "noise overstated" not in diagnosis["doubts"]
    assert diagnosis["displaced"] == ["b"] and "Curve b is displaced" in diagnosis["advice"][0]
    given = "0.02 of each point, stated" if noise else "of each point, estimated"
    assert given in report.summary()["noise"] and "displacement" in report.summary()["noise"]
    if count > 3:
        good = write_csv(tmp_path / "good.csv", [curves[0], *curves[2:]])
        rest = fit_file(good, noise=noise)
        known = rest.patch.curvatures
        errors = np.array([known.k1, known.k2]) - [K1, K2]
        assert (np.abs(errors) < 6.0 * known.std).all()
        assert not rest.advice and "curves do not meet" not in rest.flags


def test_the_advice_of_doubts_is_printed_without_json(tmp_path):
    rng = np.random.default_rng(0)
    curves = graph_contours(quadric_height(K1, K2, ANGLE), 12.0, 25, 0.02, rng)
    write_csv(tmp_path / "good.csv", curves)
    beside = replace(curves[0], points=curves[0].points + [0.0, 0.0, 0.4])
    write_csv(tmp_path / "beside.csv", [beside, *curves[1:]])
    good, bad = (
        touchatlas("fit", name, "--noise", 0.02, cwd=tmp_path).stdout
        for name in ("good.csv", "beside.csv")
    )
    assert "advice:" not in good
    assert "advice: Curve a is displaced from the others" in bad


def test_many_contacts_do_not_doubt_the_noise_of_few_curves(tmp_path):
    rng = np.random.default_rng(0)
    plane = rng.uniform(-8.0, 8.0, (3000, 2))
    height = quadric_height(K1, K2, ANGLE)(*plane.T)
    contacts = np.column_stack([plane, height]) + 0.02 * rng.normal(size=(3000, 3))
    for seed in range(4):
        curves = graph_contours(
            quadric_height(K1, K2, ANGLE), 12.0, 25, 0.02, np.random.default_rng(seed)
        )
        path = write_csv(tmp_path / f"{seed}.csv", curves, contacts=contacts)
        report = fit_file(path)
        assert "residuals exceed noise" not in report.flags


def test_unscaled_terms_are_the_quadric_they_were_made_from(folder):
    found = fit_file(folder / "exact.csv", "monge", 0.0).as_dict()
    terms = dict(zip(map(tuple, found["terms"]), found["coefficients"], strict=True))
    assert terms.pop((2, 0, 0)) == pytest.approx(0.5 * K1, abs=1e-8)
    assert terms.pop((0, 2, 0)) == pytest.approx(0.5 * K2, abs=1e-8)
    assert max(map(abs, terms.values())) < 1e-6
    assert all(k == 0 and i + j <= 4 for i, j, k in found["terms"])


def test_outward_turns_the_patch_over(folder):
    up = fit_file(folder / "exact.csv", noise=0.0, outward=ROTATION[:, 2])
    down = fit_file(folder / "exact.csv", noise=0.0, outward=-ROTATION[:, 2])
    assert up.flags == down.flags == ()
    assert down.patch.curvatures.k1 == pytest.approx(-up.patch.curvatures.k2, abs=1e-8)
    assert down.patch.frame.normal == pytest.approx(-up.patch.frame.normal, abs=1e-6)


def test_near_sections_are_flagged_as_poorly_conditioned(tmp_path):
    angles = np.deg2rad([0.0, 12.0, 24.0])
    contours = graph_contours(ball_height, 12.0, 41, 0.02, np.random.default_rng(3), angles)
    report = fit_file(write_csv(tmp_path / "n.csv", contours), noise=0.02)
    assert report.patch.condition > 10.0 and "poorly conditioned sections" in report.flags


def test_json_is_strict_and_as_the_contract_says(folder):
    done = touchatlas("fit", "noisy.csv", "--json", cwd=folder)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    found = json.loads(done.stdout, parse_constant=pytest.fail)
    assert list(found) == list(FIT_NUMBERS) and found["method"] == "map"
    assert set(found["diagnosis"]) == set(DIAGNOSIS_NUMBERS)
    size = len(found["terms"])
    assert len(found["coefficients"]) == len(found["coefficients_std"]) == size
    assert set(found["flags"]) <= set(MEANING)


def test_table_and_a_sentence_for_each_flag(folder):
    done = touchatlas("fit", "ball.csv", "--point", "5,80,-3", "--noise", "0.02", cwd=folder)
    assert done.returncode == 0 and "k1" in done.stdout
    words = " ".join(done.stdout.split())
    assert MEANING["umbilic"] in words and MEANING["outward side assumed"] in words


def test_out_holds_numbers_surface_and_picture(folder, tmp_path):
    out = tmp_path / "new" / "o"
    outward = "--outward=" + ",".join(map(str, ROTATION[:, 2]))
    ran("fit", "exact.csv", "--noise", 0, outward, "--out", out, cwd=folder)
    assert sorted(path.name for path in out.iterdir()) == sorted(FILES)
    numbers = json.loads((out / "patch.json").read_text())
    mesh = trimesh.load(out / "patch.ply", process=False)
    local = (mesh.vertices - SHIFT) @ ROTATION
    assert local[:, 2] == pytest.approx(
        quadric_height(K1, K2, ANGLE)(*local[:, :2].T), abs=1e-5 * numbers["radius"]
    )
    away = np.linalg.norm(local, axis=1)
    assert 0.9 * numbers["radius"] < away.max() <= numbers["radius"] * (1 + 1e-9)
    assert (mesh.face_normals @ ROTATION[:, 2] > 0.5).all()
    assert (out / "patch.png").read_bytes().startswith(b"\x89PNG")
    again = touchatlas("fit", "exact.csv", "--out", out, cwd=folder)
    assert_refused(again, 2, "already holds patch.json, patch.ply, patch.png")
    forced = touchatlas("fit", "ball.csv", "--out", out, "--force", "--json", cwd=folder)
    assert forced.returncode == 0
    assert (out / "patch.json").read_text() == forced.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.csv"], "missing.csv is no file"),
        (["nan.csv"], "nan.csv was read so: cells"),
        (["two.csv"], "only 2 curves"),
        (["raster.csv"], "nearly one direction"),
        (["ball.csv", "--method", "mong"], "did you mean monge?"),
        (["ball.csv", "--method", "x"], "choose from map, monge"),
        (["ball.csv", "--noise", "-1"], "noise is -1.0"),
        (["ball.csv", "--point", "-1,2"], "give three numbers"),
        (["ball.csv", "--point", "-1,2,3"], "away from all curves"),
        (["ball.csv", "--outward", "0,0,0"], "tells no side"),
        (["ball.csv", "--out", "nan.csv"], "is a file"),
        (["ball.csv", "--out", "/proc/none"], "be made at /proc/none; choose another --out"),
    ],
)
def test_the_users_mistakes_are_one_sentence_and_exit_two(folder, arguments, words):
    assert_refused(touchatlas("fit", *arguments, cwd=folder), 2, words)


def test_outward_along_the_surface_is_refused(folder):
    with pytest.raises(ValueError, match="tells no side"):
        fit_file(folder / "exact.csv", outward=ROTATION[:, 0])


def test_a_point_where_a_curve_ends_is_fitted_from_the_other_arms(tmp_path):
    contours = graph_contours(ball_height, 12.0, 9, 0.02, np.random.default_rng(4))
    path = write_csv(tmp_path / "e.csv", contours)
    report = fit_file(path, point=contours[0].points[-1])
    assert {"one-sided curves", "curves do not meet"} <= set(report.flags)
    for value, std in zip(
        (report.patch.curvatures.k1, report.patch.curvatures.k2),
        report.patch.curvatures.std,
        strict=True,
    ):
        assert abs(value + 1.0 / BALL_RADIUS) < 6.0 * std


def test_a_curve_that_turns_beside_the_point_leaves_too_few_points(tmp_path):
    contours = graph_contours(ball_height, 12.0, 9, 0.0, np.random.default_rng(4))
    wall = [[-0.2, 0.0, -6.0], [-0.2, 0.0, -3.0], [-0.2, 0.0, 0.0], [-0.1, 0.0, 0.0]]
    turned = replace(contours[0], points=np.concatenate([wall, contours[0].points[4:]]))
    path = write_csv(tmp_path / "e.csv", [turned, *contours[1:]])
    with pytest.raises(ValueError, match="points lie within .* of the reference point"):
        fit_file(path, noise=0.0, point=np.zeros(3))


@pytest.mark.parametrize("text", ["1,2", "1,2,x", "1,2,inf", "", "1 2 3"])
def test_a_vector_is_three_numbers(text):
    with pytest.raises(ValueError, match="give three numbers as X,Y,Z"):
        parse_vector(text, "--point")


def test_each_number_is_explained_in_the_help_and_in_the_documents(folder):
    words = " ".join(touchatlas("fit", "--help", cwd=folder).stdout.split())
    document = (Path(__file__).parents[4] / "docs" / "output.md").read_text()
    for listed in (FIT_NUMBERS, DIAGNOSIS_NUMBERS):
        rows = [f"| `{n}` | {m.what} | {m.unit} | {m.good} |" for n, m in listed.items()]
        assert "\n".join(rows) in document
        assert all(f"{name}: {about.what[:20]}" in words for name, about in listed.items())


@pytest.mark.parametrize("unit", ["mm", ""])
def test_the_table_has_the_unit_that_the_file_names(folder, tmp_path, unit):
    text = (folder / "ball.csv").read_text()
    named = text.replace("x,y,z", f"x [{unit}],y [{unit}],z [{unit}]" if unit else "x,y,z", 1)
    (tmp_path / "named.csv").write_text(named)
    report = fit_file(tmp_path / "named.csv")
    length = unit or "file's unit"
    assert set(report.units.values()) == {length, f"1 / {length}"}

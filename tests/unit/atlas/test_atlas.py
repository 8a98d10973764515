"""The atlas against theorems, invariances and its own deviations, on a ball touched all over."""

import io
import json
import zipfile
from copy import deepcopy

import numpy as np
import pytest

from tests.explored import bumpy as made_bumpy
from tests.explored import explored
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.mesh.extract import extract_surface
from touchatlas.atlas.patches.normal_equations import absorb, solve
from touchatlas.atlas.records.options import AtlasOptions
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.atlas.store import load_atlas, save_atlas
from touchatlas.patch.geometry.polynomial import monomials
from touchatlas.planner.loop import explore
from touchatlas.planner.planner import Planner
from touchatlas.sim.world.objects import make_object
from touchatlas.sim.world.probe import Probe


@pytest.fixture(scope="module")
def ball():
    return explored("sphere")


@pytest.fixture(scope="module")
def surface(ball):
    return extract_surface(ball.atlas)


def test_patch_graph_of_a_ball_has_euler_characteristic_two(ball):
    atlas = ball.atlas
    assert atlas.euler_characteristic() == 2
    # Every boundary of a closed surface ends in two corners, every corner joins three.
    assert 2 * atlas.graph.number_of_edges() == 3 * len(atlas.corners)
    assert not atlas.gaps and len(atlas.frontier) == 0


def test_patch_graph_of_a_torus_has_euler_characteristic_zero():
    assert explored("torus").atlas.euler_characteristic() == 0


def test_exact_contacts_close_an_atlas_too():
    """Without noise nothing but the borne lack of fit tells the prior what is small."""
    obj = make_object("torus")
    atlas, planner = Atlas(obj.tolerance), Planner(*obj.start())
    for _ in explore(atlas, planner, Probe(obj, 0.0, np.random.default_rng(0)), 400):
        pass
    atlas.refit_all()
    assert atlas.euler_characteristic() == 0 and atlas.touches < 400
    surface = extract_surface(atlas)
    # A residual of 0.2 tolerances rms is borne; its largest on the surface is some 2.5 of it.
    off = np.abs(obj.project(surface.vertices) - surface.vertices).max()
    assert off < 0.5 * obj.tolerance


def test_closed_atlas_of_a_ball_has_total_curvature_four_pi(surface):
    assert surface.total_curvature() == pytest.approx(4 * np.pi, rel=0.02)


def test_surface_of_a_closed_atlas_is_watertight_and_near_the_truth(surface):
    edges = np.sort(surface.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()
    radii = np.linalg.norm(surface.vertices, axis=1)
    assert np.abs(radii - 33.0).mean() < 0.01
    held = np.mean(np.abs(radii - 33.0) <= 1.96 * surface.deviation)
    assert 0.85 < held <= 1.0
    outward = (surface.normals * surface.vertices).sum(axis=1) / radii
    assert outward.min() > 0.99


def test_boundary_lies_on_the_radical_plane_and_on_both_patches(ball):
    atlas = ball.atlas
    for i, j, data in list(atlas.graph.edges(data=True))[:40]:
        boundary = data["boundary"]
        assert boundary.patches == (min(i, j), max(i, j))
        if not len(boundary.points):
            continue
        offset_i = boundary.points - atlas.table.site[i]
        offset_j = boundary.points - atlas.table.site[j]
        power_i = (offset_i**2).sum(axis=1) - atlas.table.weight[i]
        power_j = (offset_j**2).sum(axis=1) - atlas.table.weight[j]
        assert power_i == pytest.approx(power_j, abs=1e-8 * atlas.table.weight[i])
        # Midway between two patches that are a noise or two apart.
        gap = max(np.abs(atlas.patch(k).signed_distance(boundary.points)).max() for k in (i, j))
        assert gap < 0.2
        assert boundary.gap_rms < 0.1 and not boundary.crease


def test_corners_have_equal_power_of_three(ball):
    table = ball.atlas.table
    for triple, point in list(ball.atlas.corners.items())[:60]:
        power = [((point - table.site[i]) ** 2).sum() - table.weight[i] for i in triple]
        assert np.ptp(power) < 1e-6 * table.weight[triple[0]]


@pytest.mark.parametrize("seed", range(3))
def test_sums_of_samples_do_not_depend_on_their_order(ball, seed):
    """A patch that learns its samples one by one, in any order, ends with the sums of all of them
    at once: rounding apart, 1e-9 of the largest."""
    table, membership = deepcopy(ball.atlas.table), ball.atlas.membership
    rng, names = np.random.default_rng(seed), ("moments", "rhs", "sum_of_squares", "count")
    for row in rng.choice(table.rows, 5, replace=False).tolist():
        whole = {name: np.array(getattr(table, name)[row]) for name in names}
        for name in names:
            getattr(table, name)[row] = 0.0
        for index in np.array_split(rng.permutation(membership.fitted[row]), 7):
            every = np.ones((1, len(index)), bool)
            absorb(table, np.array([row]), membership.pool, index, every)
        for name, sums in whole.items():
            error = np.abs(getattr(table, name)[row] - sums).max()
            assert error <= 1e-9 * np.abs(sums).max(), name


@pytest.mark.parametrize("seed", range(3))
def test_touches_in_any_order_give_the_same_surface(ball, seed):
    """Patches differ with the order of the touches, the surface does so within its deviations:
    two atlases of the same samples disagree by less than each is unsure, at 95 %."""
    atlas = Atlas(ball.atlas.tolerance)
    for i in np.random.default_rng(seed).permutation(len(ball.touches)):
        atlas.add(ball.touches[i])
    atlas.validate()
    points, _ = make_object("sphere").sample(2000, np.random.default_rng(seed))
    first, second = ball.atlas.blend(points), atlas.blend(points)
    assert first.known.all() and second.known.mean() > 0.99
    apart = np.abs(first.distance - second.distance)[second.known]
    assert np.quantile(apart / first.deviation[second.known], 0.95) < 1.96


def test_far_points_are_unknown(ball):
    seen = ball.atlas.blend(np.array([[0.0, 0.0, 0.0], [500.0, 0.0, 0.0]]))
    assert not seen.known.any()
    assert np.isnan(seen.distance).all() and (seen.patch == -1).all()


def test_scaling_all_input_scales_the_atlas(ball):
    twice = explored("sphere", scale=2.0)
    assert len(twice.atlas) == len(ball.atlas)
    assert twice.atlas.table.origin == pytest.approx(2.0 * ball.atlas.table.origin, abs=1e-7)
    assert twice.atlas.table.radius == pytest.approx(2.0 * ball.atlas.table.radius, rel=1e-9)


def test_untouched_is_a_value_not_an_error():
    atlas = Atlas(0.1)
    nothing = Touch(0, np.zeros(3), np.array([0, 0, 1.0]), (), TouchStatus.NO_CONTACT, 0.0, 1.0)
    change = atlas.add(nothing)
    assert change.refused and not change.added and len(atlas) == 0
    assert not atlas.blend(np.zeros((1, 3))).known.any()


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan])
def test_tolerance_must_be_a_length(tolerance):
    with pytest.raises(ValueError, match="tolerance"):
        Atlas(tolerance)


def test_surface_of_nothing_is_refused():
    with pytest.raises(ValueError, match="no patch yet"):
        extract_surface(Atlas(0.1))


def test_saved_atlas_comes_back_whole(ball, tmp_path):
    path = tmp_path / "atlas.npz"
    save_atlas(path, ball.atlas)
    again = load_atlas(path)
    for name in again.table.names:
        assert (getattr(again.table, name) == getattr(ball.atlas.table, name)).all(), name
    assert np.array_equal(again.neighbours.lines(), ball.atlas.neighbours.lines())
    save_atlas(tmp_path / "again.npz", again)
    assert (tmp_path / "again.npz").read_bytes() == path.read_bytes()


def test_loaded_atlas_goes_on_learning(tmp_path):
    half = explored("sphere", max_touches=20)
    save_atlas(tmp_path / "half.npz", half.atlas)
    again = load_atlas(tmp_path / "half.npz")
    for touch in explored("sphere", max_touches=30).touches[20:]:
        assert again.add(touch).added == half.atlas.add(touch).added
    assert again.table.mean == pytest.approx(half.atlas.table.mean, rel=1e-9, abs=1e-12)


def test_file_of_another_format_is_refused_with_what_to_do(ball, tmp_path):
    save_atlas(tmp_path / "a.npz", ball.atlas)
    with np.load(tmp_path / "a.npz") as file:
        arrays = {name: file[name] for name in file.files}
    header = json.loads(arrays["header"].tobytes())
    for number in (1, 99):
        text = json.dumps({**header, "format": number}).encode()
        with open(tmp_path / "b.npz", "wb") as file:
            np.savez(file, **{**arrays, "header": np.frombuffer(text, np.uint8)})
        with pytest.raises(ValueError, match=f"has format {number}; .* explore again"):
            load_atlas(tmp_path / "b.npz")


def test_variance_is_that_of_the_covariance(ball):
    """phi^t C phi, and the polynomial that it is: rounding apart, times the 441 products."""
    table, rng = ball.atlas.table, np.random.default_rng(0)
    rows = table.rows[:5]
    points = rng.uniform(-0.6, 0.6, (3, len(rows), 50))
    terms = monomials(table.basis, *points)[: table.basis.size].transpose(1, 0, 2)
    variance = table.variance_at(rows, terms)
    for i, row in enumerate(rows.tolist()):
        covariance = ball.atlas.patch(row).covariance
        expected = np.einsum("tn,ts,sn->n", terms[i], covariance, terms[i])
        assert np.abs(variance[i] - expected).max() <= 441 * 2.3e-16 * np.abs(covariance).max()


def test_an_open_bracket_in_a_header_is_damage(ball, tmp_path):
    """Arrays say their shapes in a line of Python, which numpy reads by Python's own tokenizer."""
    save_atlas(tmp_path / "a.npz", ball.atlas)
    with np.load(tmp_path / "a.npz") as file:
        arrays = {name: file[name] for name in file.files}
    with zipfile.ZipFile(tmp_path / "bad.npz", "w") as out:
        for name, array in arrays.items():
            buffer = io.BytesIO()
            np.save(buffer, array)
            data = buffer.getvalue()
            out.writestr(f"{name}.npy", data.replace(b"), }", b"(, }", 1))
    with pytest.raises(ValueError, match="no whole atlas file"):
        load_atlas(tmp_path / "bad.npz")


@pytest.mark.parametrize("path", ["/dev/zero", "."])
def test_what_is_no_file_is_not_read(path):
    with pytest.raises(ValueError, match="folder or device"):
        load_atlas(path)


@pytest.mark.parametrize("damage", ["cut", "flip"])
def test_damaged_file_is_refused(ball, tmp_path, damage):
    path = tmp_path / "atlas.npz"
    save_atlas(path, ball.atlas)
    data = bytearray(path.read_bytes())
    if damage == "cut":
        data = data[: len(data) // 2]
    else:
        data[len(data) // 2] ^= 0xFF
    path.write_bytes(bytes(data))
    with pytest.raises(ValueError, match="cut off or altered"):
        load_atlas(path)


@pytest.mark.parametrize("name", ["header", "sample_points", "table_mean", "owned_counts"])
def test_file_with_other_arrays_is_refused(ball, tmp_path, name):
    """Arrays that are not there, or of another length."""
    path = tmp_path / "atlas.npz"
    save_atlas(path, ball.atlas)
    with np.load(path) as file:
        arrays = {key: file[key] for key in file.files}
    for wrong in ({}, {name: arrays[name][:-1]}):
        with open(path, "wb") as file:
            np.savez(file, **({k: v for k, v in arrays.items() if k != name} | wrong))
        with pytest.raises(ValueError, match="cut off or altered"):
            load_atlas(path)


def test_only_files_are_replaced(ball, tmp_path):
    with pytest.raises(OSError, match="give the path of a file"):
        save_atlas(tmp_path, ball.atlas)


@pytest.mark.parametrize("wrong", [{"trust": 0.0}, {"trust": np.nan}, {"bias": -1.0}])
def test_options_are_numbers_of_tolerances(wrong):
    with pytest.raises(ValueError, match="tolerances"):
        AtlasOptions(**wrong)


def test_failed_write_leaves_the_old_file(ball, tmp_path, monkeypatch):
    path = tmp_path / "atlas.npz"
    save_atlas(path, ball.atlas)
    before = path.read_bytes()

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        save_atlas(path, Atlas(0.1))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["atlas.npz"]


@pytest.fixture(scope="module")
def bumpy():
    return made_bumpy()


def test_residuals_explain_bumps_finer_than_patches(bumpy):
    """At vertices of the bumpy ball, where the polynomials alone err by a third of the bumps."""
    atlas, points, before, count = bumpy
    after = atlas.blend(points)
    assert count > 0.8 * len(atlas) and after.known.mean() > 0.95
    assert np.nanmean(np.abs(after.distance)) < 0.6 * np.nanmean(before)
    held = np.abs(after.distance) <= 1.96 * after.deviation
    assert np.mean(held[after.known]) > 0.8


def test_learning_residuals_again_changes_nothing(bumpy):
    """The trends are solved anew from the same sums first: equal but for rounding."""
    atlas, points, _, count = bumpy
    before = atlas.blend(points).distance
    assert atlas.learn_residuals() == count
    assert atlas.blend(points).distance == pytest.approx(before, abs=1e-6, nan_ok=True)


def test_saved_residuals_come_back_whole(bumpy, tmp_path):
    atlas, points, _, count = bumpy
    save_atlas(tmp_path / "atlas.npz", atlas)
    again = load_atlas(tmp_path / "atlas.npz")
    assert (
        sorted(again.table.residuals) == sorted(atlas.table.residuals)
        and again.residual_scale == atlas.residual_scale
    )
    for name in ("distance", "normal", "deviation"):
        now, then = (getattr(a.blend(points), name) for a in (again, atlas))
        assert (np.isnan(now) == np.isnan(then)).all() and (now == then)[~np.isnan(now)].all()
    save_atlas(tmp_path / "again.npz", again)
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "atlas.npz").read_bytes()


def test_a_patch_that_learns_loses_its_residual(bumpy, tmp_path):
    atlas, _, _, _ = bumpy
    save_atlas(tmp_path / "atlas.npz", atlas)
    again = load_atlas(tmp_path / "atlas.npz")
    row = min(again.table.residuals)
    solve(again.table, np.array([row]))
    assert (
        row not in again.table.residuals
        and len(again.table.residuals) == len(atlas.table.residuals) - 1
    )


def test_blend_gradient_with_residuals_is_its_normal(bumpy):
    """As on the ball, looser by the slopes of the bumps, 0.3 where they are steepest, times the
    disagreement of neighbouring patches."""
    atlas, points, _, _ = bumpy
    seen, h = atlas.blend(points), 1e-3
    gradient = np.stack(
        [
            (atlas.blend(points + h * e).distance - atlas.blend(points - h * e).distance) / (2 * h)
            for e in np.eye(3)
        ],
        axis=1,
    )
    error = np.linalg.norm(gradient - seen.normal, axis=1)
    assert np.nanquantile(error, 0.9) < 0.1

"""What is read of a recording in whatever form it is written."""

import time

import numpy as np
import pytest

from tests.unit.sim.recorded.written_kinds import CURVES, KINDS, NORMALS, rows
from touchatlas.sim.recorded.contour_file import read_curves
from touchatlas.sim.recorded.curves import ReadOptions
from touchatlas.sim.recorded.fit_file import fit_file
from touchatlas.sim.recorded.scans import read_scans


def written(tmp_path, kind):
    path = tmp_path / f"r.{kind.lower() if kind in ('OBJ', 'PTX') else 'txt'}"
    path.write_text(KINDS[kind][0] + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_gives_the_same_three_curves_and_says_how_it_was_read(tmp_path, kind):
    _, unit, words = KINDS[kind]
    found = read_curves(written(tmp_path, kind))
    assert words in found.how and "\n" not in found.how
    assert found.unit == unit
    assert [len(curve.points) for curve in found.curves] == [25, 25, 25], found.how
    for curve, true in zip(found.curves, CURVES, strict=True):
        # The files hold four decimals.
        assert curve.points == pytest.approx(true, abs=1e-9)


NAMED = rows("{k},{mm},{nx},{ny},{nz}")
HEADER = "curve,x,y,z,nx,ny,nz"


def test_vectors_are_told_apart_by_how_the_curves_lie_to_them(file):
    normals = read_curves(file(HEADER, *NAMED))
    assert all(curve.exact and curve.normal is None for curve in normals.curves)
    # Five decimals.
    assert normals.curves[1].outward == pytest.approx(NORMALS[1], abs=2e-5)
    sides = read_curves(file(HEADER, *rows("{k},{mm},0,0,2")))
    assert not any(curve.exact for curve in sides.curves)
    assert (sides.curves[0].outward == [0.0, 0.0, 1.0]).all()
    across = [f"{-np.sin(a):.6f},{np.cos(a):.6f},0" for a in np.pi / 3 * np.arange(3)]
    lines = [f"{line},{across[i // 25]}" for i, line in enumerate(rows("{k},{mm}"))]
    planes = read_curves(file(HEADER, *lines))
    assert all(curve.outward is None for curve in planes.curves)
    assert planes.curves[2].normal == pytest.approx([-np.sin(2.0944), -0.5, 0.0], abs=1e-4)


def test_normals_of_a_flat_face_are_no_planes_and_slices_have_planes(file):
    flat = [f"{k},{i},{k},5,0,0,1" for k in range(4) for i in range(9)]
    assert all(curve.exact for curve in read_curves(file(HEADER, *flat)).curves)
    angles = np.linspace(0.0, 6.0, 40)
    rings = [f"{k},{np.cos(a):.4f},{np.sin(a):.4f},{k},0,0,1" for k in range(4) for a in angles]
    assert all(c.normal is not None for c in read_curves(file(HEADER, *rings)).curves)


def test_vectors_tell_the_outer_side(file):
    inward = [
        line.replace(f",{n[2]:.5f}", f",{-n[2]:.5f}")
        for line, n in zip(rows("{k},{mm},0,0,{nz}"), np.concatenate(NORMALS), strict=True)
    ]
    for lines, up in ((rows("{k},{mm},0,0,{nz}"), 1.0), (inward, -1.0)):
        report = fit_file(file(HEADER, *lines))
        assert report.patch.frame.normal[2] * up > 0.99
        assert "outward side assumed" not in report.flags


@pytest.mark.parametrize("given", ["as columns", "not at all"])
def test_a_tip_is_taken_off_along_the_normals(file, given):
    """Centres of a ball of 1.5 give the curvatures of the contacts, 1 / 40 and 1 / 25."""
    centres = np.concatenate(CURVES) + 1.5 * np.concatenate(NORMALS)
    vectors = np.concatenate(NORMALS) if given == "as columns" else None
    lines = [
        ",".join(
            [
                str(i // 25),
                *(f"{x:.5f}" for x in p),
                *(f"{x:.6f}" for x in ([] if vectors is None else vectors[i])),
            ]
        )
        for i, p in enumerate(centres)
    ]
    path = file(HEADER if given == "as columns" else "curve,x,y,z", *lines)
    k = fit_file(path, options=ReadOptions(tip_radius=1.5)).patch.curvatures
    # Points are rounded to 1e-4 over a patch of 8: 6.71 of that over its square and root of n.
    assert [k.k1, k.k2] == pytest.approx([-1 / 40, -1 / 25], abs=3e-4)
    wrong = fit_file(path).patch.curvatures
    assert abs(wrong.k2 + 1 / 25) > 1.5e-3


def test_failed_points_are_left_out_and_counted(file):
    for name, good, bad in (("hit", "1", "0"), ("State", "OK", "MISSING"), ("fail", "no", "yes")):
        lines = rows(f"{{k}},{{mm}},{good}")
        lines[3] = f"0,12,-3.5,-90,{bad}"
        found = read_curves(file(f"curve,x,y,z,{name}", *lines))
        assert [len(c.points) for c in found.curves] == [24, 25, 25]
        assert f"lines left out: 1 that {name} calls failed" in found.how


def test_columns_can_be_said_by_number_and_by_name(file):
    path = file("a,b,c,d,e", *rows("{k},7,{mm}"))
    for said in ("x=3,y=4,z=5,curve=1", "x=c, y=d, z=e, curve=a"):
        found = read_curves(path, ReadOptions(columns=said, unit="mm"))
        assert [len(c.points) for c in found.curves] == [25] * 3 and found.unit == "mm"
    for said, words in (
        ("x=3,y=4", "must name x, y and z"),
        ("x=3,y=4,z=9", "has 5 columns: a, b"),
        ("u=3", "give curve, x"),
        ("x=1,y=2,z=3,nx=4", "all of nx, ny, nz"),
    ):
        with pytest.raises(ValueError, match=words):
            read_curves(path, ReadOptions(columns=said))


def test_files_without_three_planes_are_read(file):
    """A single point, a cloud, a long spiral, parallel slices: whatever there is."""
    point = read_curves(file("x,y,z,nx,ny,nz", "1,2,3,0,0,1"))
    assert point.curves[0].name == "" and point.curves[0].exact
    rng = np.random.default_rng(0)
    cloud = read_curves(
        file(*(f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in rng.normal(size=(300, 3))))
    )
    assert [c.name for c in cloud.curves] == [""] and "follow no curve" in cloud.how
    t = np.linspace(0.0, 60.0, 3000)
    spiral = np.stack([np.cos(t), np.sin(t), t / 30], axis=1)
    found = read_curves(file(*(",".join(f"{x:.5f}" for x in p) for p in spiral)))
    assert [len(c.points) for c in found.curves] == [3000] and "one curve" in found.how
    a = np.linspace(0.0, 2 * np.pi, 60)
    lines = [
        f"{60 * k + i} {np.cos(b):.3f} {np.sin(b):.3f} {k}.0"
        for k in range(4)
        for i, b in enumerate(a)
    ]
    assert "slices of equal z" in read_curves(file(*lines)).how


def test_a_raster_that_goes_back_and_forth_is_no_curve(file):
    """Four rows of four, every second one backward, as a control probes a table: along a curve its
    turns would be taken for noise. Two runs of a wavy section are none."""
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    x[1::2] = x[1::2, ::-1]
    rng = np.random.default_rng(1)
    rows = np.column_stack([x.ravel(), y.ravel(), -1.0 + 1e-4 * rng.normal(size=16)])
    path = file(*(f"{a:.4f} {b + 1e-3 * c:.4f} {c:.6f}" for a, b, c in rows))
    found = read_curves(path)
    assert [c.name for c in found.curves] == [""] and "all over an area" in found.how
    with pytest.raises(ValueError, match="too few to tell how noisy they are; give --noise"):
        read_scans([path], options=ReadOptions(unit="mm"))
    s = np.linspace(0.0, 20.0, 120)
    wavy = file(*(f"{a:.4f} {np.sin(a):.4f} {0.1 * a:.4f}" for a in s))
    assert [len(c.points) for c in read_curves(wavy).curves] == [120]


def test_refusals_say_how_the_file_was_read(file):
    with pytest.raises(
        ValueError, match="only 1 curve has .* was read so: cells .* time is column"
    ):
        fit_file(file(*(f"{0.1 * i:.2f},{i}.1,{i * i}.2,{i % 7}.5" for i in range(40))))


def test_twenty_thousand_lines_take_about_a_second(file):
    t = 0.002 * np.arange(20_000)
    lines = [f"{a:.3f},{8 * np.cos(a):.4f},{8 * np.sin(a):.4f},{a:.4f}" for a in t]
    path = file(*lines)
    start = time.process_time()
    assert len(read_curves(path).curves) == 1
    # It is 0.3 s on one core; others may share it.
    assert time.process_time() - start < 3.0


def test_drawings_hold_curves_and_points(tmp_path):
    import ezdxf

    drawing = ezdxf.new(units=4)
    for points in CURVES:
        drawing.modelspace().add_polyline3d(points.tolist())
    drawing.modelspace().add_point((1.0, 2.0, 3.0))
    drawing.saveas(tmp_path / "r.dxf")
    found = read_curves(tmp_path / "r.dxf")
    assert [len(c.points) for c in found.curves] == [25, 25, 25, 1] and found.unit == "mm"


def test_clouds_of_ply_files_keep_their_normals(tmp_path):
    header = ["ply", "format ascii 1.0", "element vertex 75"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    lines = [*header, "end_header", *rows("{pose} {nx} {ny} {nz}")]
    (tmp_path / "r.ply").write_text("\n".join(lines) + "\n")
    (cloud,) = read_curves(tmp_path / "r.ply").curves
    assert cloud.name == "" and cloud.exact
    # Single precision at 20.
    assert cloud.points[:25] == pytest.approx(CURVES[0], abs=1e-5)
    # The top, where the curves cross, counts once.
    assert len(cloud.points) == 73


def test_scans_of_centres_say_their_tip(file):
    """The atlas takes the tip off, so points stay where they are, with or without normals."""
    tip = ReadOptions(tip_radius=1.5, systematic_std=0.01)
    for header, lines in (("curve,x,y,z", rows("{k},{mm}")), (HEADER, NAMED)):
        found = read_scans([file(header, *lines)], options=tip)
        [scan] = found.scans
        assert (scan.tip_radius, scan.systematic_std) == (1.5, 0.01)
        assert scan.points == pytest.approx(np.concatenate(CURVES)[: len(scan)], abs=1e-4)
        assert found.said[-1] == "points are centres of a tip of radius 1.5"


def test_poses_are_in_metres_unless_no_robot_reaches_so_far(file):
    names = "# timestamp tx ty tz qx qy qz qw"
    near = read_curves(file(names, *rows("{t:.2f} {pose} 0 0 0 1")))
    assert near.unit == "m" and "metres, as poses of robots are in" in near.how
    far = read_curves(file(names, *rows("{t:.2f} 5{pose} 0 0 0 1")))
    assert far.unit == ""

"""Faults of a probe, each alone: `faults.py [FAULT ...] [--bodies NAME ...] [--out CSV]`.

The simulated probe is ideal but for its noise. Each fault changes its touches, as a real probe or
a mistake of its owner does, and the table says what an exploration then ends with. Lengths are in
tolerances; predicted is the share that the planner expects within the tolerance, within the true
one.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import igl
import numpy as np
import trimesh

from touchatlas.atlas import Atlas, Touch, doubts, extract_surface
from touchatlas.patch import Contour, ContourEnd
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, evaluate_surface, make_object, truth_of

BODIES = "bottle", "cube"
COLUMNS = (
    *("fault", "body", "seed", "touches", "ended", "predicted", "within", "p95", "largest"),
    *("calibration", "doubts"),
)
MOST, POINTS = 80, 8000
# Number of the touch before which the object moves, or the unit changes.
SINCE = 5


def of_contours(change: Callable[[Contour, Touch, np.random.Generator], Contour]):
    """A fault of each contour."""

    def fault(probe, plan, rng):
        touch = probe(plan)
        return replace(touch, contours=tuple(change(c, touch, rng) for c in touch.contours))

    return fault


def shifted(plan_or_touch, offset):
    """A plan or a touch, moved by an offset (3,)."""
    if isinstance(plan_or_touch, Touch):
        touch = plan_or_touch
        contours = tuple(
            replace(
                c,
                points=c.points + offset,
                plane=replace(c.plane, point=c.plane.point + offset),
            )
            for c in touch.contours
        )
        way = None if touch.way is None else touch.way + offset
        return replace(touch, contact=touch.contact + offset, contours=contours, way=way)
    plan, until = plan_or_touch, plan_or_touch.until
    return replace(
        plan,
        reference_point=plan.reference_point + offset,
        planes=tuple(replace(p, point=p.point + offset) for p in plan.planes),
        until=None if until is None else lambda points: until(points - offset),
    )


def moved(tolerances: float, size: float):
    """The object is moved, once, before a touch."""
    offset = tolerances * size * np.array([2.0, -1.0, 2.0]) / 3.0

    def fault(probe, plan, rng):
        if plan.number < SINCE:
            return probe(plan)
        return shifted(probe(shifted(plan, -offset)), offset)

    return fault


def tip(obj, radius: float):
    """Points are centres of a ball tip: those of the offset surface of a smooth body."""
    offset: list[Probe] = []

    def fault(probe, plan, rng):
        if not offset:
            mesh = trimesh.Trimesh(*obj.mesh(0.02 * obj.tolerance), process=False)
            mesh.vertices = mesh.vertices + radius * mesh.vertex_normals
            with TemporaryDirectory() as folder:
                mesh.export(f"{folder}/offset.ply")
                larger = make_object(f"{folder}/offset.ply")
            offset.append(Probe(larger, obj.noise_std, rng))
        return offset[0](plan)

    return fault


def displaced(length: float):
    """Each curve is displaced as a whole, in a direction of its own."""

    def change(contour, touch, rng):
        step = rng.normal(size=3)
        return replace(contour, points=contour.points + length * step / np.linalg.norm(step))

    return of_contours(change)


def turned(degrees: float):
    """The sampling plane is another one than is stated."""

    def change(contour, touch, rng):
        angle, normal = np.deg2rad(degrees), contour.plane.normal
        along = np.cross(normal, touch.approach)
        turn = np.cos(angle) * normal + np.sin(angle) * np.cross(along, normal)
        plane = replace(contour.plane, normal=turn / np.linalg.norm(turn))
        return replace(contour, plane=plane)

    return of_contours(change)


def lost(share: float):
    """A share of the arms ends early, as if contact were lost."""

    def change(contour, touch, rng):
        points, ends = contour.points, list(contour.ends)
        at = int(((points - touch.contact) ** 2).sum(axis=1).argmin())
        first, last = 0, len(points)
        if rng.random() < share and at > 8:
            first, ends[0] = int(rng.integers(1, at - 5)), ContourEnd.LOST_CONTACT
        if rng.random() < share and last - at > 8:
            last, ends[1] = int(rng.integers(at + 6, last)), ContourEnd.LOST_CONTACT
        return replace(contour, points=points[first:last], ends=tuple(ends))

    return of_contours(change)


def outliers(share: float, length: float):
    """A share of the points is off by a length in a direction of its own."""

    def change(contour, touch, rng):
        points = contour.points.copy()
        bad = rng.random(len(points)) < share
        step = rng.normal(size=(int(bad.sum()), 3))
        points[bad] += length * step / np.linalg.norm(step, axis=1)[:, None]
        return replace(contour, points=points)

    return of_contours(change)


def stated(factor: float):
    """The noise that is stated is the true one times a factor."""
    return of_contours(lambda contour, touch, rng: replace(contour, noise_std=factor * 0.02))


def faults(obj) -> dict[str, Callable]:
    """The faults of touches of an object, by name."""
    tolerance = obj.tolerance
    return {
        "none": lambda probe, plan, rng: probe(plan),
        "tip radius of 2 mm not taken off": tip(obj, 2.0),
        "moved by 1 tolerance after 5 touches": moved(1.0, tolerance),
        "moved by 5 tolerances after 5 touches": moved(5.0, tolerance),
        "each curve displaced by 0.2 tolerances": displaced(0.2 * tolerance),
        "plane turned by 1 degree": turned(1.0),
        "contact lost in 20 % of the arms": lost(0.2),
        "1 % of the points off by 3 mm": outliers(0.01, 3.0),
        "noise 3 times the stated": stated(1.0 / 3.0),
        "noise a third of the stated": stated(3.0),
    }


def explored(fault: str, body: str, seed: int) -> dict[str, str]:
    """The row of one exploration, as text."""
    obj = make_object(body)
    tolerance = obj.tolerance
    atlas = Atlas(tolerance, scale=5.0 * obj.noise_std)
    planner = Planner(*obj.start())
    probe = Probe(obj, obj.noise_std, np.random.default_rng(seed))
    rng, change = np.random.default_rng(seed + 1), faults(obj)[fault]
    row = dict.fromkeys(COLUMNS, "–") | {"fault": fault, "body": body, "seed": str(seed)}
    try:
        steps = list(explore(atlas, planner, lambda plan: change(probe, plan, rng), MOST))
        row["touches"] = str(len(steps))
        stopped, forecast = planner.stop, planner.forecast(atlas)
        atlas.finish()
        surface = extract_surface(atlas)
    except ValueError as error:
        return row | {"ended": f"ValueError: {str(error).splitlines()[0]}"}
    judge = np.random.default_rng(seed + 2)
    truth = truth_of(obj, tolerance, judge)
    mesh = surface.vertices, surface.faces
    found = evaluate_surface(*mesh, truth, tolerance, judge, surface.deviation)
    points = obj.sample(POINTS, judge)[0]
    within = np.sqrt(igl.point_mesh_squared_distance(points, *mesh)[0]) <= tolerance
    names = dict.fromkeys(d.name for d in doubts(atlas, surface, stopped=stopped))
    return row | {
        "ended": f"{MOST} touches" if stopped is None else stopped.reason.value,
        "predicted": f"{forecast.predicted_coverage:.3f}",
        "within": f"{within.mean():.3f}",
        "p95": f"{max(found.accuracy_p95, found.completeness_p95) / tolerance:.2g}",
        "largest": f"{max(found.accuracy_max, found.completeness_max) / tolerance:.2g}",
        "calibration": f"{found.deviation_calibration:.2f}",
        "doubts": ", ".join(names) or "none",
    }


def main(arguments: argparse.Namespace) -> None:
    names = list(faults(make_object("sphere")))
    chosen = arguments.fault or names
    if unknown := [name for name in chosen if name not in names]:
        sys.exit(f"{unknown[0]!r} is no fault; choose from: {'; '.join(names)}")
    rows = []
    for fault in chosen:
        for body in arguments.bodies:
            rows.append(explored(fault, body, arguments.seed))
            print(", ".join(f"{key} {value}" for key, value in rows[-1].items()), flush=True)
            if arguments.out:
                write(arguments.out, rows)


def write(path: Path, rows: list[dict[str, str]]) -> None:
    """Write the rows so far."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fault", nargs="*", help="all when none is named")
    parser.add_argument("--bodies", nargs="+", default=BODIES, metavar="NAME")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="file of the rows")
    main(parser.parse_args())

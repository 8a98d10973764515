"""A large part by regions on workers, beside one process.

    python examples/large_part.py [--columns 6] [--rows 4] [--touches 300] [--most 100]
                                  [--workers 2] [--rippled] [--one] [--out FOLDER]

The part is a plate with round bosses, COLUMNS x ROWS squares of 40 mm, or a ball with ripples,
which is the larger the more touches there are. The touches are spread evenly, with noise of 0.02 mm
for a tolerance of 0.1 mm. Printed are faces, errors against the truth, everywhere and at the seams
between regions, seconds of processor time and memory; with --one those of one process, too, and how
far both surfaces are apart.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import resource
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from touchatlas.atlas import Atlas, extract_surface
from touchatlas.atlas.files import write_whole
from touchatlas.atlas.regions import regions_of
from touchatlas.atlas.store import atlas_bytes
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.study.regions import learn_by_regions
from touchatlas.sim.study.surface_peers import spread_plans
from touchatlas.sim.study.workers import WorkOptions
from touchatlas.sim.world.implicit_fields import Field
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.probe import Probe

SIDE, RADIUS, PLATE, BOSS = 40.0, 11.0, 10.0, 12.0
NOISE, TOLERANCE = 0.02, 0.1


def bosses(columns: int, rows: int, sections: int = 128) -> MeshObject:
    """A plate with a round boss amid each square."""
    angle = np.linspace(-np.pi, np.pi, sections, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    square = 0.5 * SIDE * circle / np.abs(circle).max(axis=1)[:, None]
    # From the middle of the bottom to that of the top of a boss.
    rings = [(0.0 * square, 0.0), (square, 0.0), (square, PLATE), (RADIUS * circle, PLATE)]
    rings += [(RADIUS * circle, PLATE + BOSS), (0.0 * circle, PLATE + BOSS)]
    on, after = np.arange(sections), np.roll(np.arange(sections), -1)
    size, points, faces = SIDE * np.array([columns, rows]), [], []
    for place in np.ndindex(columns, rows):
        middle, first = SIDE * (np.array(place) + 0.5), sum(map(len, points))
        points += [np.column_stack([r + middle, np.full(sections, z)]) for r, z in rings]
        rim = square + middle
        at_side = (np.abs(rim) < 1e-6) | (np.abs(rim - size) < 1e-6)
        outer = (at_side & at_side[after]).any(axis=1)
        for low in range(5):
            a, b = first + low * sections + on, first + low * sections + after
            kept = outer if low == 1 else slice(None)
            faces += [np.stack([a, b, a + sections], axis=1)[kept]]
            faces += [np.stack([b, b + sections, a + sections], axis=1)[kept]]
    mesh = trimesh.Trimesh(np.concatenate(points), np.concatenate(faces))
    mesh.merge_vertices()
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.fix_normals()
    return MeshObject("bosses", np.array(mesh.vertices), np.array(mesh.faces))


def rippled(radius: float, wave: float = 40.0, height: float = 0.7) -> ImplicitObject:
    """A ball with ripples of a wave length."""
    k = 2.0 * np.pi / wave

    def first_order(points):
        value = (points**2).sum(axis=1) / (2.0 * radius) - 0.5 * radius
        gradient = points / radius + height * k * np.cos(k * points)
        return value + height * np.sin(k * points).sum(axis=1), gradient

    def hessian(points):
        return np.eye(3) / radius - height * k**2 * np.sin(k * points)[:, None] * np.eye(3)

    own = "rippled", "a ball with ripples", Field(first_order, hessian)
    return ImplicitObject(*own, np.full(3, radius + 4.0 * height), NOISE, TOLERANCE)


def touched(obj, count: int, journal: Path) -> list:
    """Touches spread evenly, which a journal keeps."""
    rng = np.random.default_rng(0)
    probe = Probe(obj, NOISE, rng)
    with closing(Journal(journal)) as file:
        for plan in spread_plans(*obj.sample(30 * count, rng), count):
            file.append(plan, probe(plan))
        return file.touches()


def judged(name: str, atlas: Atlas, obj, at_seam) -> None:
    """Print what became of an atlas."""
    surface = extract_surface(atlas)
    off = ClosestPoints(*obj.mesh(0.05 * TOLERANCE))(surface.vertices)[0]
    seam = at_seam(surface.vertices)
    held = float((off <= 1.96 * surface.deviation).mean())
    print(f"{name}: {atlas}")
    print(f"  {len(atlas.faces())} faces, {len(surface.faces)} triangles, held {held:.3f}")
    for words, some in (("everywhere", slice(None)), ("at seams", seam), ("elsewhere", ~seam)):
        rms, p95, most = np.sqrt(np.mean(off[some] ** 2)), *np.quantile(off[some], [0.95, 1.0])
        print(f"  error {words}: rms {rms:.4f}, 95 % {p95:.4f}, largest {most:.4f} mm")


def apart(first: Atlas, second: Atlas, at_seam) -> None:
    """Print how far two atlases are apart where both know the surface."""
    surface = extract_surface(first)
    seam = at_seam(surface.vertices)
    found = second.blend(surface.vertices)
    both = found.known & seam
    ratio = np.abs(found.distance[both]) / np.hypot(surface.deviation, found.deviation)[both]
    far = np.abs(found.distance[both])
    print(f"apart at seams: 95 % {np.quantile(far, 0.95):.4f} mm, largest {far.max():.4f} mm,")
    print(
        f"  within 1.96 deviations of both: {(ratio <= 1.96).mean():.4f} of {both.sum()} vertices"
    )


def memory(who: int = resource.RUSAGE_SELF) -> str:
    return f"{resource.getrusage(who).ru_maxrss / 1e3:.0f} MB"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    for name, default in (("columns", 6), ("rows", 4), ("touches", 300), ("most", 100)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rippled", action="store_true")
    parser.add_argument("--one", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("runs/large_part"))
    given = parser.parse_args()
    if given.out.exists():
        parser.error(f"{given.out} is there already; name another folder with --out")
    obj = rippled(4.0 * given.touches**0.5) if given.rippled else bosses(given.columns, given.rows)
    given.out.mkdir(parents=True)
    journal = given.out / "journal.sqlite"
    touches = touched(obj, given.touches, journal)
    print(f"{obj.name}, diagonal {obj.diagonal:.0f} mm, {len(touches)} touches")
    contacts, home = cKDTree([touch.contact for touch in touches]), np.zeros(len(touches), int)
    for number, region in enumerate(regions_of(touches, given.most)):
        home[region.own] = number

    def at_seam(points):
        nearest = home[contacts.query(points, k=2)[1]]
        return nearest[:, 0] != nearest[:, 1]

    begun, own = time.perf_counter(), time.process_time()
    work = WorkOptions(workers=given.workers)
    atlas = learn_by_regions(journal, given.out / "regions", TOLERANCE, given.most, work=work)
    atlas.finish()
    seconds = time.perf_counter() - begun, time.process_time() - own
    write_whole(given.out / "atlas.npz", atlas_bytes(atlas))
    with open(given.out / "regions" / "times.csv") as file:
        rows = list(csv.DictReader(file))
    of_regions = [float(row["seconds"]) for row in rows]
    print(
        f"{len(rows)} regions: {sum(of_regions):.0f} s of workers, largest {max(of_regions):.0f} s"
    )
    print(f"  and {max(float(row['gigabytes']) for row in rows) * 1e3:.0f} MB;", end=" ")
    print(
        f"{seconds[1]:.1f} s and {memory()} where they are joined; {seconds[0]:.0f} s on the clock"
    )
    judged("by regions", atlas, obj, at_seam)
    if given.one:
        begun, one = time.process_time(), Atlas(TOLERANCE)
        one.add_all(touches)
        one.finish()
        print(f"one process: {time.process_time() - begun:.0f} s, {memory()} with what was before")
        judged("one process", one, obj, at_seam)
        apart(atlas, one, at_seam)


if __name__ == "__main__":
    main()

"""The bodies of the guard: smooth, lawful, thin and open ones, and scans.

    python examples/guard_bodies.py

It prints their names and kinds, and how far each is explored. Scans are read from the folder
TOUCHATLAS_OBJECTS.
"""

import argparse
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import sharp_bodies
import vase_and_mug
from faces import body as body_of_planes

from touchatlas.sim import make_object
from touchatlas.sim.world.mesh_object import MeshObject

OBJECTS = Path(
    os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
)


@dataclass(frozen=True)
class Body:
    """A body of the guard: how it is made, its kind, and its tolerance.

    Parameters
    ----------
    kind : smooth, lawful, thin, scan or open
    make : Callable
        Gives the object.
    tolerance : float, optional
        As a fraction of the diagonal; the object's own where None.
    most : int
        Touches after which the exploration is cut short.
    long : bool
        Whether one seed is enough.
    """

    kind: str
    make: Callable
    tolerance: float | None = None
    most: int = 200
    long: bool = False

    def tolerance_of(self, obj) -> float:
        """The tolerance of the object that was made, length."""
        return obj.tolerance if self.tolerance is None else self.tolerance * obj.diagonal


def built_in(kind: str, name: str) -> Body:
    return Body(kind, lambda: make_object(name))


def of_mesh(kind: str, name: str, mesh: Callable, **options) -> Body:
    def make():
        body = mesh()
        body.merge_vertices()
        return MeshObject(name, body.vertices, body.faces)

    return Body(kind, make, **options)


def scan(kind: str, file: str, **options) -> Body:
    return Body(kind, lambda: make_object(str(OBJECTS / f"{file}.ply")), **options)


def bodies() -> dict[str, Body]:
    """The bodies by name, in the order of the table."""
    made = sharp_bodies.bodies
    found = {name: built_in("smooth", name) for name in ("sphere", "ellipsoid", "bottle", "mouse")}
    found |= {name: built_in("smooth", name) for name in ("blob", "torus")}
    found |= {name: built_in("lawful", name) for name in ("cube", "plate")}
    for name in ("step", "wall", "roof"):
        found[name] = Body("lawful", lambda name=name: body_of_planes(name))
    for name in ("fingers", "T-slot", "slot", "tube"):
        found[name] = of_mesh("lawful", name, lambda name=name: made()[name])
    found["wedge"] = of_mesh("thin", "wedge", lambda: made()["wedge"])
    found["disc"] = of_mesh("thin", "disc", lambda: made()["disc"], tolerance=2e-2)
    found["half ball"] = of_mesh("open", "half ball", lambda: made()["half_ball"])
    found["holed ball"] = of_mesh("open", "holed ball", lambda: made()["holed_ball"])
    found["vase"] = of_mesh("thin", "vase", vase_and_mug.vase, long=True)
    found["mug"] = of_mesh("thin", "mug", vase_and_mug.mug, long=True)
    for name, file in (("lemon", "lemon_ycb"), ("mustard", "mustard_ycb"), ("spot", "spot")):
        found[name] = scan("scan", file, tolerance=1e-2)
    found["hand"] = scan("scan", "hand_ode", tolerance=2e-2)
    found["goat's head"] = scan("scan", "goathead_ode", tolerance=1e-2, long=True)
    found["wing nut"] = scan("scan", "wingnut_ode", tolerance=1e-2)
    for most in (22, 54):
        found[f"featuretype {most}"] = scan("lawful", "featuretype", most=most, long=True)
    found["elbow"] = scan("lawful", "elbow_made", most=88, long=True)
    found["bracket"] = scan("lawful", "bracket_made", long=True)
    found["letters"] = scan("lawful", "text_made", long=True)
    return found


def check_names(parser: argparse.ArgumentParser, names: list[str], known) -> None:
    """End with one sentence and exit code 2 where one of the names is no known body."""
    if wrong := [name for name in names if name not in known]:
        parser.error(f"got {', '.join(wrong)}, which is no body; give some of {', '.join(known)}")


if __name__ == "__main__":
    for name, body in bodies().items():
        print(f"{name}: {body.kind}, at most {body.most} touches")

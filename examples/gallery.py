"""Explore twelve bodies, and keep a small picture of each for the gallery of the documentation.

    python examples/gallery.py [FOLDER] [BODY ...]

The runs stay in FOLDER (runs/gallery by default), each with its replay.html. The pictures go to
FOLDER/pictures, and the rows of docs/gallery.md are printed. It takes a quarter of an hour.
"""

import os
import sys
from pathlib import Path

from PIL import Image

from touchatlas.sim import RunOptions, make_object, run_exploration
from touchatlas.sim.command.outcome import exit_code

MESHES = Path(os.environ.get("TOUCHATLAS_OBJECTS", "../shared/objects"))
BODIES = (
    *("sphere", "ellipsoid", "torus", "bottle", "mouse", "blob", "plate", "cube"),
    *("lemon_ycb.ply", "elbow_made.ply", "bracket_made.ply", "torus_ode.ply"),
)


def main() -> None:
    """Explore each body, and print its row."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/gallery")
    names = sys.argv[2:] or BODIES
    (folder / "pictures").mkdir(parents=True, exist_ok=True)
    print("| | command | touches | seconds | error (95 %) over the tolerance | faces |")
    print("|---|---|---|---|---|---|")
    for name in names:
        obj = make_object(str(MESHES / name) if name.endswith(".ply") else name)
        most = RunOptions(max_touches=60)
        run = run_exploration(obj, folder / obj.name, most, force=True)
        picture, numbers = folder / "pictures" / f"{obj.name}.png", run.numbers
        small_picture(run.folder / "surface.png").save(picture, optimize=True)
        error = max(numbers["accuracy_p95"], numbers["completeness_p95"]) / numbers["tolerance"]
        print(
            f"| ![{obj.name}](gallery/{obj.name}.png) | `touchatlas explore {name}` | "
            f"{numbers['touches']} | {numbers['seconds_total']:.0f} | {error:.2f} | "
            f"{numbers['faces']} |",
            flush=True,
        )


def small_picture(path: Path) -> Image.Image:
    """The first two views of the surface of a surface.png, small."""
    image = Image.open(path).convert("RGB")
    width, height = image.size
    image = image.crop((int(0.02 * width), int(0.07 * height), int(0.43 * width), height // 2))
    return image.resize((320, int(320 * image.height / image.width))).quantize(128)


if __name__ == "__main__":
    sys.exit(exit_code(main))

"""touchatlas: learn the shape of an object by touch.

>>> import touchatlas as ta
>>> atlas = ta.Atlas(tolerance=0.1)
>>> atlas
<Atlas: 0 touches, 0 samples, tolerance 0.1>

``ta.explore("bottle")`` explores a simulated object and gives its ``Run``, ``ta.load_run(folder)``
reads one. With a probe of your own, ``Planner`` says where to touch and ``Atlas`` learns. More
names stand in ``touchatlas.patch``, ``touchatlas.atlas``, ``touchatlas.planner`` and
``touchatlas.sim``.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from touchatlas.atlas import Atlas, Surface, Touch, extract_surface, load_atlas, save_atlas
    from touchatlas.patch import Contour, SamplingPlane
    from touchatlas.planner import Planner, ProbePlan
    from touchatlas.sim import Run, RunOptions, explore, load_run, make_object

    __version__: str

__all__ = [
    "Atlas",
    "Contour",
    "Planner",
    "ProbePlan",
    "Run",
    "RunOptions",
    "SamplingPlane",
    "Surface",
    "Touch",
    "__version__",
    "explore",
    "extract_surface",
    "load_atlas",
    "load_run",
    "make_object",
    "save_atlas",
]
_STOREYS = ("patch", "atlas", "planner", "sim")


def __getattr__(name: str) -> Any:
    from importlib import import_module
    from importlib.metadata import version

    if name == "__version__":
        return version("touchatlas")
    if name in __all__:
        for storey in _STOREYS:
            package = import_module(f"touchatlas.{storey}")
            if name in package.__all__ and (name, storey) != ("explore", "planner"):
                return getattr(package, name)
    raise AttributeError(f"touchatlas has no {name!r}; the public names are {__all__}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

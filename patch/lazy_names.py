"""Names of a package that are imported when they are first used.

A command that only prints its help must not import scipy, trimesh or matplotlib.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(modules: Mapping[str, str]) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package whose public names stand in modules of it (PEP 562).

    Parameters
    ----------
    modules : mapping of str to str
        Of each public name: the full name of the module that defines it.

    Examples
    --------
    >>> lazy_names({"sqrt": "math"})("sqrt")(9.0)
    3.0
    """

    def find(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"there is no {name!r} here; the public names are {[*modules]}")
        return getattr(import_module(modules[name]), name)

    return find

"""Names of a package that are imported when they are first used.

A command that only prints its help must not import scipy, trimesh or matplotlib.
"""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(
    package: str, modules: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The ``__getattr__`` and ``__dir__`` of a package whose public names stand in modules of it
    (PEP 562).

    Parameters
    ----------
    package : str
        Its full name.
    modules : mapping of str to str
        Of each module below the package: the public names that it defines, with blanks between.

    Examples
    --------
    >>> find, names = lazy_names("concurrent", {"futures": "Future wait"})
    >>> find("wait").__name__, "Future" in names()
    ('wait', True)
    """
    home = {name: module for module, names in modules.items() for name in names.split()}

    def find(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"there is no {name!r} here; the public names are {[*home]}")
        return getattr(import_module(f"{package}.{home[name]}"), name)

    return find, lambda: sorted({*vars(sys.modules[package]), *home})

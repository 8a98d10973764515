"""What other packages add: planners, estimators, probes and objects, by Python's entry points.

A package names them in its pyproject.toml:

    [project.entry-points."touchatlas.planners"]
    lowest = "my_package:lowest"
"""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

PLANNERS, ESTIMATORS = "touchatlas.planners", "touchatlas.estimators"
PROBES, OBJECTS = "touchatlas.probes", "touchatlas.objects"


@cache
def added(group: str) -> dict[str, EntryPoint]:
    """Entry points of a group by name, of whatever is installed; the first of equal names counts.

    The packages of this Python are read once a process, in some hundredths of a second.
    """
    found: dict[str, EntryPoint] = {}
    for point in entry_points(group=group):
        found.setdefault(point.name, point)
    return dict(sorted(found.items()))


def load_added(group: str, name: str) -> Any:
    """What a package adds to a group under a name; None where there is none.

    Raises
    ------
    ValueError
        When its package cannot be imported.
    """
    point = added(group).get(name)
    if point is None:
        return None
    try:
        return point.load()
    except Exception as error:
        package = point.dist.name if point.dist else point.value
        raise ValueError(
            f"{name} of the package {package} cannot be imported ({type(error).__name__}: "
            f"{error}); see whether the package is whole"
        ) from error

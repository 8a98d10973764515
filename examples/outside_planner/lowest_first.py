"""A planner of another package: `pip install examples/outside_planner`, then `--planner lowest`."""

import numpy as np

from touchatlas.planner import target_at


def lowest(view, places):
    """Touches the lowest place that no touch was near."""
    points, _ = places.all
    height = np.where(view.is_free(points), points[:, 2], np.inf)
    return target_at(places, int(height.argmin())) if np.isfinite(height).any() else None

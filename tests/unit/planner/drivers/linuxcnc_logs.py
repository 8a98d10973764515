"""Logs of LinuxCNC before a ball about 0, line by line as PROBEOPEN writes them."""

import numpy as np

from touchatlas.planner.drivers.linuxcnc_files import star_of


def hit(measure, radius):
    """Where the way of a measure meets a ball of a radius about 0; None where it does not."""
    u = measure.direction
    along = -(measure.start @ u)
    square = radius**2 - measure.start @ measure.start + along**2
    length = np.linalg.norm(measure.target - measure.start)
    s = along - np.sqrt(square) if square > 0.0 else np.inf
    return measure.start + s * u if 0.0 < s < length else None


def log_of(plan, options, radius, late=0.0, lines=None):
    """What PROBEOPEN writes: a miss leaves a place too, a servo period short of the target."""
    rows, met = [], {}
    for measure in star_of(plan, options):
        arm = measure.plane, measure.side
        if not met.get(arm, met.get((-1, 0), True)):
            continue
        place = hit(measure, radius)
        met[arm] = place is not None
        rows.append(measure.start - 0.001)
        if place is None:
            rows.append(measure.target - 0.005 * measure.direction)
        else:
            rows.append(place + late * measure.direction)
            rows.append(place - 0.02 * measure.direction)
        rows.append(measure.start + 0.001)
    rows = [" ".join(f"{x:.6f}" for x in [*row, *[0.0] * 6]) for row in rows]
    return "\n".join(rows[:lines]) + "\n"

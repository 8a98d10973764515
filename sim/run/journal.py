"""Journal: every touch on disk before the next is planned."""

import sqlite3
from pathlib import Path

import numpy as np

from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import ProbePlan

_SCHEMA = """
create table touch (
    number integer primary key, reason text, status text, contact blob, approach blob,
    tracked_length real, travel_length real);
create table contour (
    touch integer, place integer, plane_point blob, plane_normal blob, noise_std real,
    first_end text, last_end text, points blob, primary key (touch, place));
"""


class Journal:
    """The touches of a run in an SQLite file; no times, so that equal runs give equal bytes."""

    def __init__(self, path) -> None:
        fresh = not Path(path).exists()
        self._database = sqlite3.connect(path)
        if fresh:
            self._database.executescript(_SCHEMA)

    def append(self, plan: ProbePlan, touch: Touch) -> None:
        """Write one touch and commit it."""
        with self._database as database:
            database.execute(
                "insert into touch values (?, ?, ?, ?, ?, ?, ?)",
                (
                    touch.number,
                    plan.reason.value,
                    touch.status.value,
                    touch.contact.tobytes(),
                    touch.approach.tobytes(),
                    touch.tracked_length,
                    touch.travel_length,
                ),
            )
            database.executemany(
                "insert into contour values (?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    (
                        touch.number,
                        place,
                        contour.plane.point.tobytes(),
                        contour.plane.normal.tobytes(),
                        contour.noise_std,
                        contour.ends[0].value,
                        contour.ends[1].value,
                        contour.points.tobytes(),
                    )
                    for place, contour in enumerate(touch.contours)
                ],
            )

    def touches(self) -> list[Touch]:
        """All touches, in order."""
        rows = self._database.execute(
            "select number, contact, approach, status, tracked_length, travel_length "
            "from touch order by number"
        ).fetchall()
        return [
            Touch(
                number,
                np.frombuffer(contact),
                np.frombuffer(approach),
                self._contours(number),
                TouchStatus(status),
                tracked,
                travel,
            )
            for number, contact, approach, status, tracked, travel in rows
        ]

    def _contours(self, number: int) -> tuple[Contour, ...]:
        rows = self._database.execute(
            "select plane_point, plane_normal, noise_std, first_end, last_end, points "
            "from contour where touch = ? order by place",
            (number,),
        )
        return tuple(
            Contour(
                np.frombuffer(points).reshape(-1, 3),
                SamplingPlane(np.frombuffer(point), np.frombuffer(normal)),
                noise,
                (ContourEnd(first), ContourEnd(last)),
            )
            for point, normal, noise, first, last, points in rows
        )

    def close(self) -> None:
        """Close the file."""
        self._database.close()

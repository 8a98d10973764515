"""Journal: every touch on disk before it is learned."""

import json
import sqlite3
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from touchatlas.atlas import Scan, Touch, TouchStatus
from touchatlas.atlas.files import check_path
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import ProbePlan

_SCHEMA = """
create table if not exists touch (
    number integer primary key, reason text, status text, contact blob, approach blob,
    tracked_length real, travel_length real, probe text);
create table if not exists contour (
    touch integer, place integer, plane_point blob, plane_normal blob, noise_std real,
    first_end text, last_end text, points blob, primary key (touch, place));
"""
# Apart, because journals of earlier versions lack them.
_SETTINGS = "create table if not exists setting (name text primary key, value text) without rowid;"
_SCANS = (
    "create table if not exists scan (place integer primary key, touches integer, points blob, "
    "noise blob, normals blob, approach blob, viewpoint blob, outside blob, curves blob);"
)
_WAYS = "create table if not exists way (touch integer primary key, ends blob);"
_NORMALS = (
    "create table if not exists normals (touch integer, place integer, normals blob, "
    "primary key (touch, place));"
)
_TIPS = (
    "create table if not exists tip (touch integer primary key, radius real, systematic_std real);"
)
_SCAN_TIPS = (
    "create table if not exists scan_tip "
    "(place integer primary key, radius real, systematic_std real);"
)
_SCAN_FIELDS = "points", "noise_std", "normals", "approach", "viewpoint", "outside"
# Errors that reading an altered journal raises.
_DAMAGE = (sqlite3.Error, ValueError, TypeError, AttributeError, OverflowError)


@dataclass(frozen=True, eq=False)
class Entry:
    """One touch of a journal.

    Parameters
    ----------
    reason : str
        Of its plan.
    touch : Touch
    probe : str
        State of the probe after the touch, as ``Probe.state``.
    """

    reason: str
    touch: Touch
    probe: str


class Journal:
    """The touches of a run in an SQLite file; no times, so that equal runs give equal bytes.

    Raises
    ------
    ValueError
        When the path is none, or holds something else than a journal.
    sqlite3.Error
        When another program has it locked, or the disk is full.
    """

    def __init__(self, path) -> None:
        check_path(path, "the journal.sqlite of a run")
        self._path = Path(path)
        if self._path.exists() and not self._path.is_file():
            raise ValueError(f"{path} is no file; give the journal.sqlite of a run")
        if not self._path.parent.is_dir():
            raise ValueError(f"{self._path.parent} is no folder; make it, or give another journal")
        self._database = sqlite3.connect(path)
        try:
            if not self._tables():
                # Who opens it at the same moment waits, and finds the tables made.
                self._database.executescript(f"begin immediate; {_SCHEMA} {_SETTINGS} commit;")
            self._database.execute("select probe from touch limit 0").fetchone()
            self._database.execute("select points from contour limit 0").fetchone()
        except (sqlite3.DatabaseError, ValueError) as error:
            self._database.close()
            if _is_no_damage(error):
                raise
            raise self._damaged(error) from None

    def _tables(self) -> list:
        """The names of what the file holds; none in a new one, or one killed at its first step."""
        return self._database.execute("select name from sqlite_master").fetchall()

    def settings(self) -> dict:
        """Names and values of the settings that the touches were made with; none in a journal
        that nobody told.

        Raises
        ------
        ValueError
            When the file was altered.
        """
        try:
            if ("setting",) not in self._tables():
                return {}
            rows = self._database.execute("select name, value from setting").fetchall()
            return {name: json.loads(value) for name, value in rows}
        except (*_DAMAGE, RecursionError) as error:
            if _is_no_damage(error):
                raise
            raise self._damaged(error) from None

    def keep_settings(self, settings: dict) -> None:
        """Keep the settings that the touches are made with: names, and numbers or words.

        Raises
        ------
        sqlite3.Error
            When they cannot be written.
        """
        if self.settings() == settings:
            return
        rows = [
            (name, json.dumps(value, default=lambda number: number.item()))
            for name, value in settings.items()
        ]
        with self._database as database:
            database.execute(_SETTINGS)
            database.execute("delete from setting")
            database.executemany("insert into setting values (?, ?)", rows)

    def append(self, plan: ProbePlan, touch: Touch, probe: str = "") -> None:
        """Write one touch, with the state of the probe after it, and commit it.

        Raises
        ------
        ValueError
            When the arguments are no plan and no touch, the touch answers another plan, or is not
            the next one.
        sqlite3.Error
            When it cannot be written. The touches before it are kept.
        """
        self._check_next(plan, touch)
        with self._database as database:
            database.execute(
                "insert into touch values (?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    touch.number,
                    plan.reason.value,
                    touch.status.value,
                    touch.contact.tobytes(),
                    touch.approach.tobytes(),
                    touch.tracked_length,
                    touch.travel_length,
                    probe,
                ),
            )
            if touch.way is not None:
                database.execute(_WAYS)
                way = (touch.number, touch.way.tobytes())
                database.execute("insert into way values (?, ?)", way)
            if touch.tip_radius or touch.systematic_std:
                database.execute(_TIPS)
                tip = (touch.number, touch.tip_radius, touch.systematic_std)
                database.execute("insert into tip values (?, ?, ?)", tip)
            if measured := _normal_rows(touch):
                database.execute(_NORMALS)
                database.executemany("insert into normals values (?, ?, ?)", measured)
            database.executemany(
                "insert into contour values (?, ?, ?, ?, ?, ?, ?, ?)", _contour_rows(touch)
            )

    def append_scan(self, scan: Scan) -> None:
        """Write one scan, learned after the touches that the journal holds, and commit it.

        Raises
        ------
        ValueError
            When it is no scan.
        sqlite3.Error
            When it cannot be written.
        """
        if not isinstance(scan, Scan):
            raise ValueError(f"got {type(scan).__name__}; give a Scan")
        fields = [getattr(scan, name) for name in _SCAN_FIELDS]
        curves = None if scan.curves is None else scan.curves.astype("<i8").tobytes()
        blobs = [None if values is None else values.tobytes() for values in fields]
        with self._database as database:
            database.execute(_SCANS)
            database.execute(
                "insert into scan (touches, points, noise, normals, approach, viewpoint, outside, "
                "curves) values (?, ?, ?, ?, ?, ?, ?, ?)",
                (len(self), *blobs, curves),
            )
            if scan.tip_radius or scan.systematic_std:
                database.execute(_SCAN_TIPS)
                [place] = database.execute("select max(place) from scan").fetchone()
                tip = (place, scan.tip_radius, scan.systematic_std)
                database.execute("insert into scan_tip values (?, ?, ?)", tip)

    def scans(self) -> list[tuple[int, Scan]]:
        """All scans, in order, each after the number of touches that were learned before it.

        Raises
        ------
        ValueError
            When the file was altered.
        """
        try:
            if ("scan",) not in self._tables():
                return []
            rows = self._database.execute(
                "select place, touches, points, noise, normals, approach, viewpoint, outside, "
                "curves from scan order by place"
            ).fetchall()
            tips = self._tips("scan_tip", "place")
            return [(row[1], _scan_of(row[2:], tips.get(row[0], (0.0, 0.0)))) for row in rows]
        except _DAMAGE as error:
            if _is_no_damage(error):
                raise
            raise self._damaged(error) from None

    def _check_next(self, plan: ProbePlan, touch: Touch) -> None:
        """ValueError for what is no plan and the touch that answers it, or not the next one."""
        if not (isinstance(plan, ProbePlan) and isinstance(touch, Touch)):
            got = f"{type(plan).__name__} and {type(touch).__name__}"
            raise ValueError(f"got {got}; give a ProbePlan and the Touch that answers it")
        if plan.number != touch.number:
            raise ValueError(
                f"touch {touch.number} does not answer plan {plan.number}; give the ProbePlan of "
                "its number"
            )
        if touch.number != (count := len(self)):
            raise ValueError(
                f"touch {touch.number} is not the next one of {self._path}, which holds {count}; "
                f"repeat those and go on with number {count}, or begin another journal"
            )

    def __len__(self) -> int:
        return self._database.execute("select count(*) from touch").fetchone()[0]

    def touches(self) -> list[Touch]:
        """All touches, in order."""
        return [entry.touch for entry in self.entries()]

    def entries(self) -> list[Entry]:
        """All entries, in order.

        Raises
        ------
        ValueError
            When the file was altered, or lacks a touch.
        """
        try:
            # Numbers that were altered may be too large for their squares.
            with np.errstate(all="ignore"):
                return self._entries()
        except _DAMAGE as error:
            if _is_no_damage(error):
                raise
            raise self._damaged(error) from None

    def _entries(self) -> list[Entry]:
        rows = self._database.execute(
            "select number, reason, contact, approach, status, tracked_length, travel_length, "
            "probe from touch order by number"
        ).fetchall()
        if [row[0] for row in rows] != list(range(len(rows))):
            raise ValueError("a touch is missing")
        ways, tips, normals = self._ways(), self._tips("tip", "touch"), self._normals()
        numbers = {row[0] for row in rows}
        if not ways.keys() | tips.keys() | {touch for touch, _ in normals} <= numbers:
            raise ValueError("a way, a tip or normals are of no touch")
        return [
            Entry(
                reason,
                Touch(
                    number,
                    np.frombuffer(contact),
                    np.frombuffer(approach),
                    self._contours(number, normals),
                    TouchStatus(status),
                    tracked,
                    travel,
                    ways.get(number),
                    *tips.get(number, (0.0, 0.0)),
                ),
                str(probe),
            )
            for number, reason, contact, approach, status, tracked, travel, probe in rows
        ]

    def _ways(self) -> dict[int, np.ndarray]:
        """The ways on which the probe came, by the numbers of their touches."""
        if ("way",) not in self._tables():
            return {}
        rows = self._database.execute("select touch, ends from way").fetchall()
        return {number: np.frombuffer(ends).reshape(2, 3) for number, ends in rows}

    def _tips(self, table: str, key: str) -> dict[int, tuple[float, float]]:
        """Radius and systematic deviation of the tip, by the numbers of touches, or the places of
        scans."""
        if (table,) not in self._tables():
            return {}
        rows = self._database.execute(f"select {key}, radius, systematic_std from {table}")
        return {number: (radius, std) for number, radius, std in rows}

    def _normals(self) -> dict[tuple[int, int], np.ndarray]:
        """The measured normals of contours, by the numbers of touches and the places in them."""
        if ("normals",) not in self._tables():
            return {}
        rows = self._database.execute("select touch, place, normals from normals").fetchall()
        return {(touch, place): np.frombuffer(x).reshape(-1, 3) for touch, place, x in rows}

    def _contours(self, number: int, normals) -> tuple[Contour, ...]:
        """The contours of a touch, with their normals of a dictionary of those of all touches."""
        rows = self._database.execute(
            "select place, plane_point, plane_normal, noise_std, first_end, last_end, points "
            "from contour where touch = ? order by place",
            (number,),
        )
        return tuple(
            Contour(
                np.frombuffer(points).reshape(-1, 3),
                SamplingPlane(np.frombuffer(point), np.frombuffer(normal)),
                noise,
                (ContourEnd(first), ContourEnd(last)),
                normals.get((number, place)),
            )
            for place, point, normal, noise, first, last, points in rows
        )

    def _damaged(self, error: Exception) -> ValueError:
        words = " ".join(str(error).split())[:200]
        return ValueError(
            f"{self._path} is no whole journal of a run ({words}); give another copy, or explore "
            "again"
        )

    def close(self) -> None:
        """Close the file."""
        self._database.close()


def _scan_of(blobs, tip: tuple[float, float]) -> Scan:
    """The scan of a row, with the radius and systematic deviation of its tip."""
    arrays = [None if blob is None else np.frombuffer(blob) for blob in blobs[:-1]]
    vectors = [None if x is None or k == 1 else x.reshape(-1, 3) for k, x in enumerate(arrays)]
    points, noise, (normals, approach) = vectors[0], arrays[1], vectors[2:4]
    if points is None or noise is None:
        raise ValueError("a scan has no points")
    numbers = None if blobs[-1] is None else np.frombuffer(blobs[-1], "<i8")
    return Scan(points, noise, normals, approach, arrays[4], arrays[5], numbers, *tip)


def _contour_rows(touch: Touch) -> list[tuple]:
    """The rows of the contours of a touch."""
    return [
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
    ]


def _normal_rows(touch: Touch) -> list[tuple]:
    """The rows of the measured normals of the contours of a touch."""
    return [
        (touch.number, place, contour.normals.tobytes())
        for place, contour in enumerate(touch.contours)
        if contour.normals is not None
    ]


def _is_no_damage(error: Exception) -> bool:
    """Whether a full disk, a lock or a closed file is the cause, whatever the file holds."""
    words = ("locked", "disk I/O", "full", "unable", "readonly")
    of_disk = isinstance(error, sqlite3.OperationalError) and any(w in str(error) for w in words)
    return of_disk or isinstance(error, sqlite3.ProgrammingError)

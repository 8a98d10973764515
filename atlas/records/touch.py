"""Touch: everything that one visit of the probe measured; AtlasChange: what an atlas made of it."""

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from touchatlas.patch.geometry.arrays import check_length, check_unit, frozen_array
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.order import disorder, out_of_order
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.patch.words import count_of

# Largest distance of a contour from the contact, as a fraction of the longest contour's length:
# half an arm. Doubled, contours of a neighbouring place pass.
_ASTRAY = 0.25
# Largest distance of a contour from the contact in standard deviations of its noise, if that is
# more. Doubled, only very noisy contours are concerned.
_NOISE = 10.0

# Least cosine of a way and the approach: 10 degrees; largest distance of the contact beside it, and
# error of its end by rounding, over its length. With the first two doubled, ways of other frames
# pass; with the third, nothing else does.
_STRAIGHT, _BESIDE, _ROUNDING = 0.985, 0.2, 1e-6


class TouchStatus(Enum):
    """How a probe plan ended."""

    TOUCHED = "touched"
    NO_CONTACT = "no contact"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True, eq=False)
class Touch:
    """The contours tracked around one point of contact.

    Parameters
    ----------
    number : int
        Number of the ProbePlan that was carried out.
    contact : (3,) float, length, world
        Where the probe met the surface, as measured: on or near every contour. The planned
        reference point if it met none.
    approach : (3,) float, unit, world
        Direction from the surface to where the probe came from. It points outward.
    contours : tuple of Contour
        One or more where ``status`` is TOUCHED, however short; none where it is another.
    status : TouchStatus
    tracked_length, travel_length : float, length
        Length of the path in contact, and of the path in the air to get there.
    way : (2, 3) float, length, world, optional
        Where the straight way through air began on which the probe came, and where it ended: at
        the contact, or, without one, past the planned reference point, where it gave up. The
        atlas learns that no surface is on it. None where it is not known, or was not gone.
        It is the way of the tip's centre. Contours with normals hold contacts, above which it ends.
    tip_radius : float, length
        0 where all points are contacts. Above 0 they are centres of a ball of this radius at the
        tip: the points of the contours, the contact, and the way. All touches of an atlas have the
        same one.
    systematic_std : float, length
        Standard deviation of the error that all points of all touches share along the normals of
        the surface: that of the tip's radius, of the stiffness of the probe. It joins the deviation
        of the surface, because touches do not average it out. An atlas takes the largest.
    """

    number: int
    contact: np.ndarray
    approach: np.ndarray
    contours: tuple[Contour, ...]
    status: TouchStatus
    tracked_length: float
    travel_length: float
    way: np.ndarray | None = None
    tip_radius: float = 0.0
    systematic_std: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "contact", frozen_array(self.contact, (3,), "contact"))
        object.__setattr__(self, "approach", check_unit(self.approach, "approach"))
        whole = isinstance(self.number, int | np.integer) and not isinstance(self.number, bool)
        if not (whole and self.number >= 0):
            raise ValueError(
                f"number is {self.number!r}; it must be that of a ProbePlan, 0 or more"
            )
        if not isinstance(self.status, TouchStatus):
            raise ValueError(f"status is {self.status!r}; it must be a TouchStatus")
        for name in ("tracked_length", "travel_length", "tip_radius", "systematic_std"):
            check_length(getattr(self, name), name)
        if not (
            isinstance(self.contours, tuple | list)
            and all(isinstance(contour, Contour) for contour in self.contours)
        ):
            raise ValueError(
                f"contours are of type {type(self.contours).__name__}, or not all Contours; they "
                "must be a tuple of Contour"
            )
        object.__setattr__(self, "contours", tuple(self.contours))
        self._check_status()
        if self.way is not None:
            object.__setattr__(self, "way", frozen_array(self.way, (2, 3), "way"))
            self._check_way()
        self._check_contact()
        self._check_order()

    def __repr__(self) -> str:
        """One line."""
        x, y, z = self.contact
        points = sum(len(contour.points) for contour in self.contours)
        words = f"{self.status.value} at ({x:.4g}, {y:.4g}, {z:.4g})"
        held = f"{count_of(len(self.contours), 'contour')}, {count_of(points, 'point')}"
        return f"<Touch {self.number}: {words}, {held}>"

    def _check_status(self) -> None:
        """Refuse a contact without contours, and contours without a contact."""
        if self.status is TouchStatus.TOUCHED and not self.contours:
            raise ValueError(
                f"touch {self.number} has status TOUCHED, but no contours; give those that were "
                "tracked, or status NO_CONTACT or UNREACHABLE"
            )
        if self.status is not TouchStatus.TOUCHED and self.contours:
            raise ValueError(
                f"touch {self.number} has status {self.status.name}, but {len(self.contours)} "
                "contours; give status TOUCHED, or no contours"
            )

    def _check_way(self) -> None:
        """Refuse a way that the probe cannot have come."""
        assert self.way is not None
        if wrong := self._wrong_way(*self.way):
            raise ValueError(
                f"the way of touch {self.number} from {self.way[0]} to {self.way[1]} {wrong}; give "
                "where the probe began and the contact, or, without contact, where it gave up, in "
                "the frame and unit of the contact, or leave the way out"
            )

    def _wrong_way(self, first, last) -> str:
        """What is wrong with a way, its ends being (3,); empty where nothing is."""
        if self.status is TouchStatus.UNREACHABLE:
            return "was not gone, because the place is unreachable"
        with np.errstate(over="ignore", invalid="ignore"):
            length = float(np.linalg.norm(first - last))
            along = float((first - last) @ self.approach)
            above, below = (float((end - self.contact) @ self.approach) for end in (first, last))
            beside = float(np.linalg.norm(first - self.contact - above * self.approach))
        noise = _NOISE * max((contour.noise_std for contour in self.contours), default=0.0)
        off = max(_ROUNDING * length, noise)
        if not 0.0 < length < np.inf:
            return "has no length, or too large a one"
        if along < _STRAIGHT * length:
            return "does not run against the approach"
        if beside > max(_BESIDE * length, noise):
            return f"passes {beside:.4g} beside the contact, more than the noise explains"
        # A ball that touches the contact has its centre above it.
        above_is_right = any(contour.normals is not None for contour in self.contours)
        if self.contours and (below < -off or (below > off and not above_is_right)):
            return f"ends {abs(below):.4g} from the contact"
        passes = above >= -off and (below <= off or above_is_right)
        return "" if passes else "does not pass the reference point"

    def _check_contact(self) -> None:
        """Refuse contours that do not run through the contact."""
        long = [contour for contour in self.contours if len(contour.points) >= LEAST_POINTS]
        length = max((extent_of(contour.points) for contour in long), default=0.0)
        for contour in long:
            away = float(np.sqrt(((contour.points - self.contact) ** 2).sum(axis=1).min()))
            if away > max(_ASTRAY * length, _NOISE * contour.noise_std):
                raise ValueError(
                    f"a contour passes {away:.4g} away from the contact, but the longest is only "
                    f"{length:.4g} long; give the contact that they were tracked through, in the "
                    "same frame and unit"
                )

    def _check_order(self) -> None:
        """Refuse contours whose points are shuffled."""
        for place, contour in enumerate(self.contours):
            # Of contours no longer than their noise, the order tells nothing.
            long = extent_of(contour.points) > 2.0 * _NOISE * contour.noise_std
            if len(contour.points) >= LEAST_POINTS and long and out_of_order(contour.points):
                raise ValueError(
                    f"contour {place} of touch {self.number} {disorder(contour.points)}"
                )


def extent_of(points) -> float:
    """Twice the largest distance of points (n, 3) from their mean."""
    offset = points - points.mean(axis=0)
    return 2.0 * float(np.sqrt((offset * offset).sum(axis=1).max()))


@dataclass(frozen=True)
class AtlasChange:
    """What an atlas made of a touch.

    Parameters
    ----------
    refused : str
        Why no samples were entered; empty where some were. The way of an approach that met nothing
        is entered all the same.
    touch : int, optional
        Number of the touch that ``Atlas.add`` learned.
    innovations : (k, 6) float
        What its samples showed of the surface that was predicted before them: see
        ``innovations_of``.
    hidden : bool
        Whether it was refused because noise hides the shape of contours that have points enough:
        longer ones will show it.
    """

    refused: str = ""
    touch: int | None = None
    innovations: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 6)), compare=False, repr=False
    )
    hidden: bool = False

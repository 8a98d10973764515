"""Regions: atlases of many touches, learned region by region, and one atlas of all of them.

What a touch costs grows with all that are known, so that twice as many touches cost four times as
much. Regions of a bounded number of touches are learned apart, each with the touches around it, and
joined: samples and labels are put together, and faces of two regions become one where that is the
shorter description. The body that follows is one, so that it has no seams.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.body.choose import body_of_parts
from touchatlas.atlas.body.read_faces import samples_of
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.records.options import AtlasOptions
from touchatlas.atlas.records.touch import Touch
from touchatlas.atlas.samples.crossings import NO_CROSSINGS, Crossings
from touchatlas.atlas.samples.lost_ends import LostEnds
from touchatlas.atlas.samples.sample_pool import NAMES
from touchatlas.atlas.store import load_labels, save_atlas
from touchatlas.patch.geometry.arrays import check_length


@dataclass(frozen=True, eq=False)
class Region:
    """Touches that are learned together.

    Parameters
    ----------
    own : (n,) int
        Places of its own touches, ascending. Each touch is one region's own.
    around : (m,) int
        Places of the touches of others next to them, ascending.
    """

    own: np.ndarray
    around: np.ndarray


def regions_of(touches: Sequence[Touch], most: int, overlap: float | None = None) -> list[Region]:
    """Regions of at most so many touches: leaves of a k-d tree (Bentley 1975) of the contacts.

    Parameters
    ----------
    touches : sequence of Touch
    most : int
        Most touches that are a region's own.
    overlap : float, length, optional
        How far around the box of its own contacts a region takes others' touches. The median reach
        of a touch, if it is not given.

    Examples
    --------
    >>> from touchatlas.atlas import TouchStatus
    >>> way = np.zeros(3), np.array([0.0, 0.0, 1.0])
    >>> touch = Touch(0, *way, (), TouchStatus.NO_CONTACT, 0.0, 1.0)
    >>> far = replace(touch, number=1, contact=np.array([9.0, 0.0, 0.0]))
    >>> [region.own.tolist() for region in regions_of([far, touch], 1)]
    [[1], [0]]
    """
    if not most >= 1:
        raise ValueError(f"most is {most}; a region has one touch or more")
    check_length(overlap or 0.0, "overlap")
    contacts = np.array([touch.contact for touch in touches]).reshape(-1, 3)
    if overlap is None:
        overlap = float(np.median([_reach(touch) for touch in touches if touch.contours] or [0.0]))
    found = []
    for own in _leaves(contacts, np.arange(len(contacts)), most):
        low, high = contacts[own].min(axis=0) - overlap, contacts[own].max(axis=0) + overlap
        near = ((contacts >= low) & (contacts <= high)).all(axis=1)
        found.append(Region(own, np.setdiff1d(np.flatnonzero(near), own)))
    return found


def _reach(touch: Touch) -> float:
    """Largest distance of a sample from the contact, length."""
    points = np.concatenate([contour.points for contour in touch.contours])
    return float(np.linalg.norm(points - touch.contact, axis=1).max())


def _leaves(contacts, some, most: int) -> list[np.ndarray]:
    """Places (n,) of contacts, halved across their longest side until no part is too large."""
    if len(some) <= most:
        return [np.sort(some)] if len(some) else []
    across = contacts[some, np.ptp(contacts[some], axis=0).argmax()]
    order, half = some[np.argsort(across, kind="stable")], len(some) // 2
    return _leaves(contacts, order[:half], most) + _leaves(contacts, order[half:], most)


@dataclass(frozen=True, eq=False)
class Part:
    """What the touches of a region taught.

    Parameters
    ----------
    atlas : Atlas
        The samples, ends, ways and evidence of its own touches.
    pieces : list of Piece
    of : (n,) int
        Number of the piece of each sample, -1 where there is none.
    is_one_face : bool
        Whether one face was the shortest description.
    """

    atlas: Atlas
    pieces: list[Piece]
    of: np.ndarray
    is_one_face: bool


def learn_region(
    touches: Sequence[Touch],
    region: Region,
    tolerance: float,
    options: AtlasOptions = AtlasOptions(),
    scale: float | None = None,
) -> tuple[Part, list[str]]:
    """What a region's own touches teach beside those around, and why some of them taught nothing.

    What the others taught is left out at last, but for labels and laws, which they helped to find.
    The arguments are those of ``Atlas``.
    """
    atlas, own = Atlas(tolerance, options, scale), set(region.own.tolist())
    spans, refused = [], []
    for place in np.sort(np.concatenate([region.own, region.around])).tolist():
        before = _counts(atlas)
        change = atlas.add(touches[place])
        if place in own:
            spans.append((before, _counts(atlas)))
            refused += [f"touch {change.touch}: {change.refused}"] if change.refused else []
    if not atlas.known_body.is_one_face:
        atlas.finish()
    numbers = {touches[place].number for place in own}
    return _part_of(atlas, spans, numbers), refused


def _counts(atlas: Atlas) -> tuple[int, int, int, int]:
    """Numbers of samples, lost ends, ways and bad contacts."""
    return len(atlas.pool), len(atlas.rims.ends), len(atlas.ways), len(atlas.bad_contacts)


def _part_of(atlas: Atlas, spans, numbers: set[int]) -> Part:
    """The part of an atlas that touches with some numbers taught: counts before and after each."""
    part = Atlas(atlas.tolerance, atlas.options, atlas.scale)
    part.touches, part.systematic_std = len(spans), atlas.systematic_std
    part.pool.tip_radius = atlas.tip_radius
    some, ends, ways, bad = (
        np.concatenate([np.zeros(0, int), *(np.arange(a[k], b[k]) for a, b in spans)])
        for k in range(4)
    )
    for name in LostEnds.NAMES:
        setattr(part.rims.ends, name, getattr(atlas.rims.ends, name)[ends])
    columns = {name: getattr(atlas.pool, name)[some] for name in NAMES}
    columns["contours"] = np.unique(columns["contours"], return_inverse=True)[1]
    part.pool.add(*columns.values())
    part.ways, part.bad_contacts = atlas.ways[ways], atlas.bad_contacts[bad]
    part.innovations = atlas.innovations[atlas.innovations[:, 0] >= atlas.settled]
    part.innovations[:, 0] = np.searchsorted(some, part.innovations[:, 0])
    kept = tuple(one for one in atlas.evidence.touches if int(one.number) in numbers)
    found = atlas.evidence.crossings
    own = np.isin(found.table[:, :2], sorted(numbers)).all(axis=1)
    crossings = Crossings.of_table(found.table[own])
    part.evidence = replace(atlas.evidence, touches=kept, crossings=crossings)
    known = atlas.known_body
    faces = known.faces
    if known.body is not None and known.is_one_face:
        faces = known.body.faces if known.body.faces.are_lawful else None
    # Of faces a file keeps pieces and labels alone.
    kept_faces = None if faces is None else replace(faces, patch_of=faces.patch_of[some])
    count = len(some)
    part.known_body = replace(known, count=count, looked=count, faces=kept_faces)
    if kept_faces is None:
        return Part(part, [], np.full(count, NONE), known.is_one_face)
    return Part(part, kept_faces.pieces, kept_faces.patch_of, known.is_one_face)


def save_part(path, part: Part) -> None:
    """Write a part to a file: an atlas of its own touches."""
    save_atlas(path, part.atlas)


def load_part(path) -> Part:
    """Read what ``save_part`` wrote."""
    return Part(*load_labels(path))


def joined(parts: Sequence[Part]) -> Atlas:
    """One atlas of the parts of all regions: it may be saved, asked and added to as any other.

    Raises
    ------
    ValueError
        When no part has a sample.
    """
    shown = [part for part in parts if len(part.atlas.pool)]
    if not shown:
        raise ValueError("no region has a sample; see why its touches were refused")
    # Without samples a part has no scale of its own.
    every, first = [part.atlas for part in parts], shown[0].atlas
    atlas = Atlas(first.tolerance, first.options, first.scale)
    atlas.touches = sum(part.touches for part in every)
    atlas.pool.tip_radius = first.tip_radius
    atlas.systematic_std = max(part.systematic_std for part in every)
    atlas.ways = np.concatenate([part.ways for part in every])
    atlas.bad_contacts = np.concatenate([part.bad_contacts for part in every])
    ends = atlas.rims.ends
    for part in every:
        columns = {name: getattr(part.rims.ends, name) for name in LostEnds.NAMES}
        # Ends of one touch have one number, and no other touch has it.
        columns["touches"] = columns["touches"] + ends.touches.max(initial=-1) + 1
        for name, column in columns.items():
            setattr(ends, name, np.concatenate([getattr(ends, name), column]))
        # The law of errors is that of the last touches of all regions.
        news = part.innovations + np.eye(1, 6) * len(atlas.pool)
        atlas.innovations = np.concatenate([atlas.innovations, news])
        if len(part.pool):
            atlas.pool.add(*(getattr(part.pool, name) for name in NAMES))
    touches = [one for part in every for one in part.evidence.touches]
    touches.sort(key=lambda one: one.number)
    crossings = sum((part.evidence.crossings for part in every), NO_CROSSINGS)
    atlas.evidence = replace(first.evidence, touches=tuple(touches), crossings=crossings)
    samples = samples_of(atlas.pool, len(atlas.pool), atlas.sample_std, atlas.levels)
    atlas.know(body_of_parts(samples, [(p.pieces, p.of, p.is_one_face) for p in shown]))
    atlas.settled = 0
    atlas.forget_law()
    return atlas

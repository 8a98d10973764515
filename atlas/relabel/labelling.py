"""Labelling: from samples to pieces and the piece of each sample."""

import numpy as np

from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.labels.grow import Evidence, growths, planes_from
from touchatlas.atlas.labels.labels import Labels
from touchatlas.atlas.labels.recall import Recall
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.labels.scan_lines import pairs_of_runs
from touchatlas.atlas.labels.tried import Tried
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.relabel.join_parts import join_parts
from touchatlas.atlas.relabel.moves import (
    drop,
    find_roundings,
    give_to_roundings,
    grow,
    join,
    refit,
    split,
)

# Samples from which a plane begins to grow.
_APART = 3 * Kind.PLANE.parameters + 5


def label_samples(samples: ContourSamples) -> Labels:
    """Pieces that explain samples, and the piece of each sample, or NONE.

    Growths from seeds are chosen greedily by description length; then labels, pieces, and their
    number are revised until nothing becomes shorter. Nothing is random: equal samples give equal
    labels.
    """
    labels = first_labels(samples)
    revise_all(labels)
    return labels


def first_labels(
    samples: ContourSamples, before: Faces | None = None, most: Kind = Kind.QUARTIC
) -> Labels:
    """Labels by growths from the seeds of samples, of kinds up to the one of ``most`` parameters,
    and from straight runs of what these leave. Fits that were computed for faces ``before`` of the
    first of the samples are taken from there; the result is the same."""
    labels = Labels(_evidence(samples, before))
    best, left = np.full(len(samples), -np.inf), np.ones(len(samples), bool)
    found = growths(labels.evidence, seeds_of(samples), left, most)
    for growth in found:
        left[growth.members] = False
    found += planes_from(labels.evidence, pairs_of_runs(samples, left), left)
    for growth in found:
        better = growth.saved > best[growth.members]
        best[growth.members[better]] = growth.saved[better]
        labels.add(growth.piece, growth.members[better])
    return labels


def seeds_of(samples: ContourSamples) -> np.ndarray:
    """(k,) the middle of the first contour of each touch, which is near the contact. A contour that
    was tracked alone runs over any number of faces: its seeds are as far apart as a plane needs
    samples to grow, and so are those of points of no curve."""
    first = np.flatnonzero(np.diff(samples.touches, prepend=-1))
    ends = np.append(first[1:], len(samples))
    last = np.searchsorted(samples.contours, samples.contours[first], side="right")
    found = [
        np.arange(a + (min(c - a, _APART) // 2), c, _APART) if b == c else np.array([(a + b) // 2])
        for a, b, c in zip(first.tolist(), last.tolist(), ends.tolist(), strict=True)
    ]
    seeds = np.concatenate(found)
    loose = ~samples.planes[seeds].any(axis=1)
    return np.sort(np.append(seeds[~loose], seeds[loose][::_APART]))


def relabel(samples: ContourSamples, before: Faces) -> Labels:
    """Labels of samples, of the first of which the faces ``before`` were read: only what the new
    ones touch is revised."""
    labels = Labels(_evidence(samples, before))
    labels.resume(before.pieces, before.patch_of)
    if len(before.rounded):
        find_roundings(labels)
    revise_all(labels)
    return labels


def _evidence(samples: ContourSamples, before: Faces | None) -> Evidence:
    """Samples with what is known of the first of them by the faces ``before``."""
    if before is None or before.links is None or not before.links.is_of_first(samples):
        return Evidence(samples, SampleGraph(samples))
    return Evidence(samples, SampleGraph(samples, before.links), Recall(before.recall))


def revise_all(labels: Labels) -> None:
    """Revise labels and pieces until no move makes the description shorter, or the rounds are
    over."""
    for _ in range(labels.evidence.options.rounds):
        revise(labels)
        before = Tried(labels.of.copy(), labels.pairs())
        changes = [move(labels) for move in (drop, join, split, grow)]
        labels.moved = before
        if not any(changes):
            given = give_to_roundings(labels)
            if not given + find_roundings(labels):
                break
    revise(labels)


def revise(labels: Labels) -> None:
    """Label samples, and fit pieces, again; parts of one law are one face."""
    labels.relax()
    labels.separate()
    refit(labels)
    join_parts(labels)
    labels.drop_empty()

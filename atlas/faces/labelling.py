"""Labelling: from samples to pieces and the piece of each sample."""

import numpy as np

from touchatlas.atlas.faces.cover import greedy_cover, propose, seeds_of
from touchatlas.atlas.faces.crossed_links import cut_crossed_links
from touchatlas.atlas.faces.grow import Evidence
from touchatlas.atlas.faces.labels import Labels
from touchatlas.atlas.faces.merge import merge
from touchatlas.atlas.faces.options import FaceOptions
from touchatlas.atlas.faces.revise import add, drop, refit
from touchatlas.atlas.faces.sample_graph import SampleGraph
from touchatlas.atlas.faces.samples import ContourSamples
from touchatlas.atlas.faces.split import split


def label_samples(samples: ContourSamples, options: FaceOptions = FaceOptions()) -> Labels:
    """Pieces that explain samples, and the piece of each sample, or NONE.

    Growths from seeds are chosen greedily by description length; then labels, pieces, and their
    number are revised until nothing becomes shorter. Nothing is random: equal samples give equal
    labels.

    Parameters
    ----------
    samples : ContourSamples
    options : FaceOptions
    """
    labels = first_labels(samples, options)
    revise_all(labels)
    return labels


def first_labels(samples: ContourSamples, options: FaceOptions = FaceOptions()) -> Labels:
    """Labels by growths from seeds, which are chosen greedily; see ``label_samples``."""
    evidence = Evidence(samples, SampleGraph(samples), options)
    labels = Labels(evidence)
    proposals = propose(evidence, seeds_of(evidence))
    best = np.full(len(samples), -np.inf)
    for growth in greedy_cover(evidence, proposals, len(samples)):
        better = growth.saved > best[growth.members]
        best[growth.members[better]] = growth.saved[better]
        labels.add(growth.piece, growth.members[better])
    return labels


def relabel(
    samples: ContourSamples, pieces, of, rounded=(), options: FaceOptions = FaceOptions()
) -> Labels:
    """Labels of samples, of which the first were labelled before: only what the new ones touch is
    revised.

    Parameters
    ----------
    samples : ContourSamples
    pieces : list of Piece
    of : (m,) int
        The piece of each of the first samples, or NONE.
    rounded : (k,) int
        Those of them that the rounding of an edge explained.
    options : FaceOptions
    """
    labels = Labels(Evidence(samples, SampleGraph(samples), options))
    labels.resume(pieces, of, rounded)
    revise_all(labels)
    return labels


def revise_all(labels: Labels) -> None:
    """Revise labels and pieces until nothing changes, or the rounds are over."""
    rounds = labels.evidence.options.rounds
    tried: list[np.ndarray] = []
    for number in range(rounds):
        cut_crossed_links(labels)
        labels.relax()
        labels.separate()
        changes = drop(labels)
        labels.separate()
        refit(labels)
        changes += merge(labels)
        if number < rounds - 1:
            changes += split(labels, tried)
            labels.relax()
        labels.separate()
        refit(labels)
        changes += add(labels)
        if not changes:
            break
    for _ in range(2):
        cut_crossed_links(labels)
        labels.relax()
        labels.separate()
        refit(labels)
        merge(labels)
        split(labels, tried)
    labels.relax()
    drop(labels)
    labels.relax()
    labels.separate()
    refit(labels)

"""Labelling: from samples to pieces and the piece of each sample."""

from collections.abc import Callable
from functools import partial

import numpy as np

from touchatlas.atlas.edges.blunt_edges import Rounding
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import Labels
from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.recall import Recall
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.relabel.cover import greedy_cover, propose, seeds_of
from touchatlas.atlas.relabel.crossed_links import cut_crossed_links
from touchatlas.atlas.relabel.merge import merge
from touchatlas.atlas.relabel.revise import add, drop, refit
from touchatlas.atlas.relabel.split import split

Step = Callable[[Labels], int | None]


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


def relabel(samples: ContourSamples, before: Faces, options: FaceOptions = FaceOptions()) -> Labels:
    """Labels of samples, of the first of which the faces ``before`` were read with these options:
    only what the new ones touch is revised."""
    graph = SampleGraph(samples, before.links)
    recall = Recall(before.recall if graph.goes_on else None)
    labels = Labels(Evidence(samples, graph, options, recall))
    labels.resume(before.pieces, before.patch_of, before.rounded)
    if len(before.rounded):
        # New samples on a known rounding are explained.
        for edge in Rounding(labels).edges:
            labels.rounded[edge.samples] = True
    revise_all(labels)
    return labels


def revise_all(labels: Labels) -> None:
    """Revise labels and pieces until nothing changes, or the rounds are over."""
    rounds = labels.evidence.options.rounds
    apart = partial(split, tried=[])
    do = partial(_do, labels, {})
    for number in range(rounds):
        do(cut_crossed_links, Labels.relax, Labels.separate)
        changes = do(drop, Labels.separate, refit, merge)
        if number < rounds - 1:
            changes += do(apart, Labels.relax)
        do(Labels.separate, refit)
        changes += add(labels)
        if not changes:
            break
    for _ in range(2):
        do(cut_crossed_links, Labels.relax, Labels.separate, refit, merge, apart)
    do(Labels.relax, drop, Labels.relax, Labels.separate, refit)


def _do(labels: Labels, idle: dict[Step, tuple], *steps: Step) -> int:
    """Take steps, without those that would do nothing because they did nothing when labels were as
    they are now; returns how many changes they tell of. ``idle`` keeps the labels of each."""
    changes = 0
    for step in steps:
        before = labels.state
        if idle.get(step) != before:
            changes += step(labels) or 0
            if labels.state == before:
                idle[step] = before
    return changes

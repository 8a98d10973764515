"""Relaxing labels gives what a plain loop over all samples gives, ties included."""

from types import SimpleNamespace

import numpy as np
import pytest

from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.labels.sample_graph import _padded

PRICE, SWEEPS = 1.0, 24


def scene(seed: int):
    """A random graph of samples, labels to begin with, and what labels cost each sample. All
    numbers are halves, so that sums are exact and ties are many."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 60))
    pairs = np.sort(rng.integers(0, size, (4 * size, 2)), axis=1)
    pairs = np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0)
    neighbours, weights = _padded(pairs, rng.integers(0, 3, len(pairs)) / 2.0, size)
    graph = SimpleNamespace(size=size, neighbours=neighbours, neighbour_weights=weights)
    count = int(rng.integers(1, 5))
    movable = np.flatnonzero(rng.uniform(size=size) < 0.8)
    candidates = [
        (sample, label, rng.integers(0, 6) / 2.0)
        for sample in movable.tolist()
        for label in range(NONE, count)
        if label == NONE or rng.uniform() < 0.7
    ]
    return graph, rng.integers(NONE, count, size), movable, candidates


def by_a_plain_loop(graph, of, candidates) -> np.ndarray:
    of, still = of.copy(), 0
    for sweep in range(SWEEPS):
        new = of.copy()
        for sample in range(sweep % 2, graph.size, 2):
            least = np.inf
            near = [k for k in graph.neighbours[sample] if k < graph.size]
            price = graph.neighbour_weights[sample]
            for _, label, cost in (one for one in candidates if one[0] == sample):
                same = [w for k, w in zip(near, price, strict=False) if of[k] == label]
                if not same and label not in (NONE, of[sample]):
                    continue
                energy = cost - PRICE * sum(same)
                if energy < least:
                    least, new[sample] = energy, label
        still = 0 if (new != of).any() else still + 1
        of = new
        if still == 2:
            break
    return of


@pytest.mark.parametrize("first", range(0, 300, 50))
def test_labels_are_relaxed_as_by_a_plain_loop(first):
    moved = 0
    for seed in range(first, first + 50):
        graph, of, movable, candidates = scene(seed)
        columns = [np.array(column) for column in zip(*candidates, strict=True)] or [of[:0]] * 3
        labels = SimpleNamespace(
            graph=graph,
            of=of.copy(),
            evidence=SimpleNamespace(options=SimpleNamespace(boundary=PRICE)),
            _movable=lambda movable=movable: movable,
            _candidates=lambda _, columns=columns: columns,
        )
        Labels.relax(labels)
        assert np.array_equal(labels.of, by_a_plain_loop(graph, of, candidates))
        moved += not np.array_equal(labels.of, of)
    assert moved > 25

"""Sheet neighbours: the padded array against the sets."""

import numpy as np

from touchatlas.atlas.graph.sheets import SheetNeighbours, same_sheet


def test_lines_of_neighbours_follow_the_sets():
    """Joined, separated and isolated at random, the padded array says the same as the sets."""
    rng, neighbours = np.random.default_rng(0), SheetNeighbours()
    for row in range(40):
        neighbours.append(i for i in range(row) if rng.random() < 0.3)
        one, other = rng.integers(0, row + 1, 2).tolist()
        if one != other:
            (neighbours.join if rng.random() < 0.5 else neighbours.separate)(one, other)
        if rng.random() < 0.1:
            neighbours.isolate(one)
        for i, line in enumerate(neighbours.lines().tolist()):
            assert set(line) - {i} == neighbours[i]
            assert all(i in neighbours[j] for j in neighbours[i])
    first, second = rng.integers(0, 40, (2, 300))
    expected = [
        i in neighbours[j] or i == j for i, j in zip(first.tolist(), second.tolist(), strict=True)
    ]
    # Few pairs are looked up line by line, many in a square.
    assert same_sheet(neighbours, first, second).tolist() == expected
    assert same_sheet(neighbours, first[:20], second[:20]).tolist() == expected[:20]

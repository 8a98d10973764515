"""SampleGraph: which samples are next to each other on the surface."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.labels.samples import ContourSamples

# Other contours of its own touch, and of other touches, of each of which a sample is linked to the
# nearest sample. Doubled, labels are smoother and take longer.
_OWN_TOUCH, _OTHER_TOUCHES = 2, 4
# Nearest samples that are looked at; more where all are of the sample's own touch. Doubled, few are
# found that are not found otherwise.
_NEAREST, _MANY = 40, 240
# Longest link over the shortest to another contour. Doubled, links pass over samples between.
_LONGEST = 2.5
# Least cosine of the normals of linked samples: 66 degrees, for the two ends of a chord across a
# gap between touches. Doubled, few samples are linked across gaps.
_COSINE = 0.4
# Largest sine of the angle between a chord and the tangent at either end, and of the mean of both:
# the chord of an arc has two equal and opposite ones. Doubled, the sides of an edge are linked.
_OFF_TANGENT, _OFF_ARC = 0.5, 0.35
# Noise of a chord's height in standard deviations of a sample.
_NOISE = 4.0
# A little more than the rounding of a distance, no unit.
_ROUNDED = 1.0 + 1e-12


class SampleGraph:
    """Links along contours, and to the nearest samples of other contours of the same surface.

    Parameters
    ----------
    samples : ContourSamples
    before : SampleGraph, optional
        That of the first of the samples, see ``is_of_first``: links are sought again only of those
        samples among whose nearest are new ones. The result is the same without it.

    Attributes
    ----------
    tree : cKDTree
        Of the points.
    pairs : (e, 2) int
        Linked samples, each pair once, the lower first.
    weights : (e,) float
        1 where both normals agree, 0 where they differ by 66 degrees or more.
    neighbours, neighbour_weights : (n, k) int and float
        Linked samples of each, and the weights of the links; n stands for none.
    """

    def __init__(self, samples: ContourSamples, before: "SampleGraph | None" = None) -> None:
        self.size, self._samples = len(samples), samples
        self.tree = cKDTree(samples.points)
        along = np.flatnonzero(samples.contours[1:] == samples.contours[:-1])
        # Links from each sample to those of other contours, and how far these were sought, length.
        self._across, self._sought = self._links_across(before)
        first, second = self._across
        low = np.concatenate([along, np.minimum(first, second)]).astype(np.int64)
        high = np.concatenate([along + 1, np.maximum(first, second)])
        keys = np.unique(low * self.size + high)
        self.pairs = np.stack([keys // self.size, keys % self.size], axis=1)
        cosine = _cosines(samples, *self.pairs.T)
        self.weights = np.maximum((cosine - _COSINE) / (1.0 - _COSINE), 0.0) ** 2
        self.neighbours, self.neighbour_weights = _padded(self.pairs, self.weights, self.size)
        self._places = np.empty(self.size + 1, int)

    def is_of_first(self, samples: ContourSamples) -> bool:
        """Whether the first of some samples are those of this graph."""
        names = "points", "normals", "outward", "contours", "touches", "steps", "stds"
        known = self._samples
        pairs = [(getattr(known, name), getattr(samples, name)[: self.size]) for name in names]
        return known.std == samples.std and all(np.array_equal(*pair) for pair in pairs)

    def _links_across(self, before: "SampleGraph | None") -> tuple[np.ndarray, np.ndarray]:
        """(2, m) samples and the nearest sample of each of the nearest other contours, and how far
        (n,) these were sought, length."""
        across, sought = np.zeros((2, 0), int), np.full(self.size, -np.inf)
        if before is not None:
            old, new = np.split(self._samples.points, [before.size])
            near = cKDTree(new).query(old)[0] <= _ROUNDED * before._sought
            across = before._across[:, ~near[before._across[0]]]
            sought[: before.size] = np.where(near, -np.inf, before._sought)
        some = np.flatnonzero(sought < 0.0)
        found, sought[some] = _links_across(self._samples, self.tree, some)
        return np.concatenate([across, found], axis=1), sought

    def mask(self, members) -> np.ndarray:
        """(n + 1,) whether each sample is a member; the last, for no sample, is true."""
        inside = np.zeros(self.size + 1, bool)
        inside[members] = inside[-1] = True
        return inside

    def interior(self, members) -> np.ndarray:
        """The members all of whose neighbours are members."""
        return members[self.mask(members)[self.neighbours[members]].all(axis=1)]

    def around(self, members, hops: int) -> np.ndarray:
        """The members and all samples within so many links of them, ascending."""
        seen = np.zeros(self.size + 1, bool)
        seen[members], front = True, members
        seen[-1] = True
        for _ in range(hops):
            front = self._ahead(front, ~seen)
            seen[front] = True
        return np.flatnonzero(seen[:-1])

    def connected(self, allowed, start) -> np.ndarray:
        """The allowed samples that hang together with those allowed of ``start``, ascending."""
        free = np.zeros(self.size + 1, bool)
        free[allowed] = True
        front = start[free[start]]
        free[front] = False
        parts = [front]
        while len(front):
            front = self._ahead(front, free)
            free[front] = False
            parts.append(front)
        return np.sort(np.concatenate(parts))

    def _ahead(self, front, free) -> np.ndarray:
        """The free samples (n + 1,) among the neighbours of others (m,), each once."""
        ahead = self.neighbours[front].ravel()
        ahead = ahead[free[ahead]]
        self._places[ahead] = places = np.arange(len(ahead))
        return ahead[self._places[ahead] == places]

    def nearest(self, points, sample: int, count: int) -> np.ndarray:
        """The ``count`` samples nearest to one of those reached by fewest links, ascending."""
        members = np.array([sample])
        for _ in range(count):
            more = self.around(members, 1)
            if len(more) == len(members) or len(members) >= 1.5 * count:
                break
            members = more
        offset = points[members] - points[sample]
        order = np.argsort((offset * offset).sum(axis=1), kind="stable")
        return np.sort(members[order[:count]])


def _cosines(samples: ContourSamples, i, j) -> np.ndarray:
    """(m,) cosines between the normals of samples i and j (m,), within their sampling planes or of
    the surface, whichever differ more: an oblique contour shows a part of the normal only."""
    within = _dot(samples.normals[i], samples.normals[j])
    return np.minimum(within, _dot(samples.outward[i], samples.outward[j]))


def _links_across(samples: ContourSamples, tree, some) -> tuple[np.ndarray, np.ndarray]:
    """(2, m) those of ``some`` samples (k,) and the nearest sample of each of the nearest other
    contours, and how far (k,) they were sought, length."""
    sought = np.empty(len(samples))
    found, sought[some] = _fitting_links(samples, tree, some, _NEAREST)
    alone = np.isin(np.arange(len(samples)), some)
    alone[found[0][samples.touches[found[0]] != samples.touches[found[1]]]] = False
    many = np.flatnonzero(alone)
    far, sought[many] = _fitting_links(samples, tree, many, _MANY)
    near = ~alone[found[0]]
    first, second, length = (np.append(a[near], b) for a, b in zip(found, far, strict=True))
    own = samples.touches[first] == samples.touches[second]
    parts = [
        _nearest_links(samples, first[these], second[these], length[these], most)
        for these, most in ((own, _OWN_TOUCH), (~own, _OTHER_TOUCHES))
    ]
    return np.concatenate(parts, axis=1), sought[some]


def _fitting_links(samples: ContourSamples, tree, some, count: int):
    """Samples (m,), near ones (m,) of other contours whose chords fit both normals, and their
    distances (m,), for some samples (k,); and how far (k,) these are sought, length."""
    length, near = tree.query(samples.points[some], k=np.arange(1, min(count, len(samples)) + 1))
    sought = length[:, -1] if count <= len(samples) else np.full(len(some), np.inf)
    other = samples.contours[near] != samples.contours[some][:, None]
    i, j, length = np.repeat(some, other.sum(axis=1)), near[other], length[other]
    points, normals, outward = (
        np.ascontiguousarray(rows.T) for rows in (samples.points, samples.normals, samples.outward)
    )
    for x, y, z in (normals, outward):
        facing = x[i] * x[j] + y[i] * y[j] + z[i] * z[j] > _COSINE
        i, j, length = i[facing], j[facing], length[facing]
    noise = _NOISE * np.maximum(samples.stds[i], samples.stds[j])
    chord = [x[j] - x[i] for x in points]
    rise, fall = (sum(x * n[at] for x, n in zip(chord, normals, strict=True)) for at in (i, j))
    fits = np.maximum(np.abs(rise), np.abs(fall)) < _OFF_TANGENT * length + noise
    fits &= np.abs(rise + fall) < _OFF_ARC * length + noise
    return (i[fits], j[fits], length[fits]), sought


def _dot(a, b) -> np.ndarray:
    """(m,) scalar products of vectors (m, 3)."""
    return np.asarray(np.einsum("ij,ij->i", a, b))


def _nearest_links(samples: ContourSamples, i, j, length, most: int):
    """Of links from samples i, the shortest to each other contour, ``most`` of each sample."""
    # Of equally near ones the first, whatever the tree.
    order = np.lexsort((j, length, i))
    i, j, length = i[order], j[order], length[order]
    # np.unique returns the first of each contour, which is the nearest.
    _, first = np.unique(i * (samples.contours[-1] + 1) + samples.contours[j], return_index=True)
    first = np.sort(first)
    i, j, length = i[first], j[first], length[first]
    begin = np.searchsorted(i, i)
    rank = np.arange(len(i)) - begin
    limit = np.maximum(_LONGEST * length[begin], _LONGEST * samples.steps[i])
    keep = (rank < most) & (length <= limit)
    return i[keep], j[keep]


def _padded(pairs, weights, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Neighbours (n, k) of each sample, padded with ``size``, and weights (n, k), with 0."""
    both = np.concatenate([pairs, pairs[:, ::-1]])
    order = np.lexsort((both[:, 1], both[:, 0]))
    both = both[order]
    rank = np.arange(len(both)) - np.searchsorted(both[:, 0], both[:, 0])
    out = np.full((size, int(rank.max(initial=-1)) + 1), size)
    of = np.zeros(out.shape)
    out[both[:, 0], rank] = both[:, 1]
    of[both[:, 0], rank] = np.append(weights, weights)[order]
    return out, of

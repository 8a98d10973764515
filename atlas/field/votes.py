"""Votes: which cells lie inside of the body, as samples show."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.field.face_trees import off_box
from touchatlas.atlas.field.smooth_rims import SmoothRims


class Votes:
    """The labels of cells, 1 outside, -1 inside, 0 unknown, by the samples that vote for each.

    At a smooth rim a face ends without an edge: the wall of a cup and the air above its round lip
    are one cell, whose votes contradict each other. Such a cell has a label where the votes of one
    side are much nearer, but for those of faces that end at a rim between them and the point.

    Parameters
    ----------
    faces : Faces
    rims : SmoothRims
    samples : (m,) int
        Those that vote.
    inner, outer : (m,) int
        Keys of the cells that each has inside, and outside.
    """

    def __init__(self, faces: Faces, rims: SmoothRims, samples, inner, outer) -> None:
        self._faces, self._rims = faces, rims
        self._keys, which = np.unique(np.concatenate([inner, outer]), return_inverse=True)
        vote, cells = np.repeat([-1.0, 1.0], len(inner)), len(self._keys)
        count, total = np.bincount(which, minlength=cells), np.bincount(which, vote, cells)
        # Wrong labels cast a contrary vote now and then, and one of three may decide.
        contrary = 0.5 * (count - np.abs(total))
        agreed = (contrary <= np.maximum(1, 1e-3 * count)) & (total != 0.0)
        self._labels = np.where(agreed & (count >= 3), np.sign(total), 0.0)
        inside, outside = np.split(which, 2)
        split = {
            int(self._keys[k]): self._at_rims(samples[inside == k], samples[outside == k])
            for k in np.flatnonzero(~agreed).tolist()
        }
        self._split = {key: votes for key, votes in split.items() if votes}

    def labels(self, keys, points) -> np.ndarray:
        """(n,) labels of the cells of keys (n,) at points (n, 3) in them, 0 where there is none."""
        if not len(self._keys):
            return np.zeros(np.shape(keys))
        at = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        out = np.where(self._keys[at] == keys, self._labels[at], 0.0)
        for key in self._split.keys() & set(np.unique(keys).tolist()):
            rows = np.flatnonzero(keys == key)
            inside, outside = self._nearest(key, points[rows])
            out[rows[2.0 * inside < outside]] = -1.0
            out[rows[2.0 * outside < inside]] = 1.0
        return out

    def _at_rims(self, inside, outside) -> list[tuple[int, int, cKDTree]]:
        """The samples of each face that vote for inside, 0, and for outside, 1, of samples (m,) and
        (k,) that do; none where no smooth rim joins faces with contrary votes."""
        faces = self._faces
        own = [np.unique(faces.of[votes]).tolist() for votes in (inside, outside)]
        if not self._rims.join(*own):
            return []
        return [
            (face, side, cKDTree(faces.points[votes[faces.of[votes] == face]]))
            for side, votes in enumerate((inside, outside))
            for face in own[side]
        ]

    def _nearest(self, key: int, points) -> np.ndarray:
        """(2, n) distances of points (n, 3) from the votes in a cell for inside and for outside: of
        each face the third one, as one of three may be wrong. Where one side is more than twice
        as far as the other, no more than that is told of it."""
        out = np.full((2, len(points)), np.inf)
        for face, side, tree in self._split[key]:
            most = np.minimum(out[side], 2.0 * out[1 - side])
            rows = np.flatnonzero(off_box(tree, points) <= most)
            away = tree.query(points[rows], k=[3])[0][:, 0]
            near = away <= most[rows]
            rows, away = rows[near], away[near]
            away[self._rims.pass_rims(face, points[rows], 2.0 * away)] = np.inf
            out[side, rows] = np.minimum(out[side, rows], away)
        return out

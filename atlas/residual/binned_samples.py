"""What many patches learn from, as one stack of arrays, and the same in fewer samples."""

from dataclasses import dataclass

import numpy as np

# Samples of one square are merged; so wide that no more than 224 squares meet the unit disc.
SIDE = 2.0 / 16.0


@dataclass(frozen=True, eq=False)
class PatchSamples:
    """n samples of each of m patches, in each patch's frame over its radius.

    Parameters
    ----------
    feet : (m, n, 3) float, scaled, local
        Of the samples on the polynomials.
    terms : (t, m, n) float
        Monomials there.
    height : (m, n) float, scaled
        What the polynomials are to be: z of the feet plus F at the samples.
    weight : (m, n) float
        Of the squares of the heights; 0 for what only fills the stack.
    noise : (m,) float, scaled
        Standard deviation of a height of weight 1, > 0.
    """

    feet: np.ndarray
    terms: np.ndarray
    height: np.ndarray
    weight: np.ndarray
    noise: np.ndarray

    def __getitem__(self, rows) -> "PatchSamples":
        """Those of some patches."""
        return PatchSamples(
            *(self.feet[rows], self.terms[:, rows], self.height[rows], self.weight[rows]),
            self.noise[rows],
        )

    def only(self, row: int) -> "PatchSamples":
        """Those of one patch, a stack of one, without what only fills the stack."""
        used = self.used[row]
        return PatchSamples(
            *(self.feet[[row]][:, used], self.terms[:, [row]][:, :, used]),
            *(self.height[[row]][:, used], self.weight[[row]][:, used], self.noise[[row]]),
        )

    @property
    def used(self) -> np.ndarray:
        """(m, n) bool: what does not only fill the stack."""
        return self.weight > 0


def merged(samples: PatchSamples, side: np.ndarray) -> PatchSamples:
    """The samples of each square, of a side (m,), scaled, of a patch as one, at their mean.

    Monomials and heights are averaged with the samples, so a polynomial loses nothing by it;
    detail finer than a square is smoothed. The noise of a merged sample is that of a mean.
    """
    used = samples.used
    square = np.floor(samples.feet[..., :2] / side[:, None, None]).astype(int)
    square -= square.min(initial=0)
    count = square.max(initial=0) + 1
    first = np.arange(len(square))[:, None] * count**2
    keys, place = np.unique(
        (first + square[..., 0] * count + square[..., 1])[used], return_inverse=True
    )
    patch = keys // count**2
    column = np.arange(len(keys)) - np.searchsorted(patch, patch)
    shape = len(square), int(column.max(initial=-1)) + 1
    weight = np.zeros(shape)
    weight[patch, column] = np.bincount(place, samples.weight[used], len(keys))

    def mean(values):
        out = np.zeros(shape)
        total = np.bincount(place, (samples.weight * values)[used], len(keys))
        out[patch, column] = total / weight[patch, column]
        return out

    feet = np.stack([mean(samples.feet[..., i]) for i in range(3)], axis=-1)
    terms = np.stack([mean(term) for term in samples.terms])
    return PatchSamples(feet, terms, mean(samples.height), weight, samples.noise)

"""PatchSamples: the samples of many patches as one stack, and their means over squares."""

from dataclasses import dataclass

import numpy as np

# Largest side of the squares over which samples are averaged, in patch radii: at most 224 squares
# intersect the unit disc. Doubled, a quarter as many samples remain and detail is smoothed.
SIDE = 2.0 / 16.0


@dataclass(frozen=True, eq=False)
class PatchSamples:
    """n samples of each of m patches, in each patch's frame over its radius.

    Parameters
    ----------
    feet : (m, n, 3) float, scaled, local
        Feet of the samples on the polynomials.
    terms : (t, m, n) float
        Monomials at the feet.
    height : (m, n) float, scaled
        Values that the polynomials are fitted to: z of the feet plus F at the samples.
    weight : (m, n) float
        Weights of the squared differences; 0 where the stack is padded.
    noise : (m,) float, scaled
        Standard deviation of a height of weight 1, > 0.
    """

    feet: np.ndarray
    terms: np.ndarray
    height: np.ndarray
    weight: np.ndarray
    noise: np.ndarray

    def __getitem__(self, rows) -> "PatchSamples":
        """The samples of some patches."""
        return PatchSamples(
            *(self.feet[rows], self.terms[:, rows], self.height[rows], self.weight[rows]),
            self.noise[rows],
        )

    def only(self, row: int) -> "PatchSamples":
        """The samples of one patch, as a stack of one without padding."""
        used = self.used[row]
        return PatchSamples(
            *(self.feet[[row]][:, used], self.terms[:, [row]][:, :, used]),
            *(self.height[[row]][:, used], self.weight[[row]][:, used], self.noise[[row]]),
        )

    @property
    def used(self) -> np.ndarray:
        """(m, n) bool: False where the stack is padded."""
        return self.weight > 0


def merged(samples: PatchSamples, side: np.ndarray) -> PatchSamples:
    """Samples averaged over the squares of a grid in each patch's tangent plane.

    Parameters
    ----------
    samples : PatchSamples
    side : (m,) float, scaled
        Side of the squares of each patch.

    Notes
    -----
    Feet, monomials and heights are weighted means, so a polynomial fits them as it fits the
    samples; detail finer than a square is smoothed. The weight of a mean is the sum of weights.
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

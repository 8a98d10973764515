"""FaceOptions: what a label costs, and which samples a piece may claim."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FaceOptions:
    """What a label costs, and which samples a piece may claim.

    Costs are negative logarithms of probabilities (nats). A description has the squared distances
    of the samples over twice their variance, half the logarithm of their number for each
    parameter, and the prices below.

    Parameters
    ----------
    unexplained : float
        Price of a sample that no piece explains. 6 is that of a sample 3.5 deviations off.
    boundary : float
        Price of two neighbouring samples with different labels (Potts model).
    doubt : float
        Predicted deviation up to which a growing piece claims samples, in deviations of a sample.
    better : float
        How many times as much a kind of more parameters must explain.
    kinked : float
        Least fraction of the contours that run over a sharp edge for faces to be read: three times
        what noise makes.
    lawful : float
        Least fraction of the samples that laws explain in the first labelling for faces to be read;
        with fewer the body is treated as free-form.
    rounds : int
        Most rounds of labels, fits and moves.
    """

    unexplained: float = 6.0
    boundary: float = 0.5
    doubt: float = 1.5
    better: float = 1.25
    kinked: float = 0.06
    lawful: float = 0.25
    rounds: int = 10

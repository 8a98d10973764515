"""All samples as one face: the law that explains every one of them, or a free-form face."""

import numpy as np
from scipy.special import chdtrc

from touchatlas.atlas.faces.faces import Face, Faces
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.labels.tried import passed
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import SIMPLE_LAWS, Kind
from touchatlas.atlas.pieces.laws import law_of
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.surfaces.kriging import beyond_noise
from touchatlas.atlas.surfaces.sharp_turns import MANY, share_of_contours, sharp_turns
from touchatlas.patch.geometry.arrays import frozen_array, nearest_to_mean


def face_of_all(samples: ContourSamples) -> Faces:
    """All samples as one face: of the simplest law that explains all of them, else free-form."""
    piece, count = law_of_all(samples), len(samples)
    normals = samples.outward if piece is None else piece.at(samples.points)[1]
    turns = sharp_turns(samples) if piece is None else np.zeros((0, 2), int)
    return Faces(
        (_free_form(samples) if piece is None else _lawful(piece, samples),),
        (),
        frozen_array(samples.points, (None, 3), "points"),
        frozen_array(normals, (None, 3), "normals"),
        np.zeros(count, int),
        np.full(count, NONE if piece is None else 0),
        np.zeros(0, int),
        samples.std,
        samples.stds,
        levels=samples.levels,
        turns=turns,
        is_sharp=share_of_contours(samples, turns) >= MANY,
        tried=passed(np.flatnonzero(np.diff(samples.touches, append=-1)) + 1),
    )


def _free_form(samples: ContourSamples) -> Face:
    """The face of samples that obey no law."""
    middle = nearest_to_mean(samples.points)
    return Face(0, None, (), (), np.arange(len(samples)), 1.0, samples.std, middle)


def _lawful(piece: Piece, samples: ContourSamples) -> Face:
    """The face of samples that lie on a piece."""
    law = law_of(piece, samples.points, samples.stds)
    off = piece.at(samples.points)[0]
    explained = float((np.abs(off) <= samples.levels.sure * samples.stds).mean())
    own = np.arange(len(samples)), explained, float(np.sqrt((off * off).mean()))
    return Face(0, law, (piece,), (0,), *own, nearest_to_mean(samples.points))


def law_of_all(samples: ContourSamples) -> Piece | None:
    """The piece of the simplest law that explains every contour, or None.

    Notes
    -----
    The squares of the distances of n samples from a true law of p parameters, over the variance of
    a sample, have a chi-square distribution of n - p degrees of freedom, and those of a contour of
    m samples one of m at most.
    """
    columns = samples.points, samples.outward, samples.stds
    if len(samples) <= Kind.QUADRIC.parameters:
        return None
    # Each of the others but a torus is a quadric, too: most bodies obey no law, and two fits tell.
    quadric = fit_piece(Kind.QUADRIC, *columns)
    is_quadric = quadric is not None and _passes_by(quadric, samples)
    kinds = (*SIMPLE_LAWS, Kind.QUADRIC) if is_quadric else (Kind.TORUS,)
    for piece in (quadric if kind is Kind.QUADRIC else fit_piece(kind, *columns) for kind in kinds):
        if piece is not None and _passes_by(piece, samples) and _is_sure(piece, samples):
            return _with_misfit(piece, samples)
    return None


def _with_misfit(piece: Piece, samples: ContourSamples) -> Piece:
    """A piece whose deviation counts by how much it is off on average, beyond noise: so much lack
    of fit is borne, and a law knows nothing of it."""
    weight = (samples.std / samples.stds) ** 2
    square = np.mean(weight * piece.at(samples.points)[0] ** 2) / weight.mean()
    return piece.loosened(float(beyond_noise(square, samples.std / np.sqrt(weight.mean()))))


def _is_sure(piece: Piece, samples: ContourSamples) -> bool:
    """Whether a piece is surer of each sample than the sample is, and faces as they do."""
    _, normals, variance = piece.predicted(samples.points)
    against = (normals * samples.normals).sum(axis=1) <= 0.0
    return bool((variance <= samples.stds**2).all() and np.mean(against) <= samples.levels.alpha)


def _passes_by(piece: Piece, samples: ContourSamples) -> bool:
    """Whether a piece passes by each contour and by all samples no farther than noise does."""
    return are_noise(piece.at(samples.points)[0], samples, piece.kind.parameters)


def are_noise(distance, samples: ContourSamples, parameters: int) -> bool:
    """Whether the distances (n,) of samples from a surface of so many parameters, of each contour
    and of all, are no larger than noise makes them."""
    square = (distance / samples.stds) ** 2
    sums, counts = np.bincount(samples.contours, square), np.bincount(samples.contours)
    freedom = max(len(samples) - parameters, 1)
    # The survival function of chi-square: scipy.stats, whose chi2.sf it is, takes a third of the
    # time in which this library is imported.
    by_chance = np.append(chdtrc(counts, sums), chdtrc(freedom, square.sum()))
    return bool(by_chance.min() * len(by_chance) > samples.levels.alpha)

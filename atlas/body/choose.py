"""KnownBody: the body that samples show, one face or many, by the shorter description."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.one_face import are_noise, face_of_all
from touchatlas.atlas.body.read_faces import (
    determined,
    faces_of_labels,
    faces_of_samples,
    samples_of,
)
from touchatlas.atlas.body.uncrossed_edges import with_uncrossed_edges
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.labels.tried import NEW, Tried, is_larger
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.relabel.labelling import first_labels, revise_all
from touchatlas.atlas.relabel.moves import find_roundings
from touchatlas.atlas.samples.sample_pool import NO_TOUCH, SamplePool
from touchatlas.atlas.samples.sides import is_closed
from touchatlas.patch.geometry.kinks import SIDE


@dataclass(frozen=True, eq=False)
class KnownBody:
    """What samples show.

    Parameters
    ----------
    count : int
        Number of samples that the body was made of.
    looked : int
        Number of samples when one face and many were last compared.
    std : float, length
        Standard deviation of a sample then.
    faces : Faces or None
        The faces that were last read, from which the next reading goes on: before ``determined``
        leaves some out, so that ids may differ from those of the body.
    body : Body or None
        The surface; None before any touch.
    is_few : bool
        Whether its patches are as few as the tolerance allows.
    """

    count: int = 0
    looked: int = 0
    std: float = 0.0
    faces: Faces | None = None
    body: Body | None = None
    is_few: bool = False

    @property
    def is_one_face(self) -> bool:
        """Whether there is one face, or no body yet."""
        return self.body is None or self.body.is_one_face


def look_for_body(
    pool: SamplePool,
    std: float,
    before: KnownBody = KnownBody(),
    levels: Levels = Levels(),
    last: bool = False,
) -> KnownBody:
    """What the samples of a pool show.

    One face and many are compared where the number of samples has passed the next power of a
    growth since the comparison ``before``, and the ``last`` time. In between the new samples join
    the body that was chosen.

    Parameters
    ----------
    pool : SamplePool
    std : float, length
        Standard deviation of a sample.
    before : KnownBody
    levels : Levels
    last : bool
        Whether no samples follow.
    """
    count = len(pool)
    looks = is_larger(count, before.looked) or (last and before.looked < count)
    if count == before.count and not looks:
        return before
    known = None if before.body is None else before.body.samples
    samples = samples_of(pool, count, std, levels, known)
    if looks:
        return _chosen(samples, pool, before)
    found = replace(before, count=count, std=std, is_few=False)
    if not before.is_one_face:
        faces = faces_of_samples(samples, before=before.faces)
        body = body_of_faces(faces, samples)
        if body is not None:
            return replace(found, faces=faces, body=body)
    return replace(found, body=body_of_one(samples, before.body))


def body_may_wait(
    pool: SamplePool, std: float, before: KnownBody, levels: Levels = Levels()
) -> KnownBody | None:
    """What is known until the body of the samples of a pool is asked for: that of the first of
    them, from which ``look_for_body`` goes on as if it had been asked after each touch.

    None where it cannot wait: other bodies follow from it, because it has many faces, or faces may
    be read; or the samples have doubled, and say more of the unit of the next ones."""
    count = len(pool)
    if before.faces is not None or not before.is_one_face or count >= 2 * before.count:
        return None
    if not is_larger(count, before.looked):
        return before
    known = None if before.body is None else before.body.samples
    samples = samples_of(pool, count, std, levels, known)
    _, most = shares_at_edges(samples, pool.edges, pool.touches == NO_TOUCH)
    return None if most >= FaceOptions.kinked else replace(before, looked=count)


def _chosen(samples: ContourSamples, pool: SamplePool, before: KnownBody) -> KnownBody:
    """The body of the shortest description: all samples as one face, faces that go on from those
    read ``before``, or faces that are read anew, if laws explain enough of the samples at first.
    Where the laws that go on leave noise alone, they are kept, and nothing else is tried: see
    ``leaves_noise``."""
    on = None if before.faces is None else faces_of_samples(samples, before=before.faces)
    gone_on = None if on is None else body_of_faces(on, samples)
    if gone_on is not None and leaves_noise(gone_on):
        return KnownBody(len(samples), len(samples), samples.std, on, gone_on)
    one = body_of_one(samples, before.body)
    found = KnownBody(len(samples), len(samples), samples.std, None, one)
    least, most = shares_at_edges(samples, pool.edges, pool.touches == NO_TOUCH)
    if before.faces is None and most < FaceOptions.kinked:
        return found
    shortest, is_told = description_length(one), before.faces is not None
    is_told |= least >= FaceOptions.kinked
    # Where no contour tells of edges, planes do, which grow in a small part of the time of others.
    if not is_told and first_labels(samples, most=Kind.PLANE).lawful_share < FaceOptions.lawful:
        return found
    tried, labels = [(on, gone_on)], first_labels(samples, before=on)
    is_likely = labels.lawful_share >= FaceOptions.lawful
    is_likely &= is_told or labels.total() < shortest
    if is_likely:
        revise_all(labels)
        anew = faces_of_labels(labels)
        tried.append((anew, body_of_faces(anew, samples)))
    for faces, body in tried:
        if body is not None and (length := description_length(body)) < shortest:
            shortest, found = length, replace(found, faces=faces, body=body)
    return found


def body_of_parts(
    samples: ContourSamples, parts: Sequence[tuple[list[Piece], np.ndarray, bool]]
) -> KnownBody:
    """The body of samples that were labelled part by part; those of the parts follow each other.

    Pieces of two parts are joined where that is shorter to describe. What was tried within a part
    is not tried again. Lengths of parts add up: where each part has many faces, so have all.

    Parameters
    ----------
    samples : ContourSamples
    parts : sequence
        Of each part the pieces, the number of the piece of each sample, or NONE, and whether it was
        one face.
    """
    pieces: list[Piece] = []
    of, home = [], []
    for number, (own, labels_of, _) in enumerate(parts):
        of.append(np.where(labels_of == NONE, NONE, labels_of + len(pieces)))
        pieces += own
        home += [number] * len(own)
    count, faces, body = len(samples), None, None
    if pieces:
        labels = Labels(Evidence(samples, SampleGraph(samples)))
        labels.resume(pieces, np.concatenate(of))
        within = [(a, b) for a, b in labels.pairs() if home[a] == home[b]]
        labels.moved = Tried(labels.of.copy(), within)
        # No part offered its labels to the edges of another one.
        labels.given = Tried(np.full(count, NEW))
        find_roundings(labels)
        revise_all(labels)
        faces = faces_of_labels(labels)
        body = body_of_faces(faces, samples)
    many = KnownBody(count, count, samples.std, faces, body)
    if body is not None and not any(is_one for *_, is_one in parts):
        return many
    one = body_of_one(samples)
    if body is not None and description_length(body) < description_length(one):
        return many
    return KnownBody(count, count, samples.std, None, one)


def leaves_noise(body: Body) -> bool:
    """Whether a body of lawful faces passes by all its samples, and by each contour, no farther
    than noise does.

    Notes
    -----
    A parameter more explains half a nat of noise, and takes half the logarithm of the number of
    samples. A free-form face that follows samples as well has more parameters: a level and slopes
    wherever laws have theirs. Other faces of as few parameters may be shorter by what noise makes.
    """
    faces = body.faces
    if not faces.are_lawful:
        return False
    count = sum(piece.kind.parameters for face in faces.faces for piece in face.pieces)
    count += sum(edge.radius > 0.0 for edge in faces.edges)
    return are_noise(body.field.at(body.samples.points).distance, body.samples, count)


def description_length(body: Body) -> float:
    """Nats in which a body describes its samples (Rissanen 1978, Schwarz 1978).

    A sample takes half its squared distance from the surface over its variance, and no more than
    an unexplained one. A parameter takes half the logarithm of the number of samples of its patch:
    those of a face, or those within the radius of a sextic. The number of parameters that samples
    determine is the trace of the smoother: the sum of the variances of the surface at the samples
    over that of a sample (Hastie, Tibshirani, Friedman, The Elements of Statistical Learning, 2009,
    section 5.4.1).
    Labels of neighbours that differ are paid for as in the labelling (a Potts model).
    """
    samples, faces, options = body.samples, body.faces, FaceOptions()
    found = body.field.at(samples.points)
    misfit = np.minimum(0.5 * (found.distance / samples.stds) ** 2, options.unexplained)
    freedom = np.minimum((found.deviation / samples.stds) ** 2, 1.0)
    patch = body.field.trees.patches_at(samples.points, found.face)
    counts = np.maximum(body.field.trees.sample_counts[patch], 2)
    length = float(misfit.sum() + 0.5 * (freedom * np.log(counts)).sum())
    if body.is_one_face:
        return length
    graph = faces.links or SampleGraph(samples)
    first, second = faces.of[graph.pairs].T
    return length + options.boundary * float(graph.weights[first != second].sum())


def shares_at_edges(samples: ContourSamples, ends_at_edge, of_scan) -> tuple[float, float]:
    """The least and the largest share of the contours that run over a sharp edge, or have a sample
    (n,) that is the last before one.

    Contours too short to show a kink do not speak against edges. Nothing reports what an open
    contour of samples ``of_scan`` (n,) ends at: the least share counts it against edges, and the
    largest one does not. Where none speaks against edges, there may be some."""
    bounds = np.append(np.flatnonzero(np.diff(samples.contours, prepend=-1)), len(samples))
    edges, against, open_ = 0, 0, 0
    for (a, b), hinges in zip(itertools.pairwise(bounds.tolist()), samples.hinges, strict=True):
        if not samples.planes[a].any():
            continue
        if ends_at_edge[a:b].any() or hinges.are_kinks(samples.stds[a]).any():
            edges += 1
        elif b - a > 2 * SIDE:
            is_open = of_scan[a] and not is_closed(samples.points[a:b])
            against, open_ = against + (not is_open), open_ + is_open
    told, every = edges + against, edges + against + open_
    return edges / every if every else 0.0, edges / told if told else 1.0


def body_of_one(samples: ContourSamples, before: Body | None = None) -> Body:
    """All samples as one face; ``before`` may be the body of the first of them."""
    return Body(face_of_all(samples), samples, before)


def body_of_faces(faces: Faces, samples: ContourSamples) -> Body | None:
    """The body of those faces that contours determine; None where these are one or none, or laws
    explain no more than half of the samples.

    Notes
    -----
    A description length is that of samples, and says nothing of what is between them. There
    free-form faces are no surer than one free-form face, which is cut at sharp turns as well, and
    their edges are one more thing to know.
    """
    known = determined(faces, samples)
    lawful = [face.id for face in known.faces if face.law is not None]
    if len(known) < 2 or np.isin(known.of, lawful).mean() <= 0.5:
        return None
    body = Body(known, samples)
    if not samples.tip > 0.0:
        return body
    # A ball rounds a sharp edge by its own radius, whether a contour crossed it or not; of an edge
    # that is rounded more, this would explain no sample.
    return min(body, Body(with_uncrossed_edges(body), samples), key=description_length)

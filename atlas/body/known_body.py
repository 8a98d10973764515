"""KnownBody: the body that samples show, and when its laws and edges are looked for again."""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.explained import (
    determined,
    is_explained,
    is_lawful,
    lawful_share,
    share_over_sharp_edges,
    share_with_edges,
)
from touchatlas.atlas.body.one_face import face_of_all
from touchatlas.atlas.body.read_faces import faces_of_revised, faces_of_samples, samples_of
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.relabel.labelling import first_labels, revise_all
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.atlas.surfaces.sharp_turns import MANY

# Number of samples up to which faces that may become lawful are looked for at each touch: then it
# takes about a second. Doubled, some bodies take fewer touches and more time.
_FEW = 5000
# By what factor the number of samples grows until the next look: where faces may become lawful;
# where no edges were seen; and where some of the surface obeys no law: if samples are few or
# most of them obey one, and otherwise. The time of all looks is that of the last one times
# f / (f - 1). Doubled, laws are found later.
_LAWFUL_GROWS, _EDGELESS_GROWS, _LAWLESS_GROWS, _HOPELESS_GROWS = 1.1, 1.25, 1.5, 4.0
# Least share of the contours that run over a sharp edge, or end at one, for faces to be looked for:
# noise makes a kink in two of a hundred. Doubled, bodies of few blunt edges are one free-form face.
_WITH_EDGES = 0.06
# Share of the samples that obey laws below which faces are not expected to become lawful soon, and
# below which they are not at all: then many samples are not looked at, which takes a minute. On
# lawful bodies it was 0.7 or more. Doubled, no body becomes lawful late.
_LAWLESS, _NEVER_LAWFUL = 0.8, 0.4
# That share from which more samples may soon show that all is lawful, however many there are: it
# was 0.74 on a part of 80 faces after 15 touches. They were looked for again after 66. Doubled, no
# body of so many samples becomes lawful soon.
_MOSTLY = 0.6
# That share of the first labels, before they are revised, below which no face is read: on lawful
# bodies it was 0.27 or more (a plate with fillets), on scans of hands and bottles 0.13 or less.
# Revising takes seven to 25 times as long as labelling. Doubled, laws of fillets are found late.
_HOPELESS = 0.2
# Number of samples above which it is ``_NEVER_LAWFUL``: of 3,000 to 4,900 samples it was 0.55 on a
# lawful body, and 0.25 and 0.24 on scans of a cow and a bust. Revising the cow's took a fourth of
# its exploration; doubled, it is revised.
_SOME = 2000
# Least number of samples of a face, on average, for free-form ones to be drawn: four times the
# parameters of a sextic. It was 240 or more on a turned handle, and 140 or less on a wing nut,
# whose 50 faces took a minute a touch. Doubled, the handle is drawn as one face, and takes more
# touches.
_EACH = 196
# Largest share of the samples of faces beside which such a surface may pass: 0.009 or less on those
# bodies, 0.011 to 0.06 on a wing nut, whose surface kept 42 handles. Doubled, it is drawn.
_CONTRADICTED = 0.01


@dataclass(frozen=True, eq=False)
class KnownBody:
    """What samples show: the faces of a body that has edges, or all as one free-form face.

    Parameters
    ----------
    count : int
        Number of samples that the body was read from.
    looked : int
        Number of samples when laws and edges were last looked for.
    std : float, length
        Standard deviation of a sample then.
    edges : bool
        Whether enough contours run over sharp edges. Without, nothing more was asked.
    share : float
        Fraction of the samples that lawful faces explain; of first labels where that is so little
        that no face was read.
    sharp : bool
        Whether so many contours run over sharp edges that free-form faces are drawn as well.
    is_one : bool
        Whether the body is one free-form face.
    faces : Faces or None
        The faces that were read, where most of the samples obey laws or the body is drawn from
        them.
    body : Body or None
        The surface; None before any touch.
    is_few : bool
        Whether its patches are as few as the tolerance allows.
    """

    count: int = 0
    looked: int = 0
    std: float = 0.0
    edges: bool = False
    share: float = 0.0
    sharp: bool = False
    is_one: bool = True
    faces: Faces | None = None
    body: Body | None = None
    is_few: bool = False

    @property
    def is_hopeful(self) -> bool:
        """Whether the body is drawn from faces, or most of the surface obeys laws: more samples may
        show that all does. The next look begins with these faces."""
        return self.faces is not None

    @property
    def is_newly_sharp(self) -> bool:
        """Whether many contours run over sharp edges that did not when laws were last looked for:
        free-form faces may be drawn now, whatever their laws."""
        return self.body is not None and self.body.faces.is_sharp and not self.sharp

    def is_due(self, count: int) -> bool:
        """Whether to look again with so many samples."""
        if count == self.looked:
            return False
        # Faces know no other samples than those that they were read from.
        if not self.is_one or self.is_newly_sharp:
            return True
        if self.is_hopeful:
            return count <= _FEW or count >= _LAWFUL_GROWS * self.looked
        if not self.edges:
            return count >= _EDGELESS_GROWS * self.looked
        if self.share < _NEVER_LAWFUL and count > _FEW:
            return False
        soon = count <= _FEW or self.share >= _MOSTLY
        return count >= (_LAWLESS_GROWS if soon else _HOPELESS_GROWS) * self.looked


def look_for_body(
    pool: SamplePool,
    std: float,
    before: KnownBody = KnownBody(),
    levels: Levels = Levels(),
    last: bool = False,
) -> KnownBody:
    """What the samples of a pool show; ``std`` is that of a sample, length.

    Laws and edges are looked for where that is due after what was found ``before``, and the
    ``last`` time where they may be found. Else a body of one free-form face learns the new samples.
    """
    if before.is_due(len(pool)) or (last and before.is_hopeful):
        return _looked_for(samples_of(pool, len(pool), std, levels), np.asarray(pool.edges), before)
    if before.is_one and len(pool) > before.count:
        body = body_of_one(samples_of(pool, len(pool), std, levels), before.body)
        return replace(before, count=len(pool), is_few=False, body=body)
    return before


def _looked_for(samples: ContourSamples, ends_at_edge, before: KnownBody) -> KnownBody:
    """What samples show. Faces are read only where contours run over edges, and where first labels
    are lawful on some of the surface: other bodies are not worth the time."""
    lawless = KnownBody(len(samples), len(samples), samples.std)
    if not (before.is_hopeful or share_with_edges(samples, ends_at_edge) >= _WITH_EDGES):
        return replace(lawless, body=body_of_one(samples, before.body))
    if before.is_hopeful:
        sharp = before.sharp or before.is_newly_sharp
        faces = faces_of_samples(samples, before=before.faces)
        found = known_from_faces(faces, samples, sharp, before.body)
        if before.is_one or not found.is_one:
            return found
        # Labels that go on from earlier ones may have ended in a worse place.
        faces = faces_of_samples(samples)
        again = known_from_faces(faces, samples, sharp, before.body)
        return again if again.share > found.share else found
    labels = first_labels(samples)
    sharp = share_over_sharp_edges(samples) >= MANY
    least = _HOPELESS if len(samples) <= _SOME else _NEVER_LAWFUL
    if labels.lawful_share < least and not sharp:
        share = labels.lawful_share
        return replace(lawless, edges=True, share=share, body=body_of_one(samples, before.body))
    revise_all(labels)
    return known_from_faces(faces_of_revised(labels), samples, sharp, before.body)


def body_of_one(samples: ContourSamples, before: Body | None = None) -> Body:
    """All samples as one free-form face; ``before`` may be that of the first of them."""
    faces = face_of_all(samples, before.faces if before and before.field.is_one else None)
    return Body(faces, samples, before)


def known_from_faces(
    faces: Faces, samples: ContourSamples, sharp: bool, before: Body | None = None
) -> KnownBody:
    """What faces that were read from samples show, of which many contours ran over ``sharp`` edges
    or not; ``before`` may be the body of the first of them."""
    known, count = determined(faces, samples), len(samples)
    share = lawful_share(known)
    found = KnownBody(count, count, samples.std, True, share, sharp, False, faces)
    whole = sharp and is_explained(known) and count >= _EACH * len(known)
    if is_lawful(known) or whole:
        body = Body(known, samples)
        if is_lawful(known) or body.contradicted <= _CONTRADICTED:
            return replace(found, body=body)
    kept = faces if share >= _LAWLESS else None
    return replace(found, is_one=True, faces=kept, body=body_of_one(samples, before))

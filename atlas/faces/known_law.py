"""KnownLaw: what was found when lawful faces were last looked for, and when to look again."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from touchatlas.atlas.faces.faces import Faces, face_of_all
from touchatlas.atlas.faces.labelling import first_labels, revise_all
from touchatlas.atlas.faces.lawful_body import (
    LawfulBody,
    determined,
    is_explained,
    is_lawful,
    lawful_share,
    share_over_sharp_edges,
    share_with_edges,
)
from touchatlas.atlas.faces.read_faces import faces_of_revised, faces_of_samples, samples_of
from touchatlas.atlas.faces.samples import ContourSamples
from touchatlas.atlas.patches.sample_pool import SamplePool

# Number of samples up to which faces are looked for at each touch, where they obey laws or nearly:
# then it takes about a second. Doubled, some bodies take fewer touches and more time.
_FEW = 5000
# By what factor the number of samples grows until the next look: where faces are lawful, or may
# become so; where no edges were seen; and where most of the surface obeys no law, of few samples
# and of more. The time of all looks is that of the last one times f / (f - 1). Doubled, laws are
# found later.
_LAWFUL_GROWS, _EDGELESS_GROWS, _LAWLESS_GROWS, _HOPELESS_GROWS = 1.1, 1.25, 1.5, 4.0
# Least share of the contours that run over a sharp edge, or end at one, for faces to be looked for:
# noise makes a kink in two of a hundred. Doubled, bodies of few blunt edges are drawn from
# overlapping patches.
_WITH_EDGES = 0.06
# Share of the samples that obey laws below which faces are not expected to become lawful soon, and
# below which they are not at all: then many samples are not looked at, which takes a minute. On
# lawful bodies it was 0.7 or more. Doubled, no body becomes lawful late.
_LAWLESS, _NEVER_LAWFUL = 0.8, 0.4
# That share of the first labels, before they are revised, below which no face is read: on lawful
# bodies it was 0.27 or more (a plate with fillets), on scans of hands and bottles 0.13 or less.
# Revising takes seven times as long as labelling. Doubled, laws of fillets are found late.
_HOPELESS = 0.2
# Least share of the contours that run over sharp edges, of 35 degrees or more, for faces to be read
# whatever their laws, and for free-form ones to be drawn: it was 0.50 or more on bodies of
# free-form faces with edges, and 0.38 or less on scans without. Doubled, no such body is drawn from
# its faces.
_SHARP = 0.45
# Largest share of the samples of faces beside which such a surface may pass: 0.009 or less on those
# bodies, 0.011 to 0.06 on a wing nut, whose surface kept 42 handles. Doubled, it is drawn.
_CONTRADICTED = 0.01
# Least share of the samples that obey laws for faces to say what no patch knows. On a wing nut of
# 0.3 to 0.5 the surface then had handles. Doubled, only whole bodies of laws are drawn from faces.
_MIXED = 0.5


@dataclass(frozen=True, eq=False)
class KnownLaw:
    """What was found when lawful faces were last looked for.

    Parameters
    ----------
    count : int
        Number of samples then.
    std : float, length
        Standard deviation of a sample then.
    edges : bool
        Whether enough contours run over sharp edges. Without, nothing more was asked.
    share : float
        Fraction of the samples that lawful faces explain; of first labels where that is so little
        that no face was read.
    faces : Faces or None
        The faces that were read, where most of the samples obey laws.
    surface : LawfulBody or None
        What these say of the surface, without those that samples do not determine.
    sharp : bool
        Whether so many contours run over sharp edges that free-form faces are drawn as well.
    """

    count: int = 0
    std: float = 0.0
    edges: bool = False
    share: float = 0.0
    faces: Faces | None = None
    surface: LawfulBody | None = None
    sharp: bool = False

    @cached_property
    def body(self) -> LawfulBody | None:
        """The body, where nearly all faces obey laws; or many contours run over sharp edges, faces
        explain nearly all samples, and their surface passes through these."""
        if self.surface is None:
            return None
        if is_lawful(self.surface.faces) or self.is_one:
            return self.surface
        whole = self.sharp and is_explained(self.surface.faces)
        return self.surface if whole and self.surface.contradicted <= _CONTRADICTED else None

    @property
    def is_one(self) -> bool:
        """Whether all samples are one free-form face."""
        return self.surface is not None and len(self.surface.faces) == 1 and not self.faces

    @property
    def beside(self) -> LawfulBody | None:
        """What faces say where no patch knows the surface, if most obey laws and some do not."""
        return None if self.body else self.surface

    @property
    def is_hopeful(self) -> bool:
        """Whether all faces obey laws, or nearly: more samples may show that they do. The next look
        begins with these faces."""
        return self.faces is not None and (self.share >= _LAWLESS or self.body is not None)

    def is_due(self, count: int) -> bool:
        """Whether to look again with so many samples."""
        if count == self.count:
            return False
        if self.is_one:
            return True
        if self.is_hopeful:
            return count > self.count and (count <= _FEW or count >= _LAWFUL_GROWS * self.count)
        if not self.edges:
            return count >= _EDGELESS_GROWS * self.count
        if self.beside is not None:
            return count >= _LAWLESS_GROWS * self.count
        if self.share < _NEVER_LAWFUL and count > _FEW:
            return False
        return count >= (_LAWLESS_GROWS if count <= _FEW else _HOPELESS_GROWS) * self.count


def look_for_law(
    pool: SamplePool, count: int, std: float, before: KnownLaw = KnownLaw()
) -> KnownLaw:
    """What the first ``count`` samples of a pool show; ``std`` is that of a sample, length.

    Faces are read only where contours run over edges, and where first labels are lawful on some of
    the surface: other bodies are not worth the time.
    """
    samples = samples_of(pool, count, std)
    ends_at_edge = np.asarray(pool.edges[:count])
    if not (before.is_hopeful or share_with_edges(samples, ends_at_edge) >= _WITH_EDGES):
        return one_face(samples)
    if before.is_hopeful:
        found = law_of_faces(faces_of_samples(samples, before=before.faces), samples, before.sharp)
        if found.body or not before.body:
            return found
        # Labels that go on from earlier ones may have ended in a worse place.
        again = law_of_faces(faces_of_samples(samples), samples, before.sharp)
        return again if again.share > found.share else found
    labels = first_labels(samples)
    sharp = share_over_sharp_edges(samples) >= _SHARP
    if labels.lawful_share < _HOPELESS and not sharp:
        return replace(one_face(samples), edges=True, share=labels.lawful_share)
    revise_all(labels)
    return law_of_faces(faces_of_revised(labels), samples, sharp)


def one_face(samples: ContourSamples) -> KnownLaw:
    """All samples as one free-form face."""
    return KnownLaw(len(samples), samples.std, surface=LawfulBody(face_of_all(samples), samples))


def law_of_faces(faces: Faces, samples: ContourSamples, sharp: bool) -> KnownLaw:
    """What faces that were read from samples show, of which many contours ran over ``sharp`` edges
    or not."""
    known = determined(faces, samples)
    share = lawful_share(known)
    lawless = KnownLaw(len(samples), samples.std, True, share)
    if share < _MIXED and not (sharp and is_explained(known)):
        return one_face(samples)
    surface = LawfulBody(known, samples)
    found = replace(lawless, faces=faces, surface=surface, sharp=sharp)
    return found if share >= _MIXED or found.body else one_face(samples)

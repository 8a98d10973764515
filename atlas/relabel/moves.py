"""Moves: propose pieces for some samples, label these again, keep what is shorter to describe.

Proposals drop a label, join two, split one, grow one at a seed, or give one to a rounded edge.
"""

from collections.abc import Iterable, Iterator

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.edges.blunt_edges import blunt_edges, needless_labels, rounding_nats
from touchatlas.atlas.edges.rounded_pair import PiecesAt
from touchatlas.atlas.labels.grow import Evidence, Growth, growths, planes_from
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.labels.scan_lines import pairs_of_runs
from touchatlas.atlas.labels.tried import Tried, is_larger
from touchatlas.atlas.pieces.kinds import CLOSED_FORMS, LABEL_KINDS, Kind
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import evenly

# Root mean square by which a kind of more parameters must follow the samples of a label more
# closely, in deviations of a sample: errors of neighbouring samples are alike.
_BORNE = 0.25
# Least number of samples without a label that hang together for a new seed; samples for each seed.
_CLUSTER, _A_SEED = 6, 40
# Samples of a label from which one of a kind that fits is not tried apart.
_LARGE = 1000


def attempt(
    labels: Labels, members, pieces: Iterable[Piece] = (), some: Iterable[int] = ()
) -> bool:
    """Give samples (m,) new pieces or ``some`` other labels, whichever cost least beside their
    neighbours', or none; keep that where the description becomes shorter."""
    before, known = labels.of, list(labels.pieces)
    labels.pieces = [*known, *pieces]
    names = [*some, *range(len(known), len(labels.pieces))]
    own = np.ones(len(members), bool)
    costs = [labels.costs(labels.pieces[k], members, own) for k in names]
    least = np.argmin([labels.loose[members], *costs], axis=0)
    labels.of = before.copy()
    labels.of[members] = np.array([NONE, *names])[least]
    labels.settle(members, dict.fromkeys(names, members))
    about = set(before[members].tolist()) | set(labels.of[members].tolist())
    after, now = labels.length(members, about - {NONE}), labels.of
    labels.of = before
    if not after < labels.length(members, about - {NONE}):
        labels.pieces = known
        return False
    labels.of = now
    return True


def shortest(evidence: Evidence, members, kinds: Iterable[Kind]) -> Piece | None:
    """The piece of least description for samples (m,) among some kinds, ascending; None where there
    are too few samples for any. A cone and a torus take longest, and are tried where no simpler
    kind fits."""
    best, least = None, np.inf
    for kind in kinds:
        if kind in CLOSED_FORMS and best and evidence.is_good(evidence.nats(best, members)):
            continue
        core = evidence.fitting_core(kind, members)
        piece = evidence.fit(kind, core) if len(core) >= kind.parameters + 2 else None
        if piece is None:
            continue
        cost = float(evidence.nats(piece, core).mean()) * len(members)
        cost += evidence.price(kind, len(members))
        borne = 0.0 if best is None else 0.5 * _BORNE**2 * len(members)
        if cost < least - borne:
            best, least = piece, cost
    return best


def refit(labels: Labels) -> None:
    """Fit each label again to its interior, by the kind of least description up to its own."""
    for label, members in enumerate(labels.all_members()):
        own = labels.pieces[label]
        kinds = [kind for kind in LABEL_KINDS if kind <= own.kind]
        labels.pieces[label] = shortest(labels.evidence, members, kinds) or own


def drop(labels: Labels) -> int:
    """Give the samples of labels to their neighbours', the smallest first; returns how many labels
    were dropped."""
    graph, dropped = labels.evidence.graph, 0
    for label in np.argsort([len(mine) for mine in labels.all_members()], kind="stable").tolist():
        members = labels.members(label)
        if len(members) and not labels.moved.has(members):
            around = np.append(labels.of, NONE)[graph.neighbours[members]]
            others = sorted(set(around.ravel().tolist()) - {NONE, label})
            dropped += attempt(labels, members, some=others)
    return dropped


def join(labels: Labels) -> int:
    """Join linked labels; returns how many."""
    joined = 0
    for a, b in labels.pairs():
        first, second = labels.members(a), labels.members(b)
        if not (len(first) and len(second)) or labels.moved.has_linked(first, second):
            continue
        # A part of a torus that is large enough to show it is no piece of a simpler kind.
        bent = min(labels.pieces[label].kind for label in (a, b)) >= Kind.TORUS
        kinds = LABEL_KINDS if bent else [kind for kind in LABEL_KINDS if kind is not Kind.TORUS]
        joined += join_as_one(labels, first, second, kinds)
    return joined


def join_as_one(labels: Labels, first, second, kinds: Iterable[Kind]) -> bool:
    """Whether one piece explains the samples of two labels, (m,) and (k,), which is kept."""
    evidence, both = labels.evidence, np.sort(np.concatenate([first, second]))
    # A plane, sphere, cylinder or cone is a quadric: where none of the most general kinds explains
    # the samples, no other does.
    general = [kind for kind in kinds if kind in (Kind.QUADRIC, Kind.QUARTIC, Kind.TORUS)]
    if Kind.QUADRIC in general and not any(_may_explain(evidence, k, both) for k in general):
        return False
    piece = shortest(evidence, both, kinds)
    if piece is None or not evidence.is_good(evidence.nats(piece, both)):
        return False
    return attempt(labels, both, [piece])


def _may_explain(evidence: Evidence, kind: Kind, members) -> bool:
    """Whether a piece of a kind explains samples (m,), or these are too few to tell."""
    core = evidence.fitting_core(kind, members)
    if len(core) < kind.parameters + 2:
        return True
    piece = evidence.fit(kind, core)
    return piece is not None and evidence.is_good(evidence.nats(piece, members))


def split(labels: Labels) -> int:
    """Split labels that do not fit, or of so many parameters that fewer may do, into growths inside
    them; returns how many."""
    evidence, done = labels.evidence, 0
    for label, members in enumerate(labels.all_members()):
        piece = labels.pieces[label]
        if len(members) < 30 or labels.moved.has(members):
            continue
        good = evidence.is_good(evidence.nats(piece, members))
        if good and (piece.kind < Kind.QUADRIC or len(members) > _LARGE):
            continue
        most = Kind(piece.kind - 1) if good else piece.kind
        inside = evidence.graph.mask(members)[:-1]
        found = growths(evidence, evenly(members, 10), inside, most, inside)
        if len(found) > 1:
            done += attempt(labels, members, [growth.piece for growth in found])
    return done


def grow(labels: Labels) -> int:
    """New labels that grow from unexplained samples that hang together, where these are densest
    first, and from straight runs of what is left; returns how many."""
    found, loose = 0, (labels.of == NONE) & ~labels.rounded
    for cluster in _clusters(labels, loose):
        seeds = cluster[:: max(1, _A_SEED // 2)][: 2 + len(cluster) // _A_SEED]
        found += _grown(labels, growths(labels.evidence, seeds, loose))
    left = (labels.of == NONE) & ~labels.rounded
    starts = pairs_of_runs(labels.evidence.samples, left)
    return found + _grown(labels, planes_from(labels.evidence, starts, left))


def _grown(labels: Labels, found: list[Growth]) -> int:
    """How many of growths become labels of the samples that have none."""
    done = 0
    for growth in found:
        free = growth.members[labels.of[growth.members] == NONE]
        if len(free) >= growth.piece.kind.parameters + 4:
            done += attempt(labels, free, [growth.piece])
    return done


def _clusters(labels: Labels, loose) -> Iterator[np.ndarray]:
    """Loose samples (n,) that hang together, of each cluster (m,) those first to which most ways
    of two links lead over loose ones; not those that were as many when seeds were last tried."""
    graph, size = labels.evidence.graph, len(loose)
    low, high = graph.pairs[loose[graph.pairs].all(axis=1)].T
    links = coo_matrix((np.ones(len(low)), (low, high)), shape=(size, size))
    _, part = connected_components(links, directed=False)
    once = np.append(loose, False)[graph.neighbours].sum(axis=1) * loose
    amid = np.append(once, 0)[graph.neighbours].sum(axis=1)
    for number in np.flatnonzero(np.bincount(part[loose], minlength=1) >= _CLUSTER):
        members = np.flatnonzero(loose & (part == number))
        before = int(np.count_nonzero(labels.moved.of[members] == NONE))
        if before < _CLUSTER or is_larger(len(members), before):
            yield members[np.argsort(-amid[members], kind="stable")]


def give_to_roundings(labels: Labels) -> int:
    """Give the samples of labels to edges that are rounded; returns how many labels were given."""
    given, offered = 0, labels.of.copy()
    for edge, label in needless_labels(labels):
        members, known = labels.members(label), labels.loose.copy()
        if not len(members):
            continue
        labels.round(members, rounding_nats(edge, PiecesAt(labels, members), (label,)))
        if attempt(labels, members, some=(edge.first, edge.second)):
            given += 1
        else:
            labels.loose = known
    labels.given = Tried(offered)
    return given


def find_roundings(labels: Labels) -> int:
    """Say which samples the roundings of edges explain; returns for how many that is new."""
    before, depends = labels.rounded, (labels.of, tuple(labels.pieces))
    found = labels.evidence.recall.get(lambda: _loose_nats(labels), "roundings", *depends)
    labels.loose = found.copy()
    return int(np.count_nonzero(labels.rounded & ~before))


def _loose_nats(labels: Labels) -> np.ndarray:
    """(n,) nats of each sample without a label, by the roundings of edges."""
    nats, loose = np.full(len(labels.of), labels.evidence.options.unexplained), labels.of == NONE
    at = PiecesAt(labels, np.flatnonzero(loose))
    for edge in blunt_edges(labels):
        nats[loose] = np.minimum(nats[loose], rounding_nats(edge, at))
    return nats

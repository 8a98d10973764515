"""Doubts that samples raise: what they say against patches, faces and rims."""

import numpy as np

from touchatlas.atlas.check.contradictions import claims, contradictions, shift_between
from touchatlas.atlas.check.doubt import Doubt, count_of, extent_of, some_apart
from touchatlas.atlas.known_surface import blend
from touchatlas.atlas.state import AtlasState

# Largest cosine of the normals of two sheets that face away from each other: 120 degrees. Doubled,
# only parallel sheets are compared.
_OPPOSITE = -0.5
# Fraction of the samples that may contradict: good explorations have none. Doubled, one bad
# contact in five hundred is no doubt.
_FEW = 1e-3
# Least fraction of the contradicting distances, as a sum of squares, that one shift of the object
# explains, and least number of them, ten for each of its three numbers. Doubled, few moves are
# told from detail.
_EXPLAINED, _LEAST = 0.5, 30
# Distance of a sample from a face that contradicts it, in deviations: chance gives one in two
# million. Doubled, only gross errors are doubted.
_FAR = 5.0
# Excess of the chi-square of a patch's residuals, in its standard deviations: chance exceeds it in
# one patch of 300,000. Doubled, patches pass that lie between two places of a moved object.
_EXCESS = 4.5
# Least misfit beyond noise that is doubted, in tolerances: less of it the tolerance does not ask
# for. Doubled, what takes up half of a tolerance is no doubt.
_MATTERS = 0.25
# Distance of two sheets below which their triangles may run into each other, in tolerances.
# Doubled, walls are doubted that are drawn right.
_CLOSE = 4.0
# Rounding of exact contacts over the radius: the fit takes noise to be no less.
_ROUNDING = 1e-6


def sample_doubts(atlas: AtlasState) -> list[Doubt]:
    """What the samples of an atlas say against it."""
    if not len(atlas):
        return []
    extent = extent_of(atlas.membership.pool.points)
    if atlas.body is not None:
        return _beside_faces(atlas, extent) + _lost_contact(atlas, extent)
    found = _contradictions(atlas, extent) + _misfits(atlas, extent)
    return found + _close_sheets(atlas, extent) + _lost_contact(atlas, extent)


def _contradictions(atlas: AtlasState, extent: float) -> list[Doubt]:
    """One doubt where samples lie beside patches that claim their place."""
    moved = _moved(atlas, extent)
    if moved:
        return moved
    pool, samples = atlas.membership.pool, np.unique(contradictions(atlas).sample)
    if len(samples) <= _FEW * len(pool):
        return []
    places, share = some_apart(pool.points[samples], extent), len(samples) / len(pool)
    words = (
        f"{share:.1%} of the samples lie more than five deviations beside a patch; there is an "
        "edge, fine detail or a bad contact: touch there again, with shorter arms."
    )
    return [Doubt("contradicting samples", words, places)]


def _moved(atlas: AtlasState, extent: float) -> list[Doubt]:
    """One doubt where a move of the object explains that samples contradict patches."""
    pool, off = atlas.membership.pool, contradictions(atlas, surely=False)
    if len(off.sample) < _LEAST:
        return []
    shift, explained = shift_between(atlas, off)
    if not explained > _EXPLAINED:
        return []
    samples = np.unique(off.sample)
    words = (
        f"{len(samples) / len(pool):.1%} of the samples lie beside patches of other touches as if "
        f"the object had moved by {np.linalg.norm(shift):.3g} or more; fix it, and explore again."
    )
    return [Doubt("moved", words, some_apart(pool.points[samples], extent))]


def _beside_faces(atlas: AtlasState, extent: float) -> list[Doubt]:
    """One doubt where samples lie beside the lawful faces that the surface is drawn from."""
    points = atlas.membership.pool.points
    off = np.abs(blend(atlas, points).distance) > _FAR * atlas.sample_std
    if off.sum() <= _FEW * len(points):
        return []
    words = (
        f"{off.mean():.1%} of the samples lie more than five deviations beside a face; there is an "
        "edge, fine detail or a bad contact: touch there again, with shorter arms."
    )
    return [Doubt("contradicting samples", words, some_apart(points[off], extent))]


def _misfits(atlas: AtlasState, extent: float) -> list[Doubt]:
    """Patches whose samples lie farther off than their noise explains, and than matters."""
    table, rows = atlas.table, atlas.table.rows
    freedom = np.maximum(table.count[rows] - table.basis.size, 1.0)
    noise = np.maximum(table.noise[rows], _ROUNDING * table.radius[rows])
    excess = (table.residual[rows] / noise) ** 2 - 1.0
    bad = excess * np.sqrt(0.5 * freedom) > _EXCESS
    bad = rows[bad & (excess * noise**2 > (_MATTERS * atlas.tolerance) ** 2)]
    if not len(bad):
        return []
    worst = bad[np.argsort(-table.residual[bad])]
    words = (
        f"{count_of(len(bad), 'patch misses its samples', 'patches miss their samples')} by more "
        "than the noise; there is finer detail, or touches do not agree: touch there again, with "
        "shorter arms."
    )
    return [Doubt("misfit", words, some_apart(table.origin[worst], extent))]


def _close_sheets(atlas: AtlasState, extent: float) -> list[Doubt]:
    """Samples close to a patch that faces away from them, or toward them."""
    pool, limit = atlas.membership.pool, _CLOSE * atlas.tolerance
    _, which, found = claims(atlas)
    opposite = (found.numbers[:, 3:] * pool.normals[which]).sum(axis=1) < _OPPOSITE
    # Beyond its cell a polynomial may turn back to any place.
    close = opposite & found.own & (np.abs(found.distance) <= limit)
    places = pool.points[np.unique(which[close])]
    if not len(places):
        return []
    words = (
        f"Two sheets are less than {limit:.3g} apart, and the surface between them is not certain; "
        "give a smaller tolerance, or look there."
    )
    return [Doubt("close sheets", words, some_apart(places, extent))]


def _lost_contact(atlas: AtlasState, extent: float) -> list[Doubt]:
    """Ends of contours at which the surface is drawn to end."""
    count = len(atlas.rims)
    if not count:
        return []
    words = (
        f"The surface ends where {count_of(count, 'contour', 'contours')} lost contact and nothing "
        "was met beyond; where the object goes on, the probe slipped: touch there again."
    )
    places = atlas.rims.unsure(atlas.tolerance)[0]
    if len(places):
        words += " The rim is not known to the tolerance everywhere."
    return [Doubt("lost contact", words, some_apart(places, extent))]

"""Small handles: those that no contour could show are left out, and closed across.

At a thin wall or a sharp edge of a free-form face triangles of both sheets may join in a tunnel or
a curl. It changes the Euler characteristic of a surface that is right elsewhere (Guskov and
Wood, Topological noise removal, 2001).
"""

from functools import cached_property

import igl
import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.mesh.close_holes import LARGEST, close_holes, diameter
from touchatlas.atlas.mesh.short_loops import loops_within
from touchatlas.atlas.records.surface import Surface, manifold
from touchatlas.atlas.samples.rims import Rims

# Largest loop of a handle, and largest region that is closed across, in sizes of the smallest
# handle that stays. Doubled, handles of that size are left out.
_LOOP, _REGION = 2.0, 2.5
# Rounds in which handles are sought: those beside a closed one are seen in the next. Doubled,
# surfaces that are wrong in many places take twice as long.
_ROUNDS = 8


def without_small_handles(surface: Surface, rims: Rims, size: float) -> Surface:
    """The surface with small regions about the short loops of its handles left out, and closed
    across (``close_holes``).

    What would not leave fewer handles, and as many pieces and rims, is not done. The surface must
    be manifold.

    Parameters
    ----------
    surface : Surface
    rims : Rims
        Holes beyond these stay open.
    size : float, length
        Half of the largest loop of a handle that is left out.
    """
    for _ in range(_ROUNDS):
        mended = _mended(surface, rims, size)
        if mended is surface:
            break
        surface = mended
    return surface


def _mended(surface: Surface, rims: Rims, size: float) -> Surface:
    """The surface without the regions about its short loops that hold handles, closed again: all
    that leave fewer handles, and as many pieces and rims."""
    # igl counts no edges of no triangles.
    left = _handles(surface) if len(surface.faces) else 0
    if not left:
        return surface
    ends, found = _ends(surface), _regions_with_handles(surface, size)
    if not found:
        return surface
    mended = _closed(surface, found, rims)
    if _handles(mended) < left and _ends(mended) == ends:
        return mended
    # One of them stays open.
    mended, kept = surface, list[np.ndarray]()
    for region in found:
        trial = _closed(surface, [*kept, region], rims)
        if _handles(trial) < left and _ends(trial) == ends:
            mended, left = trial, _handles(trial)
            kept.append(region)
    return mended


def _regions_with_handles(surface: Surface, size: float) -> list[np.ndarray]:
    """Small regions about the short loops of a surface, apart from each other, that hold handles;
    as indices of triangles."""
    regions, found = _Regions(surface), list[np.ndarray]()
    gone, beside = np.zeros(len(surface.faces), bool), np.zeros(len(surface.faces), bool)
    # Larger holes stay open.
    most = min(_REGION * size, LARGEST * diameter(surface.vertices))
    for loop in loops_within(surface.vertices, surface.faces, min(_LOOP * size, most)):
        region, count = regions.at(loop), 0
        while count < len(region) and regions.span(region) <= most and not beside[region].any():
            whole = regions.with_handles(region, gone, most)
            if whole is not None:
                found.append(whole)
                gone[whole] = True
                beside[regions.about(whole)] = True
                break
            # A region that is all of its piece grows no further.
            region, count = regions.about(region), len(region)
    return found


def _closed(surface: Surface, left_out: list[np.ndarray], rims: Rims) -> Surface:
    """A surface without some regions, closed across."""
    kept = np.ones(len(surface.faces), bool)
    kept[np.concatenate([np.zeros(0, int), *left_out])] = False
    return close_holes(surface.of(surface.faces[kept]), rims)


class _Regions:
    """Sets of triangles of a surface, by their indices."""

    def __init__(self, surface: Surface) -> None:
        self._points, self._faces = surface.vertices, surface.faces
        count = len(surface.faces)
        where = surface.faces.ravel(), np.repeat(np.arange(count), 3)
        self._at = csr_array(
            (np.ones(3 * count, bool), where), shape=(len(surface.vertices), count)
        )
        self._open = np.zeros(len(surface.vertices), bool)
        self._open[[k for loop in igl.boundary_loop_all(surface.faces) for k in loop]] = True

    @cached_property
    def _across(self) -> np.ndarray:
        """(e, 2) triangles beside each inner edge."""
        beside = igl.triangle_triangle_adjacency(self._faces)[0]
        first, side = np.nonzero(beside >= 0)
        pairs = np.stack([first, beside[first, side]], axis=1)
        return np.asarray(pairs[pairs[:, 0] < pairs[:, 1]])

    def at(self, vertices) -> np.ndarray:
        """The triangles at vertices (k,)."""
        return np.unique(self._at[vertices].indices)

    def about(self, region) -> np.ndarray:
        """The triangles of a region (r,), and those at its corners."""
        return self.at(np.unique(self._faces[region]))

    def span(self, region) -> float:
        """Diagonal of the bounding box of a region (r,), length."""
        return diameter(self._points[self._faces[region].ravel()])

    def with_handles(self, region, gone, most: float) -> np.ndarray | None:
        """A region (r,), if fewer handles are left where it is closed across, and otherwise the
        surface stays in as many pieces; with the parts that it would cut off, if all is within
        ``most``, length. Triangles that are ``gone`` (f,) hold nothing together."""
        if self._gain(region) <= 0:
            return None
        kept = ~gone
        kept[region] = False
        pairs = self._across[kept[self._across].all(axis=1)]
        graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(kept),) * 2)
        part = connected_components(graph, directed=False)[1]
        beside = self.about(region)
        parts = np.unique(part[beside[kept[beside]]])
        if not len(parts):
            return None
        sizes = np.bincount(part)[parts]
        small = np.delete(parts, sizes.argmax())
        if not len(small):
            return np.asarray(region)
        region = np.union1d(region, np.flatnonzero(np.isin(part, small)))
        return region if self.span(region) <= most and self._gain(region) > 0 else None

    def _gain(self, region) -> int:
        """By how much the Euler characteristic grows where discs replace a region (r,), one for
        each of its rims; 0 at an opening of the surface."""
        if self._open[self._faces[region]].any():
            return 0
        about = self.about(region)
        beside = np.setdiff1d(about, region)
        before, after = (_characteristic(self._faces[part]) for part in (about, beside))
        return after + self._rims(region, beside) - before

    def _rims(self, region, beside) -> int:
        """Number of rims that a region (r,) leaves in the triangles ``beside`` (b,) it."""
        if not len(beside):
            return 0
        corners = np.zeros(len(self._points), bool)
        corners[self._faces[region]] = True
        faces, index = manifold(self._faces[beside])
        return sum(bool(corners[index[loop]].all()) for loop in igl.boundary_loop_all(faces))


def _characteristic(faces) -> int:
    """V - E + F of triangles (f, 3), each fan of them at a vertex with a vertex of its own."""
    if not len(faces):
        return 0
    faces, index = manifold(faces)
    return len(index) - len(igl.edges(faces)) + len(faces)


def _pieces(surface: Surface) -> int:
    """Number of connected pieces."""
    return int(igl.vertex_components(surface.faces).max(initial=-1)) + 1


def _ends(surface: Surface) -> tuple[int, int]:
    """Numbers of connected pieces and of open rims."""
    return _pieces(surface), len(igl.boundary_loop_all(surface.faces))


def _handles(surface: Surface) -> int:
    """Number of handles of all pieces: V - E + F + boundaries = 2 (pieces - handles)."""
    faces = surface.faces
    used = len(np.unique(faces))
    characteristic = used - len(igl.edges(faces)) + len(faces)
    return _pieces(surface) - (characteristic + len(igl.boundary_loop_all(faces))) // 2

"""Plane sections of a triangle mesh, walked from triangle to triangle."""

import igl
import numpy as np

from touchatlas.patch import ContourEnd
from touchatlas.sim.world.finer_steps import finer_steps, last_steps, whole_steps
from touchatlas.sim.world.triangles import edge_keys


class PlaneSections:
    """The plane sections of a triangle mesh.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int
    """

    def __init__(self, vertices, faces) -> None:
        self.vertices, self.faces = vertices, faces
        self._tree = igl.AABB()
        self._tree.init(vertices, faces)
        self._face_edges, self._edge_faces = _adjacency(faces)

    def arm(self, point, normal, direction, reach, step, max_turn, step_turn):
        """Samples (n, 3) of a section from a point onward, and why it ends; see
        ``MeshObject.trace_arms``."""
        way = self._way_ahead(point, normal, direction, step)
        ahead, open_end = self._walk(point, normal, way, reach + step)
        behind, _ = self._walk(point, normal, 1 - way, step)
        line, lengths = _polyline(point, ahead)
        length = min(float(lengths[-1]), reach)
        samples = _at(line, lengths, step * np.arange(1, whole_steps(length / step) + 1))
        if not len(samples) and open_end:
            return _at(line, lengths, step * last_steps(length / step)), ContourEnd.LOST_CONTACT
        if not len(samples):
            return samples, ContourEnd.TURNED_AWAY
        first = _at(line, lengths, 0.5 * step) - _at(*_polyline(point, behind), 0.5 * step)
        chords = np.diff(np.vstack([point[None], samples]), axis=0)
        cosine = chords @ first / np.sqrt((chords**2).sum(axis=1) * (first @ first))
        turned = cosine < np.cos(max_turn)
        offset = samples - point
        home = ((offset**2).sum(axis=1) < (0.5 * step) ** 2) & (np.arange(len(samples)) > 2)
        whole = length >= reach - 1e-9 * reach
        end = ContourEnd.LENGTH_REACHED if whole else ContourEnd.LOST_CONTACT
        if (turned | home).any():
            stop = int((turned | home).argmax())
            end = ContourEnd.CLOSED_LOOP if home[stop] else ContourEnd.TURNED_AWAY
            samples = samples[:stop]
        samples = np.vstack([point[None], samples])
        at = finer_steps(samples, step_turn, lambda s: _at(line, lengths, step * s))
        if end is ContourEnd.LOST_CONTACT:
            at = np.append(at, last_steps(length / step))
        return _at(line, lengths, step * at[1:]), end

    def _way_ahead(self, point, normal, direction, step) -> int:
        """Which of the two ways out of the first face leads along a direction. At a corner both
        edges may be left at the point itself, so that only the way beyond them tells."""
        walks = [_polyline(point, self._walk(point, normal, way, step)[0]) for way in (0, 1)]
        ends = [_at(line, lengths, 0.5 * step) for line, lengths in walks]
        return int((ends[1] - ends[0]) @ direction > 0.0)

    def _walk(self, point, normal, way, reach):
        """Polyline (k, 3) of the plane section from ``point`` onward by the first or second way out
        of its face, 0 or 1, and whether it ended at a boundary of the mesh."""
        level = (self.vertices - point) @ normal
        face = self._first_face(point, level)
        path, came, here, length = [], -1, point, 0.0
        owners, starts = self._edge_faces
        while length < reach:
            exits = [m for m in self._crossed(face, level) if self._face_edges[face, m] != came]
            if not exits:
                return np.array(path).reshape(-1, 3), False
            side = exits[way] if came < 0 else exits[0]
            edge, crossing = int(self._face_edges[face, side]), self._crossing(face, side, level)
            length += float(np.sqrt(((crossing - here) ** 2).sum()))
            path.append(crossing)
            here, came = crossing, edge
            beyond = [f for f in owners[starts[edge] : starts[edge + 1]] if f != face]
            if not beyond:
                return np.array(path), True
            face = int(beyond[0])
        return np.array(path), False

    def _first_face(self, point, level) -> int:
        """The face of a point that a plane crosses: the nearest one, or, where the plane touches
        only a corner or side of that, the nearest of its neighbours."""
        _, face, _ = self._tree.squared_distance(self.vertices, self.faces, point[None])
        face = int(np.ravel(face)[0])
        if self._crossed(face, level):
            return face
        around = np.flatnonzero(np.isin(self.faces, self.faces[face]).any(axis=1)).tolist()
        crossed = [other for other in around if self._crossed(other, level)]
        return min(crossed, key=lambda f: self._away(f, point, level), default=face)

    def _away(self, face: int, point, level) -> float:
        """Distance of a point from the section of a face."""
        start, end = (self._crossing(face, m, level) for m in self._crossed(face, level))
        along, offset = end - start, point - start
        share = np.clip(offset @ along / max(along @ along, np.finfo(float).tiny), 0.0, 1.0)
        return float(np.linalg.norm(offset - share * along))

    def _crossed(self, face: int, level) -> list[int]:
        """The sides of a face, two or none, that the plane crosses: a corner in it counts as one
        above it (simulation of simplicity; Edelsbrunner and Muecke 1990)."""
        above = level[self.faces[face]] >= 0.0
        return [m for m in range(3) if above[(m + 1) % 3] != above[(m + 2) % 3]]

    def _crossing(self, face: int, side: int, level) -> np.ndarray:
        """(3,) where the plane crosses a side of a face, opposite to the corner of its number."""
        a, b = self.faces[face, (side + 1) % 3], self.faces[face, (side + 2) % 3]
        fraction = level[a] / (level[a] - level[b])
        return self.vertices[a] + fraction * (self.vertices[b] - self.vertices[a])


def _adjacency(faces):
    """Edge ids of each face (f, 3), edge m opposite corner m, and faces of each edge."""
    _, edges = np.unique(edge_keys(faces), return_inverse=True)
    edges = edges.reshape(-1, 3)
    order = np.argsort(edges.ravel(), kind="stable")
    starts = np.searchsorted(edges.ravel()[order], np.arange(edges.max() + 2))
    return edges, (order // 3, starts)


def _polyline(point, path):
    """Corners (k, 3) of a path from a point, and the arc lengths (k,) there."""
    line = np.vstack([point[None], path]) if len(path) else point[None]
    steps = np.sqrt((np.diff(line, axis=0) ** 2).sum(axis=1))
    return line, np.concatenate([[0.0], np.cumsum(steps)])


def _at(line, lengths, at) -> np.ndarray:
    """(..., 3) points of a polyline at arc lengths (...); its end beyond it."""
    return np.stack([np.interp(at, lengths, line[:, i]) for i in range(3)], axis=-1)

"""Atlas: what was touched, and the faces and patches that show its surface, touch by touch."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.body.choose import body_may_wait, look_for_body
from touchatlas.atlas.body.read_faces import read_faces
from touchatlas.atlas.check.free_disc import FreeDisc, free_disc_of
from touchatlas.atlas.check.invariants import violations
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.learn import learn
from touchatlas.atlas.learn_scan import learn_scan
from touchatlas.atlas.mesh.surface import extract_surface, with_fewer_patches
from touchatlas.atlas.records.blend import Blend
from touchatlas.atlas.records.scan import Scan
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.records.touch import AtlasChange, Touch
from touchatlas.atlas.samples.predictive_law import LATEST
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import frozen_array
from touchatlas.patch.words import count_of

if TYPE_CHECKING:
    from k3d.plot import Plot
    from networkx import Graph, MultiGraph
    from trimesh import Trimesh


class Atlas(AtlasState):
    """Samples, and the faces that show their surface; each face has one patch or more.

    Parameters
    ----------
    tolerance : float, length
        Wanted accuracy of the surface.
    options : AtlasOptions
    scale : float, length, optional
        Unit of the options of the fits: see ``AtlasState``.

    Notes
    -----
    The attributes of ``AtlasState`` are for reading, and the methods here change the atlas. Reading
    never changes what is saved. Where touches hold centres of a ball tip, samples and ``body`` are
    of centres, as plans are; faces, patches, surface and files are less the tip.

    Examples
    --------
    The whole loop, with ``robot`` a function from ProbePlan to Touch::

        while (plan := planner.ask(atlas)) is not None:
            touch = robot(plan)
            planner.tell(touch, atlas.add(touch))
        atlas.finish()
    """

    def add(self, measured: Touch | Scan) -> AtlasChange:
        """Learn one touch, or a scan of curves and points: the samples, and the surface that they
        show with all others.

        Returns
        -------
        AtlasChange
            Its ``refused`` says why no samples were entered when the contours are too few or too
            short, or one of them was learned before, or nothing tells the outer side of a scan. The
            way of an approach in vain is learned.

        Raises
        ------
        ValueError
            When the argument is no Touch and no Scan, or its unit is another. Nothing is changed
            then.
        """
        change = self._entered(measured)
        if not change.refused:
            self.catch_up()
        return change

    def add_all(self, touches: Iterable[Touch]) -> tuple[AtlasChange, ...]:
        """Learn touches that are all there: the atlas, byte for byte, that ``add`` makes of one
        after the other, in less time where that is one face. Bodies from which nothing follows are
        not made.

        Parameters
        ----------
        touches : iterable of Touch
            In the order in which they were made.

        Returns
        -------
        tuple of AtlasChange
            One of each. Innovations are those of the last touches alone.

        Raises
        ------
        ValueError
            As of ``add``; the touches before are learned. A touch in another unit is told by a
            body of at least half of the samples before it.
        """
        every, late = list(touches), LATEST
        parts = self, self.pool, self.rims, self.rims.ends
        before = [vars(part).copy() for part in parts]
        while True:
            changes: list[AtlasChange] = []
            try:
                skipped = self._add_some(every, len(every) - late, changes)
            except ValueError:
                # Of the touches before, others are late.
                _restore(parts, before)
                self.add_all(every[: len(changes)])
                raise
            if self.oldest_that_counts >= skipped:
                return tuple(changes)
            # Late ones were refused, and earlier ones count.
            _restore(parts, before)
            late *= 2

    def _add_some(self, touches: list[Touch], early: int, changes: list[AtlasChange]) -> int:
        """Add touches, and to ``changes`` what each changed. What the ``early`` ones show of the
        surface before them does not count. Returns the number of the samples of these and all
        before them."""
        skipped = 0
        for number, touch in enumerate(touches):
            is_late = number >= early
            change = self._entered(touch, is_late)
            skipped = skipped if is_late else len(self.pool)
            own = self.pool, self.sample_std, self.known_body, self.levels
            waits = None if is_late or change.refused else body_may_wait(*own)
            if waits is not None:
                self.known_body = waits
            elif not change.refused:
                self.catch_up()
            changes.append(change)
        self.catch_up()
        return skipped

    def _entered(self, measured: Touch | Scan, is_late: bool = True) -> AtlasChange:
        """What a touch or a scan changed, but for the body."""
        ways = len(self.ways)
        if isinstance(measured, Scan):
            change = learn_scan(self, measured)
        else:
            change = replace(learn(self, measured, is_late), touch=measured.number)
            self.touches += 1
        if not change.refused:
            self.learn_innovations(change.innovations)
        elif len(self.ways) > ways:
            self.know(self.known_body)
        return change

    def blend(self, points) -> Blend:
        """Signed distance, normal, deviation and curvature at points (n, 3), length, world; unknown
        beyond the rims of the surface, and where no sample is near."""
        points, state = frozen_array(points, (None, 3), "points"), self.without_tip
        if state.body is None:
            return Blend.unknown(len(points))
        found, known = state.body.at(points)
        deviation = state.law.deviations(found.deviation)
        curvature = state.body.gaussian_curvature(points, found.face)
        known[known] = ~state.body.beyond(points[known], found.normal[known])
        columns = found.distance, known, found.normal, deviation, curvature, found.face
        return Blend(*columns).without(np.flatnonzero(~known))

    def free_disc(self, surface: Surface | None = None) -> FreeDisc | None:
        """The largest disc without a sample on the surface, as it is extracted: how large a hole
        or a horn may have been missed. None where no surface is known."""
        if self.body is None:
            return None
        surface = extract_surface(self) if surface is None else surface
        return free_disc_of(self.without_tip, surface.vertices[surface.faces])

    def finish(self) -> None:
        """Read the faces once more at the end of an exploration, and make the patches as few as the
        tolerance allows. More touches may be added then; a planner may ask for one, because fewer
        patches are a little less sure in places."""
        known = self.known_body
        if known.looked < self.point_count:
            self.take(look_for_body(self.pool, self.sample_std, known, self.levels, last=True))
        # The surface ends at the rims of this atlas, which tell where it is drawn.
        self.take(with_fewer_patches(self.known_body, self.tolerance))

    def faces(self) -> Faces:
        """The faces of what was touched, each with its kind in words and numbers, and the sharp
        edges and smooth rims between them.

        Samples are labelled again, from the labels of the body on, or anew where it is free-form;
        a body of one law alone gives its face. So ids are those of ``Surface.patch`` as far as the
        labels stay the same.
        """
        bare = self.without_tip
        body = bare.body
        if body is not None and body.is_one_face and body.faces.are_lawful:
            return body.faces
        return read_faces(bare.pool, bare.sample_std, bare.levels, bare.known_body.faces)

    @property
    def graph(self) -> "Graph":
        """The patches as nodes, each in its Darboux frame with its curvatures, and where they meet
        as edges: see ``touchatlas.atlas.body.patch_graph``. That of faces is
        ``faces().graph()``."""
        from touchatlas.atlas.body.patch_graph import patch_graph

        return patch_graph(self.without_tip.body)

    def plot(self, colour: str = "deviation", unit: str = "") -> "Plot":
        """The surface and its samples in three dimensions, for a notebook; the surface is coloured
        by its ``deviation``, up to the tolerance, or by ``face``.

        Returns
        -------
        k3d.plot.Plot
        """
        from touchatlas.atlas.scene import TOUCHED, add_points, add_surface, new_plot

        plot = new_plot(unit)
        if self.body is not None:
            add_surface(plot, extract_surface(self), colour, self.tolerance)
            add_points(
                plot, self.without_tip.pool.points, 0.005 * self.body.extent, "samples", TOUCHED
            )
        return plot

    def to_networkx(self) -> "MultiGraph":
        """The graph of faces, ``faces().graph()``: see ``touchatlas.atlas.faces.face_graph``."""
        return self.faces().graph()

    def to_trimesh(self, edge: float | None = None) -> "Trimesh":
        """The surface as a ``trimesh.Trimesh``: see ``extract_surface`` and
        ``Surface.to_trimesh``."""
        return extract_surface(self, edge).to_trimesh()

    def __repr__(self) -> str:
        """One line: what was touched, and what it shows."""
        words = f"{count_of(self.touches, 'touch')}, {self.point_count:,} samples"
        if (body := self.without_tip.body) is not None:
            kinds = Counter(face.kind for face in body.faces.faces)
            faces = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common())
            words += f", faces: {faces}, {count_of(len(self), 'patch')}"
        return f"<Atlas: {words}, tolerance {self.tolerance:.4g}>"

    def _repr_html_(self) -> str:
        """What is held, with a row for each face."""
        body = self.without_tip.body
        rows = [] if body is None else body.faces.faces
        cells = "".join(f"<tr><td>{f.id}</td><td>{f.words}</td></tr>" for f in rows[:20])
        more = f"<tr><td></td><td>and {len(rows) - 20} more</td></tr>" if len(rows) > 20 else ""
        line = repr(self)[1:-1]
        return f"<div>{line}</div><table><tr><th>face</th><th>what</th></tr>{cells}{more}</table>"

    def validate(self) -> None:
        """Check all invariants: of the samples, of lost ends and ways, and that the surface follows
        from them.

        Raises
        ------
        AssertionError
            Names every invariant that does not hold.
        """
        if broken := violations(self):
            raise AssertionError("; ".join(broken))


def _restore(parts, before: list[dict]) -> None:
    """Give objects the attributes that they had ``before``."""
    for part, own in zip(parts, before, strict=True):
        vars(part).clear()
        vars(part).update(own)

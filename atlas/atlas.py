"""Atlas: a graph of patches that grows touch by touch."""

from dataclasses import replace

from touchatlas.atlas.check.invariants import violations
from touchatlas.atlas.edit.fill import fill
from touchatlas.atlas.edit.finish import finish, refit_all, update_residuals
from touchatlas.atlas.edit.insert import learn
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.faces.known_law import look_for_law
from touchatlas.atlas.faces.read_faces import read_faces
from touchatlas.atlas.field.blend import Blend
from touchatlas.atlas.known_surface import blend
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.records.touch import Touch
from touchatlas.atlas.state import AtlasState


class Atlas(AtlasState):
    """A graph of Darboux-frame patches that share their samples and meet at boundaries.

    Parameters
    ----------
    tolerance : float, length
        Wanted accuracy of the surface.
    options : AtlasOptions

    Notes
    -----
    The attributes of ``AtlasState`` are for reading, and the methods here change the atlas. Reading
    never changes what is saved.

    Examples
    --------
    The whole loop, with ``robot`` a function from ProbePlan to Touch::

        while (plan := planner.ask(atlas)) is not None:
            touch = robot(plan)
            planner.tell(touch, atlas.add(touch))
        atlas.finish()
    """

    def add(self, touch: Touch) -> AtlasChange:
        """Learn one touch: enter a new patch and refine its neighbours.

        Returns
        -------
        AtlasChange
            Its ``refused`` says why nothing was changed when the contours are too few or too short
            for a patch, or one of them was learned before.

        Raises
        ------
        ValueError
            When the argument is no Touch, or its approach is tangent to the surface. Nothing is
            changed then.
        """
        change = learn(self, touch)
        self.touches += 1
        if self.fills and self.known_law.is_due(self.point_count):
            self.look_for_law()
        return replace(change, touch=touch.number)

    def blend(self, points) -> Blend:
        """Signed distance, normal, deviation and curvature at points (n, 3), length, world; unknown
        beyond the rims of the surface. Where all faces obey laws they are those of the faces, and
        the patch is that of the face; where most do, faces say what no patch knows."""
        return blend(self, points)

    def fill(self) -> AtlasChange:
        """Fit patches to the samples that no core covers: for a surface of few touches. Call
        ``refit_all`` before, which improves the patches beside them."""
        return fill(self)

    def refit_all(self) -> None:
        """Refit all patches from all samples about them."""
        refit_all(self)

    def learn_residuals(self) -> int:
        """Learn the detail that polynomials leave out, where the evidence favours it; returns how
        many patches have a residual. A patch that learns from a later touch loses it."""
        return update_residuals(self)

    def look_for_law(self) -> None:
        """Look whether all faces obey laws now; ``add`` does so as the number of samples grows.
        While they do, touches are not filled between: that is done when they no longer do."""
        pool, was_lawful = self.membership.pool, self.body is not None
        self.known_law = look_for_law(pool, len(pool), self.sample_std, self.known_law)
        if was_lawful and self.body is None:
            self.refit_all()
            self.fill()

    def finish(self) -> int:
        """Fill and learn residuals at the end of an exploration, after refitting where touches were
        not filled between; returns how many patches have a residual. Where
        most of the surface obeys laws, faces are read once more. More touches may be added then."""
        law = self.known_law
        is_due = law.is_hopeful or law.beside is not None
        if is_due and law.count < self.point_count:
            self.look_for_law()
        return finish(self)

    def faces(self) -> Faces:
        """The faces of what was touched, each with its kind in words and numbers, and the sharp
        edges and smooth rims between them; read from the samples."""
        law = self.known_law
        before = law.faces if law.is_hopeful else None
        return read_faces(self.membership.pool, self.sample_std, before)

    def validate(self) -> None:
        """Check all invariants: owners of samples, normal equations and their solutions, relations
        between patches, and kept cells and outlines.

        Raises
        ------
        AssertionError
            Names every invariant that does not hold.
        """
        if broken := violations(self):
            raise AssertionError("; ".join(broken))

"""Atlas: the one mutable object, a graph of patches that grows touch by touch."""

from touchatlas.atlas.check.invariants import violations
from touchatlas.atlas.edit.fill import fill
from touchatlas.atlas.edit.finish import finish, refit_all, update_residuals
from touchatlas.atlas.edit.insert import learn
from touchatlas.atlas.edit.merge import merge
from touchatlas.atlas.edit.simplify import simplify
from touchatlas.atlas.edit.split import split
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.records.touch import Touch
from touchatlas.atlas.state import AtlasState


class Atlas(AtlasState):
    """A graph of Darboux-frame patches that share their samples and meet at boundaries.

    Parameters
    ----------
    tolerance : float, length
        How well the surface is wanted.
    options : AtlasOptions

    Notes
    -----
    What an atlas knows is read by the attributes of ``AtlasState``; the methods here change it.
    Reading never changes what is saved.

    Examples
    --------
    The whole loop, with ``robot`` a function from ProbePlan to Touch::

        while (plan := planner.ask(atlas)) is not None:
            touch = robot(plan)
            planner.tell(touch, atlas.add(touch))
        atlas.finish()
    """

    def add(self, touch: Touch) -> AtlasChange:
        """Learn one touch: a new patch, better neighbours.

        Returns
        -------
        AtlasChange
            With ``refused`` set, and nothing changed, when the contours are too few or too
            short for a patch, or one of them was learned before.

        Raises
        ------
        ValueError
            What is no Touch, or an approach tangent to the surface; nothing is changed.
        """
        change = learn(self, touch)
        self.touches += 1
        return change

    def merge(self, first: int, second: int) -> AtlasChange:
        """One patch in the place of two that meet, and of all that it covers, when one polynomial
        holds their samples within the noise; refused otherwise."""
        return merge(self, first, second)

    def split(self, patch_id: int) -> AtlasChange:
        """Patches of half the radius in the place of one: seven, but for those that lie beyond
        edges or have no cell; refused where the samples do not determine all of them."""
        return split(self, patch_id)

    def simplify(self) -> AtlasChange:
        """Merge whatever one patch explains, pair by pair, until nothing more can be."""
        return simplify(self)

    def fill(self) -> AtlasChange:
        """Patches where samples lie between patches, though no touch had its place there: for a
        surface of few touches. After ``refit_all``, which chooses again what they lean on."""
        return fill(self)

    def refit_all(self) -> None:
        """Refit all patches from all they could have learned from, and split those that do not
        hold."""
        refit_all(self)

    def learn_residuals(self) -> int:
        """Detail finer than the patches, where the evidence asks for it; how many have it.

        To be called when the surface is wanted: a patch that learns from a later touch loses its
        residual.
        """
        return update_residuals(self)

    def finish(self) -> int:
        """What an exploration ends with: refit, fill, simplify, learn residuals; how many patches
        have one. Touches may be added afterwards all the same."""
        return finish(self)

    def validate(self) -> None:
        """Prove what must hold: samples belong, equations are their sums, patches solve them,
        relations are mutual, and what was kept of cells and outlines is what follows now.

        Raises
        ------
        AssertionError
            Naming all that does not hold.
        """
        if broken := violations(self):
            raise AssertionError("; ".join(broken))

"""Open CASCADE: edges that are circles but for the lean of a measured axis become circles."""

from touchatlas.atlas.cad.occ_parts import listed


def make_circles(shape, exact: float) -> None:
    """Let ellipses of a shape be circles where both are within ``exact`` (length) of each other.

    A plane cuts a cylinder in an ellipse, whose lesser half axis is the radius; the tolerance of
    the edge becomes the difference of its half axes.
    """
    from OCP.BRep import BRep_Builder, BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepLib import BRepLib
    from OCP.Geom import Geom_Circle
    from OCP.GeomAbs import GeomAbs_Ellipse

    for edge in listed(shape, "Edge"):
        curve = None if BRep_Tool.Degenerated_s(edge) else BRepAdaptor_Curve(edge)
        if curve is None or curve.GetType() != GeomAbs_Ellipse:
            continue
        ellipse = curve.Ellipse()
        off = ellipse.MajorRadius() - ellipse.MinorRadius()
        if off <= exact:
            circle = Geom_Circle(ellipse.Position(), ellipse.MinorRadius())
            BRep_Builder().UpdateEdge(edge, circle, off + BRep_Tool.Tolerance_s(edge))
    BRepLib.UpdateTolerances_s(shape, False)

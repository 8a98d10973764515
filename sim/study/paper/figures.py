"""The paper's figures 4, 5, 6 and 8, drawn from one visit to each stand-in."""

import io

import igl
import numpy as np

from touchatlas.atlas import Touch
from touchatlas.patch import Patch
from touchatlas.sim.study.fits import height_error
from touchatlas.sim.study.paper.fits import (
    CURVES,
    DESCENT,
    OURS,
    PLAIN,
    contours_of,
    data_points,
    fitted,
    judged,
    verifying_points,
)
from touchatlas.sim.study.paper.gauss_maps import gauss_map_of
from touchatlas.sim.study.paper.scenes import (
    Place,
    mouse_back,
    neck,
    plan_at,
    quadrant,
    shoulder,
    touches,
)
from touchatlas.sim.study.paper.sheets import (
    before_patch,
    draw_body,
    draw_sheet,
    draw_triangles,
    eye,
    frame_on,
    lit,
    sheet_of,
)

_PATCH, _SADDLE, _BOWL = "#5b9bd5", "#4878cf", "#ee854a"
# Elevation and azimuth of the eye, degrees.
_ON_BOTTLE, _ON_MOUSE, _CLOSE, _ON_SPHERE = (22, -38), (48, -62), (52, -58), (55, -58)
_FINE_QUADRANT, _FLAT_END = 200, 5


def figures(numbers: dict, seed: int) -> dict[str, bytes]:
    """All figures by file name.

    Parameters
    ----------
    numbers : dict
        Of ``paper_tables``.
    seed : int
        Of the noise of the visits that are drawn.
    """
    place = neck()
    touch = _typical_touch(place, numbers["draws"], np.random.default_rng(seed))
    return {
        "figure4.png": figure4(touch),
        "figure5.png": figure5(place, touch),
        "figure6.png": figure6(numbers["ellipsoid"]),
        "figure8.png": figure8(np.random.default_rng(seed)),
    }


def _typical_touch(place: Place, draws: int, rng) -> Touch:
    """Of many visits the one where (3) errs as in the median."""
    visits = list(touches(place, plan_at(place, CURVES), draws, rng))
    errors = [judged(PLAIN, touch)["verifying"] for touch in visits]
    return visits[int(np.argsort(errors)[draws // 2])]


def _canvas(width: float, height: float):
    # Not through pyplot, whose choice of back end is the caller's own.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _png(figure) -> bytes:
    image = io.BytesIO()
    figure.savefig(image, dpi=110, metadata={"Software": None})
    return image.getvalue()


def _space(figure, where, view, title: str):
    """Axes in space without a box, seen from far."""
    axes = figure.add_subplot(where, projection="3d", proj_type="ortho", computed_zorder=False)
    axes.view_init(*view)
    axes.set_axis_off()
    axes.set_title(title, y=1.0)
    return axes


def _error(patch: Patch, points) -> float:
    return float(np.abs(height_error(patch, points)).mean())


def figure4(touch: Touch) -> bytes:
    """Gauss map of the neck's patch by (3) and by (5)."""
    figure = _canvas(10, 10)
    figure.suptitle(
        "Gauss map of a patch in the bottle's neck: blue where K < 0, orange where K > 0"
    )
    grid = figure.add_gridspec(2, 2)
    for row, fit in enumerate((PLAIN, DESCENT)):
        patch = fitted(fit, touch)
        sheet = sheet_of(patch, data_points(touch))
        areas = gauss_map_of(patch, contours_of(touch))
        local, normals = patch.frame.to_local(sheet.vertices), sheet.normals @ patch.frame.axes.T
        saddle = np.linalg.det(normals[sheet.faces]) < 0.0
        axes = _space(figure, grid[row, 0], _CLOSE, f"the patch by {fit}")
        colours = lit(_BOWL, igl.per_face_normals(local, sheet.faces, np.zeros(3)))
        colours[saddle] = lit(
            _SADDLE, igl.per_face_normals(local, sheet.faces[saddle], np.zeros(3))
        )
        draw_triangles(axes, local, sheet.faces, colours)
        frame_on(axes, local, 1.25)
        title = (
            f"its normals on the unit sphere\nalgebraic area {areas.algebraic_area:.2f}, "
            f"absolute {areas.absolute_area:.2f} sr"
        )
        axes = _space(figure, grid[row, 1], _ON_SPHERE, title)
        _draw_ball(axes)
        _draw_image(axes, normals, ((_SADDLE, sheet.faces[saddle]), (_BOWL, sheet.faces[~saddle])))
    return _png(figure)


def _draw_image(axes, normals, parts) -> None:
    """The Gauss map's image in layers; faint, the seams between smoothed triangles do not show."""
    for layer, (colour, faces) in enumerate(parts, start=2):
        style = {"alpha": 0.3, "antialiased": True, "zorder": layer}
        draw_triangles(axes, normals, faces, colour, **style)


def _draw_ball(axes) -> None:
    """The upper half of the unit sphere as a net."""
    turn, rise = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 49), np.linspace(0.0, 0.5 * np.pi, 13))
    net = np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)
    axes.plot_wireframe(*net, color="0.75", lw=0.5, rstride=2, cstride=4, zorder=1)
    frame_on(axes, np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]]), 1.3)


def figure5(place: Place, touch: Touch) -> bytes:
    """The neck's patch by (5) and by (3), with the points to fit and the points to test."""
    figure = _canvas(15, 5.5)
    grid = figure.add_gridspec(1, 3, width_ratios=(0.7, 1.0, 1.0))
    data, test = data_points(touch), verifying_points(touch)
    axes = _space(figure, grid[0], _ON_BOTTLE, "the patch by (5)\non the neck of the bottle")
    _draw_on_body(axes, place, fitted(DESCENT, touch), data)
    for number, fit in enumerate((DESCENT, PLAIN), start=1):
        patch = fitted(fit, touch)
        errors = (
            f"{_error(patch, data):.3f} mm on white points, {_error(patch, test):.3f} mm on red"
        )
        title = f"({' ab'[number]}) the patch by {fit}\nmean error {errors}"
        axes = _space(figure, grid[number], _CLOSE, title)
        _draw_alone(axes, patch, np.concatenate([data, test]), [(test, "red"), (data, "white")])
    return _png(figure)


def _draw_on_body(axes, place: Place, patch: Patch, data) -> None:
    """A patch on the body; from where the eye is, nothing hides it."""
    draw_body(axes, place.surface)
    sheet = sheet_of(patch, data)
    draw_sheet(axes, sheet.vertices, sheet.faces, _PATCH, zorder=2)
    axes.scatter(*data.T, s=2, color="black", zorder=3)


def _draw_alone(axes, patch: Patch, reached, marked) -> None:
    """A patch in its own frame as far as some points, and marks; those behind a fold are faint."""
    sheet = sheet_of(patch, reached)
    local = patch.frame.to_local(sheet.vertices)
    draw_sheet(axes, local, sheet.faces, _PATCH, zorder=1)
    for points, colour in marked:
        own = patch.frame.to_local(points)
        seen = before_patch(patch, own, eye(axes))
        for part, alpha in ((~seen, 0.15), (seen, 1.0)):
            axes.scatter(
                *own[part].T, s=14, color=colour, edgecolors="black", lw=0.4, alpha=alpha, zorder=2
            )
    frame_on(axes, local, 1.2)


def figure6(rows: list[dict]) -> bytes:
    """Principal curvatures along the ellipsoid's quadrant: exact and as estimated."""
    figure = _canvas(14, 5.2)
    coarse, fine = dict.fromkeys(row["noise_std"] for row in rows)
    exact = np.array([(place.k1, place.k2) for place in quadrant(_FINE_QUADRANT)])
    panels = ((coarse, None), (coarse, _FLAT_END), (fine, _FLAT_END))
    for axes, (noise, count) in zip(figure.subplots(1, 3), panels, strict=True):
        shown = [row for row in rows if row["noise_std"] == noise][:count]
        points = np.array([(row["exact"]["k1"], row["exact"]["k2"]) for row in shown])
        near = exact[(exact >= points.min(axis=0)).all(axis=1)]
        axes.plot(*near.T, color="0.3", lw=1.2, label="exact")
        axes.plot(*points.T, "o", color="0.3", ms=7, mfc="white", label="chosen points")
        for way, name, colour in (("sections", "the paper's sections", "C3"), (OURS, OURS, "C0")):
            _draw_estimates(axes, shown, way, label=name, color=colour)
        part = "(b) the quadrant" if count is None else "(a) its flat end"
        axes.set(title=f"{part}, noise {noise:g}", xlabel="k1", ylabel="k2")
        axes.grid(alpha=0.25)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return _png(figure)


def _draw_estimates(axes, rows: list[dict], way: str, **style) -> None:
    """Means of k1 and k2, with bars of one standard deviation each way."""
    values = np.array(
        [
            [row[way][name][part] for part in ("mean", "std") for name in ("k1", "k2")]
            for row in rows
        ],
        dtype=float,
    )
    k1, k2, k1_std, k2_std = values.T
    axes.errorbar(k1, k2, yerr=k2_std, xerr=k1_std, fmt=".", ms=5, lw=1, **style)


def figure8(rng: np.random.Generator) -> bytes:
    """Convex patches by (5) on the bottle and on the mouse, with the principal axes."""
    figure = _canvas(12, 9)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.2))
    kinds = (("the bottle's shoulder", shoulder, _ON_BOTTLE), ("the mouse", mouse_back, _ON_MOUSE))
    for row, (name, where, view) in enumerate(kinds):
        place = where()
        touch = next(touches(place, plan_at(place, CURVES), 1, rng))
        patch, data = fitted(DESCENT, touch), data_points(touch)
        axes = _space(figure, grid[row, 0], view, f"({'ab'[row]}) {name}")
        _draw_on_body(axes, place, patch, data)
        error = _error(patch, verifying_points(touch))
        title = f"patch by (5), mean error on nine other curves {error:.3f} mm"
        axes = _space(figure, grid[row, 1], _CLOSE, title)
        _draw_alone(axes, patch, data, [(data, "white")])
        _draw_axes(axes, patch)
    return _png(figure)


def _draw_axes(axes, patch: Patch) -> None:
    """The Darboux frame, with what belongs to each axis."""
    known = patch.curvatures
    names = (f"e1: k1 {known.k1:.4f}", f"e2: k2 {known.k2:.4f}", "n")
    for way, name, fraction in zip(np.eye(3), names, (0.9, 0.9, 0.5), strict=True):
        tip = fraction * patch.radius * way
        axes.quiver(*np.zeros(3), *tip, color="black", lw=1.6, arrow_length_ratio=0.08, zorder=3)
        axes.text(*(1.08 * tip), name, zorder=4)

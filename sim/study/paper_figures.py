"""The paper's figures 4, 5, 6 and 8, drawn from one visit to each stand-in."""

from dataclasses import dataclass

import igl
import numpy as np

from touchatlas.patch import Patch
from touchatlas.patch.paper.curvature_on_grid import convex_hull
from touchatlas.sim.study.figures import canvas, image_bytes
from touchatlas.sim.study.fits import height_error
from touchatlas.sim.study.paper import judged
from touchatlas.sim.study.paper_places import (
    CURVES,
    DESCENT,
    OURS,
    PLAIN,
    Place,
    Visit,
    place,
    quadrant,
)
from touchatlas.sim.world.triangles import disc_faces

BLUE, SADDLE, BOWL = "#5b9bd5", "#4878cf", "#ee854a"
# Elevation and azimuth of the eye, degrees.
VIEWS = {"bottle": (22, -38), "mouse": (48, -62), "patch": (52, -58), "sphere": (55, -58)}


@dataclass(frozen=True, eq=False)
class Sheet:
    """Triangles of one patch: vertices (v, 3), length, world; faces (f, 3); normals (v, 3)."""

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray


def sheet_of(patch: Patch, points, rings: int = 45, spokes: int = 160) -> Sheet:
    """A patch over the convex hull of the projection of world points: the paper's domain D."""
    angles = 2.0 * np.pi * np.arange(spokes) / spokes
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    hull = convex_hull(patch.frame.to_local(points)[:, :2]).equations
    toward = ways @ hull[:, :2].T
    with np.errstate(divide="ignore"):
        rim = np.where(toward > 0.0, -hull[:, 2] / toward, np.inf).min(axis=1)
    fractions = np.arange(1, rings + 1) / rings
    flat = (fractions[:, None, None] * rim[:, None] * ways).reshape(-1, 2)
    local = np.pad(flat, ((1, 0), (0, 1)))
    local[:, 2] = -height_error(patch, patch.frame.to_world(local))
    vertices = patch.frame.to_world(local)
    return Sheet(vertices, disc_faces(rings, spokes), patch.normal(vertices))


def before_patch(patch: Patch, points_local, way, steps: int = 200) -> np.ndarray:
    """(n,) whether local points are seen from the direction ``way`` (3,), above the patch: on two
    radii of the way none is deeper under it than a hundredth of the radius."""
    along = points_local + np.linspace(0.0, 2.0 * patch.radius, steps)[:, None, None] * way
    height = patch.signed_distance(patch.frame.to_world(along.reshape(-1, 3)))
    within = (along[..., :2] ** 2).sum(axis=2) <= patch.radius**2
    return ~(within & (height.reshape(within.shape) < -0.01 * patch.radius)).any(axis=0)


def figures(numbers: dict, seed: int) -> dict[str, bytes]:
    """All figures by file name, of the numbers of ``paper_tables``, with a seed of the noise of
    the visits that are drawn."""
    neck, draws = place("neck"), numbers["draws"]
    visits = list(neck.visits(neck.plan(CURVES), draws, np.random.default_rng(seed)))
    errors = [judged(PLAIN, visit)["verifying"] for visit in visits]
    # Where (3) errs as in the median.
    typical = visits[int(np.argsort(errors)[draws // 2])]
    drawn = {
        "figure4.png": figure4(typical),
        "figure5.png": figure5(neck, typical),
        "figure6.png": figure6(numbers["ellipsoid"]),
        "figure8.png": figure8(np.random.default_rng(seed)),
    }
    return {name: image_bytes(figure) for name, figure in drawn.items()}


def _space(figure, where, view: str, title: str):
    """Axes in space without a box, seen from far."""
    axes = figure.add_subplot(where, projection="3d", proj_type="ortho", computed_zorder=False)
    axes.view_init(*VIEWS[view])
    axes.set_axis_off()
    axes.set_title(title, y=1.0)
    return axes


def _triangles(axes, vertices, faces, colours, **style) -> None:
    """Triangles (f, 3) of one or of many colours."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    # Smoothed edges would leave seams between the triangles.
    pieces = Poly3DCollection(vertices[faces], linewidths=0.0, **{"antialiased": False} | style)
    pieces.set_facecolor(colours)
    axes.add_collection3d(pieces)


def _lit(colour, vertices, faces) -> np.ndarray:
    """(f, 4) a colour in the light that falls on triangles; both sides are bright."""
    from matplotlib.colors import to_rgba

    normals = igl.per_face_normals(vertices, faces, np.zeros(3))
    shade = 0.45 + 0.55 * np.abs(normals @ np.array([0.25, -0.45, 0.86]))
    colours = np.tile(to_rgba(colour), (len(normals), 1))
    colours[:, :3] *= np.clip(shade, 0.0, 1.0)[:, None]
    return colours


def _eye(axes) -> np.ndarray:
    """(3,) unit vector toward the eye."""
    up, turn = np.deg2rad([axes.elev, axes.azim])
    return np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])


def _frame_on(axes, points, zoom: float) -> None:
    """Equal scales on all axes, with the points in sight."""
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=zoom)


def _error(patch: Patch, points) -> float:
    return float(np.abs(height_error(patch, points)).mean())


def figure4(visit: Visit):
    """Gauss map of the neck's patch by (3) and by (5)."""
    figure = canvas(10, 10)
    figure.suptitle(
        "Gauss map of a patch in the bottle's neck: blue where K < 0, orange where K > 0"
    )
    grid = figure.add_gridspec(2, 2)
    for row, fit in enumerate((PLAIN, DESCENT)):
        patch = visit.patch(fit)
        sheet, areas = sheet_of(patch, visit.data), visit.gauss_map(patch)
        local, normals = patch.frame.to_local(sheet.vertices), sheet.normals @ patch.frame.axes.T
        saddle = np.linalg.det(normals[sheet.faces]) < 0.0
        axes = _space(figure, grid[row, 0], "patch", f"the patch by {fit}")
        colours = _lit(BOWL, local, sheet.faces)
        colours[saddle] = _lit(SADDLE, local, sheet.faces[saddle])
        _triangles(axes, local, sheet.faces, colours)
        _frame_on(axes, local, 1.25)
        title = (
            f"its normals on the unit sphere\nalgebraic area {areas.algebraic_area:.2f}, "
            f"absolute {areas.absolute_area:.2f} sr"
        )
        axes = _space(figure, grid[row, 1], "sphere", title)
        _draw_ball(axes)
        # In layers; faint, the seams between smoothed triangles do not show.
        for layer, (colour, part) in enumerate(((SADDLE, saddle), (BOWL, ~saddle)), start=2):
            style = {"alpha": 0.3, "antialiased": True, "zorder": layer}
            _triangles(axes, normals, sheet.faces[part], colour, **style)
    return figure


def _draw_ball(axes) -> None:
    """The upper half of the unit sphere as a net."""
    turn, rise = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 49), np.linspace(0.0, 0.5 * np.pi, 13))
    net = np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)
    axes.plot_wireframe(*net, color="0.75", lw=0.5, rstride=2, cstride=4, zorder=1)
    _frame_on(axes, np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]]), 1.3)


def figure5(neck: Place, visit: Visit):
    """The neck's patch by (5) and by (3), with the points to fit and the points to test."""
    figure = canvas(15, 5.5)
    grid = figure.add_gridspec(1, 3, width_ratios=(0.7, 1.0, 1.0))
    data, test = visit.data, visit.verifying
    axes = _space(figure, grid[0], "bottle", "the patch by (5)\non the neck of the bottle")
    _draw_on_body(axes, neck, visit.patch(DESCENT), data)
    for number, fit in enumerate((DESCENT, PLAIN), start=1):
        patch = visit.patch(fit)
        errors = (
            f"{_error(patch, data):.3f} mm on white points, {_error(patch, test):.3f} mm on red"
        )
        title = f"({' ab'[number]}) the patch by {fit}\nmean error {errors}"
        axes = _space(figure, grid[number], "patch", title)
        _draw_alone(axes, patch, np.concatenate([data, test]), [(test, "red"), (data, "white")])
    return figure


def _draw_on_body(axes, spot: Place, patch: Patch, data) -> None:
    """A patch on the body in grey, as far as this faces the eye; nothing hides the patch."""
    vertices, faces = spot.surface.mesh(spot.surface.tolerance)
    seen = faces[igl.per_face_normals(vertices, faces, np.zeros(3)) @ _eye(axes) > 0.0]
    _triangles(axes, vertices, seen, _lit("0.8", vertices, seen), zorder=1)
    _frame_on(axes, vertices, 0.95)
    sheet = sheet_of(patch, data)
    lit = _lit(BLUE, sheet.vertices, sheet.faces)
    _triangles(axes, sheet.vertices, sheet.faces, lit, zorder=2)
    axes.scatter(*data.T, s=2, color="black", zorder=3)


def _draw_alone(axes, patch: Patch, reached, marked) -> None:
    """A patch in its own frame as far as some points, and marks; those behind a fold are faint."""
    sheet = sheet_of(patch, reached)
    local = patch.frame.to_local(sheet.vertices)
    _triangles(axes, local, sheet.faces, _lit(BLUE, local, sheet.faces), zorder=1)
    for points, colour in marked:
        own = patch.frame.to_local(points)
        seen, style = before_patch(patch, own, _eye(axes)), {"edgecolors": "black", "lw": 0.4}
        for part, alpha in ((~seen, 0.15), (seen, 1.0)):
            axes.scatter(*own[part].T, s=14, color=colour, alpha=alpha, zorder=2, **style)
    _frame_on(axes, local, 1.2)


def figure6(rows: list[dict]):
    """Principal curvatures along the ellipsoid's quadrant: exact and as estimated."""
    figure = canvas(14, 5.2)
    coarse, fine = dict.fromkeys(row["noise_std"] for row in rows)
    exact = np.array([(spot.k1, spot.k2) for spot in quadrant(200)])
    panels = ((coarse, None), (coarse, 5), (fine, 5))
    for axes, (noise, count) in zip(figure.subplots(1, 3), panels, strict=True):
        shown = [row for row in rows if row["noise_std"] == noise][:count]
        points = np.array([(row["exact"]["k1"], row["exact"]["k2"]) for row in shown])
        near = exact[(exact >= points.min(axis=0)).all(axis=1)]
        axes.plot(*near.T, color="0.3", lw=1.2, label="exact")
        axes.plot(*points.T, "o", color="0.3", ms=7, mfc="white", label="chosen points")
        for way, name, colour in (("sections", "the paper's sections", "C3"), (OURS, OURS, "C0")):
            k1, k2 = ([row[way][k] for row in shown] for k in ("k1", "k2"))
            (x, dx), (y, dy) = (
                np.array([(one["mean"], one["std"]) for one in k], float).T for k in (k1, k2)
            )
            style = {"fmt": ".", "ms": 5, "lw": 1, "label": name, "color": colour}
            axes.errorbar(x, y, yerr=dy, xerr=dx, **style)
        part = "(b) the quadrant" if count is None else "(a) its flat end"
        axes.set(title=f"{part}, noise {noise:g}", xlabel="k1", ylabel="k2")
        axes.grid(alpha=0.25)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def figure8(rng: np.random.Generator):
    """Convex patches by (5) on the bottle and on the mouse, with the principal axes."""
    figure = canvas(12, 9)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.2))
    kinds = (("the bottle's shoulder", "shoulder", "bottle"), ("the mouse", "mouse", "mouse"))
    for row, (title, where, view) in enumerate(kinds):
        spot = place(where)
        visit = next(spot.visits(spot.plan(CURVES), 1, rng))
        patch = visit.patch(DESCENT)
        axes = _space(figure, grid[row, 0], view, f"({'ab'[row]}) {title}")
        _draw_on_body(axes, spot, patch, visit.data)
        error = _error(patch, visit.verifying)
        words = f"patch by (5), mean error on nine other curves {error:.3f} mm"
        axes = _space(figure, grid[row, 1], "patch", words)
        _draw_alone(axes, patch, visit.data, [(visit.data, "white")])
        # The Darboux frame, with what belongs to each axis.
        known, style = patch.curvatures, {"color": "black", "lw": 1.6, "arrow_length_ratio": 0.08}
        names = (f"e1: k1 {known.k1:.4f}", f"e2: k2 {known.k2:.4f}", "n")
        for way, name, fraction in zip(np.eye(3), names, (0.9, 0.9, 0.5), strict=True):
            tip = fraction * patch.radius * way
            axes.quiver(*np.zeros(3), *tip, zorder=3, **style)
            axes.text(*(1.08 * tip), name, zorder=4)
    return figure

"""The pictures of docs/method.md, one for each formula: `method_pictures.py [FOLDER]`.

Each picture computes what its formula says, with numbers of its own, and is written as SVG to the
folder, docs/method by default. Grounds are transparent and colours of middle brightness, so that
the pictures are legible on light and dark pages.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

FOLDER = Path(__file__).parents[1] / "docs" / "method"
GREY, BLUE, ORANGE, GREEN, RED = "#7d8590", "#3f8fd6", "#d9822b", "#3fa368", "#d65c5c"
STYLE = {
    "font.size": 9,
    "font.family": "sans-serif",
    "svg.fonttype": "none",
    "svg.hashsalt": "touchatlas",
    "text.color": GREY,
    "axes.edgecolor": GREY,
    "axes.labelcolor": GREY,
    "axes.titlesize": 9,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "legend.frameon": False,
}


def panels(count: int, height: float = 2.3):
    """A figure with a row of bare panels."""
    figure = Figure(figsize=(3.0 * count, height), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, count))
    for ax in axes:
        ax.set_axis_off()
    return figure, axes


def sample() -> Figure:
    """Three sampling planes through a contact, their contours, and normals of samples."""
    figure = Figure(figsize=(4.4, 2.9), layout="constrained")
    ax = figure.add_subplot(projection="3d", computed_zorder=False)
    ax.set_axis_off()
    for turn, colour in zip(np.deg2rad([0.0, 60.0, 120.0]), (BLUE, ORANGE, GREEN), strict=True):
        along = np.array([np.cos(turn), np.sin(turn)])
        s = np.linspace(-1.0, 1.0, 60)
        x, y = np.outer(along, s)
        ax.plot(x, y, height(x, y), color=colour, lw=1.0)
        s = np.linspace(-1.0, 1.0, 9)
        x, y = np.outer(along, s)
        z = height(x, y)
        ax.scatter(x, y, z, color=colour, s=9)
        normal = np.stack([-slope(x, y)[0], -slope(x, y)[1], np.ones_like(x)])
        normal *= 0.28 / np.linalg.norm(normal, axis=0)
        ax.quiver(x, y, z, *normal, color=colour, lw=0.8, arrow_length_ratio=0.25)
        corners = np.array([[-1.1, -0.9], [1.1, -0.9], [1.1, 0.35], [-1.1, 0.35], [-1.1, -0.9]])
        ax.plot(*np.outer(along, corners[:, 0]), corners[:, 1], color=colour, lw=0.5, ls=":")
    ax.scatter(0.0, 0.0, 0.0, color=GREY, s=30, zorder=5)
    ax.text(0.05, 0.05, 0.42, "contact", color=GREY)
    ax.view_init(26, -86)
    ax.patch.set_alpha(0.0)
    ax.set_box_aspect((1.0, 1.0, 0.55), zoom=1.35)
    return figure


def height(x, y):
    return -0.45 * x**2 - 0.25 * y**2


def slope(x, y):
    return -0.9 * x, -0.5 * y


def distance() -> Figure:
    """Lines of equal F, and of equal first-order distance F / |grad F|, about a parabola."""
    figure, axes = panels(2)
    x, z = np.meshgrid(np.linspace(-1.6, 1.6, 97), np.linspace(-1.6, 0.9, 76))
    value = z + 0.6 * x**2
    steep = np.sqrt(1.0 + (1.2 * x) ** 2)
    levels = [-0.4, -0.2, 0.2, 0.4]
    for ax, field, title in zip(axes, (value, value / steep), ("F", "F / |∇F|"), strict=True):
        ax.contour(x, z, field, levels, colors=ORANGE, linewidths=0.9, linestyles="solid")
        ax.contour(x, z, value, [0.0], colors=BLUE, linewidths=1.8)
        at = np.linspace(-1.6, 1.6, 161)
        foot = np.stack([at, -0.6 * at**2])
        normal = np.stack([1.2 * at, np.ones_like(at)]) / np.sqrt(1.0 + (1.2 * at) ** 2)
        for level in levels:
            ax.plot(*(foot + level * normal), color=GREY, lw=0.8, ls=":")
        ax.set_title(f"{title} = ±0.2, ±0.4", color=GREY)
        ax.set(xlim=(-1.5, 1.5), ylim=(-1.5, 0.8), aspect="equal")
    axes[0].text(-1.45, 0.55, "dotted: the true distance")
    axes[0].text(-0.35, -0.28, "F = 0", color=BLUE)
    return figure


def description() -> Figure:
    """Nats of a circular arc explained by polynomials of more and more coefficients."""
    figure = Figure(figsize=(4.4, 2.5), layout="constrained")
    ax = figure.subplots()
    rng, count, noise = np.random.default_rng(0), 60, 0.004
    x = np.linspace(-0.8, 0.8, count)
    z = np.sqrt(1.0 - x**2) + noise * rng.normal(size=count)
    sizes = np.arange(1, 11)
    misfit = np.empty(len(sizes))
    for k, size in enumerate(sizes):
        rest = z - np.polyval(np.polyfit(x, z, size - 1), x)
        misfit[k] = np.minimum(0.5 * (rest / noise) ** 2, 6.0).sum()
    price = 0.5 * sizes * np.log(count)
    ax.bar(sizes, misfit, color=BLUE, width=0.6, label="misfit, ½ min(d²/σ², 12)")
    ax.bar(sizes, price, bottom=misfit, color=ORANGE, width=0.6, label="parameters, ½ p ln n")
    best = (misfit + price).argmin()
    ax.plot(sizes[best], (misfit + price)[best] + 20.0, marker="v", color=GREEN, ms=7)
    ax.set(xlabel="parameters p of the polynomial", ylabel="nats", xticks=sizes)
    ax.legend(labelcolor=GREY)
    ax.spines[["top", "right"]].set_visible(False)
    ax.patch.set_alpha(0.0)
    return figure


# An L in section: its six sides as (level, along x or y, sign of the outside, range).
L_SHAPE = [
    ("y", 0.0, -1.0, (0.0, 3.0)),
    ("x", 3.0, 1.0, (0.0, 1.0)),
    ("y", 1.0, 1.0, (1.2, 3.0)),
    ("x", 1.2, 1.0, (1.0, 2.2)),
    ("y", 2.2, 1.0, (0.0, 1.2)),
    ("x", 0.0, -1.0, (0.0, 2.2)),
]


def votes() -> Figure:
    """Extended faces divide space into cells; samples vote for the two cells at their face."""
    figure, axes = panels(2, 2.6)
    xs, ys = [-0.6, 0.0, 1.2, 3.0, 3.6], [-0.6, 0.0, 1.0, 2.2, 2.8]
    inside = np.zeros((4, 4), int)
    for axis, level, sign, (low, high) in L_SHAPE:
        for at in np.linspace(low, high, 8)[1:-1]:
            for side in (-1.0, 1.0):
                place = (at, level + side * 1e-3) if axis == "y" else (level + side * 1e-3, at)
                column = np.searchsorted(xs, place[0]) - 1
                row = np.searchsorted(ys, place[1]) - 1
                inside[row, column] += 1 if side * sign < 0.0 else -1
    for ax in axes:
        for x in xs[1:-1]:
            ax.plot([x, x], [ys[0], ys[-1]], color=GREY, lw=0.6, ls=":")
        for y in ys[1:-1]:
            ax.plot([xs[0], xs[-1]], [y, y], color=GREY, lw=0.6, ls=":")
        ax.set(aspect="equal")
    for axis, level, sign, (low, high) in L_SHAPE:
        at = np.linspace(low, high, 8)[1:-1]
        flat = np.full_like(at, level)
        x, y = (at, flat) if axis == "y" else (flat, at)
        axes[0].plot(x, y, ".", color=BLUE, ms=4)
        arrow = 0.22 * sign * np.ones_like(at)
        zero = np.zeros_like(at)
        u, v = (zero, arrow) if axis == "y" else (arrow, zero)
        axes[0].quiver(x, y, u, v, color=BLUE, angles="xy", scale_units="xy", scale=1.0, width=5e-3)
    for row in range(4):
        for column in range(4):
            count = inside[row, column]
            if not count:
                continue
            low, high = (xs[column], ys[row]), (xs[column + 1], ys[row + 1])
            colour = GREEN if count > 0 else ORANGE
            axes[1].fill_between([low[0], high[0]], low[1], high[1], color=colour, alpha=0.30, lw=0)
            middle = 0.5 * (np.array(low) + high)
            axes[1].text(*middle, f"{count:+d}", ha="center", va="center", color=colour)
    axes[0].set_title("samples, outward normals, extended faces", color=GREY)
    axes[1].set_title("votes: inside (+), outside (−)", color=GREY)
    return figure


def combination() -> Figure:
    """The larger of two distances, the smaller of them, and the larger one rolled by a ball."""
    figure, axes = panels(3)
    x, y = np.meshgrid(np.linspace(-1.5, 0.9, 97), np.linspace(-1.5, 0.9, 97))
    radius = 0.7
    u, v = np.maximum(x + radius, 0.0), np.maximum(y + radius, 0.0)
    rolled = np.where((u > 0.0) & (v > 0.0), np.hypot(u, v) - radius, np.maximum(x, y))
    fields = np.maximum(x, y), np.minimum(x, y), rolled
    titles = "convex edge: max(a, b)", "concave edge: min(a, b)", "blunt edge: a ball of radius r"
    for ax, field, title in zip(axes, fields, titles, strict=True):
        ax.contourf(x, y, field, [-9.0, 0.0], colors=[BLUE], alpha=0.25)
        levels = [-0.6, -0.3, 0.3, 0.6]
        ax.contour(x, y, field, levels, colors=ORANGE, linewidths=0.8, linestyles="solid")
        ax.contour(x, y, field, [0.0], colors=BLUE, linewidths=1.8)
        ax.set_title(title, color=GREY)
        ax.set(aspect="equal")
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    axes[2].plot(
        *(radius * np.stack([np.cos(turn), np.sin(turn)]) - radius), color=GREY, lw=0.8, ls=":"
    )
    axes[2].plot([-radius, 0.0], [-radius, -radius], color=GREY, lw=0.8)
    axes[2].text(-0.42, -0.66, "r")
    return figure


def unity() -> Figure:
    """Overlapping polynomials of a curve, their weights, and their mean."""
    figure = Figure(figsize=(4.8, 3.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 1.0])
    x = np.linspace(0.0, 3.0, 181)
    rng, radius, reach = np.random.default_rng(3), 0.9, 0.9 * 0.9
    at = np.sort(rng.uniform(0.0, 3.0, 34))
    z = np.sin(2.2 * at) + 0.2 * rng.normal(size=len(at))
    total, mean = np.zeros_like(x), np.zeros_like(x)
    for middle, colour in zip(np.linspace(0.2, 2.8, 5), (BLUE, ORANGE, GREEN) * 2, strict=False):
        near = np.abs(at - middle) < radius
        own = np.polyfit(at[near] - middle, z[near], 3)
        weight = np.maximum(1.0 - ((x - middle) / reach) ** 2, 0.0) ** 3
        shown = weight > 0.0
        total, mean = total + weight, mean + weight * np.polyval(own, x - middle)
        upper.plot(x[shown], np.polyval(own, x[shown] - middle), color=colour, lw=0.9)
        lower.plot(x, weight, color=colour, lw=0.9)
    upper.plot(at, z, ".", color=GREY, ms=3.5)
    upper.plot(x, mean / np.maximum(total, 1e-9), color=RED, lw=2.0, label="mean")
    upper.set(ylim=(-1.5, 1.5), ylabel="height")
    upper.legend(labelcolor=GREY)
    lower.set(ylabel="weight", xlabel="along the surface")
    for ax in (upper, lower):
        ax.spines[["top", "right"]].set_visible(False)
        ax.patch.set_alpha(0.0)
    return figure


def variance() -> Figure:
    """A polynomial with a prior, fitted to two groups of samples, and its predicted interval."""
    figure = Figure(figsize=(4.8, 2.6), layout="constrained")
    ax = figure.subplots()
    rng, noise = np.random.default_rng(1), 0.03
    at = np.concatenate([rng.uniform(-1.0, -0.7, 9), rng.uniform(0.35, 0.6, 9)])
    x = np.linspace(-1.05, 1.15, 111)
    z = np.cos(2.0 * at) + noise * rng.normal(size=len(at))
    precision = np.array([9.0, 9.0, 1.0, 0.25, 0.25, 0.25, 0.25]) ** -1.0
    rows = at[:, None] ** np.arange(7)
    covariance = np.linalg.inv(rows.T @ rows / noise**2 + np.diag(precision))
    mean = covariance @ rows.T @ z / noise**2
    shown = x[:, None] ** np.arange(7)
    deviation = np.sqrt(((shown @ covariance) * shown).sum(axis=1))
    middle = shown @ mean
    band = middle - 1.96 * deviation, middle + 1.96 * deviation
    ax.fill_between(x, *band, color=BLUE, alpha=0.25, lw=0, label="±1.96 s")
    ax.plot(x, middle, color=BLUE, lw=1.6, label="φ")
    ax.plot(x, np.cos(2.0 * x), color=GREY, lw=0.9, ls="--", label="truth")
    ax.plot(at, z, ".", color=ORANGE, ms=5, label="samples")
    ax.set(ylim=(-1.4, 2.2), xlabel="x / ρ", ylabel="z / ρ")
    ax.legend(labelcolor=GREY, ncols=2, loc="upper left")
    ax.spines[["top", "right"]].set_visible(False)
    ax.patch.set_alpha(0.0)
    return figure


PICTURES = (sample, distance, description, votes, combination, unity, variance)


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for draw in PICTURES:
        with mpl.rc_context(STYLE):
            path = folder / f"{draw.__name__}.svg"
            draw().savefig(path, transparent=True, metadata={"Date": None})
        print(f"{path.name}: {path.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)

"""Curves of a run as a picture in a page, which follows its light or dark."""

from html import escape

import numpy as np

_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP = 360, 190, 52, 34, 26


def chart(title: str, series: dict[str, list[float | None]], unit: str = "", top=None) -> str:
    """An SVG of values touch by touch; None where there is no value.

    A logarithmic axis where all values are above zero and ``top`` is not given. The line of class
    ``now`` stands at the touch that is looked at: the page moves it.
    """
    found = [v for values in series.values() for v in values if v is not None and np.isfinite(v)]
    count = max((len(values) for values in series.values()), default=1)
    if not found:
        return ""
    log = top is None and min(found) > 0.0
    low, high = (np.log10(min(found)), np.log10(max(found))) if log else (0.0, top or max(found))
    low, high = (float(low), float(high)) if high > low else (float(low), float(low) + 1.0)

    def x(i: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - 12) * i / max(count - 1, 1)

    def y(value: float) -> float:
        value = float(np.log10(value)) if log else value
        return _HEIGHT - _BOTTOM - (_HEIGHT - _BOTTOM - _TOP) * (value - low) / (high - low)

    lines = []
    for place in (low, 0.5 * (low + high), high):
        value = 10.0**place if log else place
        at = y(value)
        lines.append(f'<line class="grid" x1="{_LEFT}" x2="{_WIDTH - 12}" y1="{at}" y2="{at}"/>')
        lines.append(f'<text x="{_LEFT - 6}" y="{at + 4}" text-anchor="end">{_short(value)}</text>')
    for i, (name, values) in enumerate(series.items()):
        points = [(x(k), y(v)) for k, v in enumerate(values) if v is not None and np.isfinite(v)]
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in points)
        lines.append(f'<polyline class="curve c{i}" points="{path}"/>')
        lines.append(f'<text class="c{i}" x="{_LEFT + 8 + 150 * i}" y="14">{escape(name)}</text>')
    unit = f" ({escape(unit)})" if unit else ""
    axis = _HEIGHT - _BOTTOM
    return (
        f'<figure><figcaption>{escape(title)}{unit}</figcaption><svg viewBox="0 0 {_WIDTH} '
        f'{_HEIGHT}" data-from="{x(0)}" data-to="{x(count - 1)}">{"".join(lines)}'
        f'<line class="now" x1="{_LEFT}" x2="{_LEFT}" y1="{_TOP}" y2="{axis}"/>'
        f'<text x="{_LEFT}" y="{_HEIGHT - 18}">1</text>'
        f'<text x="{_WIDTH - 12}" y="{_HEIGHT - 18}" text-anchor="end">{count}</text>'
        f'<text x="{0.5 * (_WIDTH + _LEFT)}" y="{_HEIGHT - 6}" text-anchor="middle">touches</text>'
        "</svg></figure>"
    )


def _short(value: float) -> str:
    """A number with two digits, or as a whole one."""
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.2g}"

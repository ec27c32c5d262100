"""Histograms as SVG, without other packages."""

from __future__ import annotations

from html import escape

import numpy as np

_width, _height, _top, _bars = 280, 120, 26, 24


def histogram(columns: dict[str, list[float]]) -> str:
    """One picture of some histograms beside each other, on logarithmic axes where values allow that."""
    panels = [_panel(name, values, i) for i, (name, values) in enumerate(columns.items()) if values]
    rows = (len(panels) + 2) // 3
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{3 * (_width + 40)}" '
        f'height="{rows * (_height + 70) + 10}" font-family="sans-serif" font-size="12">'
        '<rect width="100%" height="100%" fill="white"/>' + "".join(panels) + "</svg>\n"
    )


def _panel(name: str, values: list[float], at: int) -> str:
    array = np.asarray(values)
    logarithmic = bool(array.min() > 0 and array.max() > 10 * array.min())
    scaled = np.log10(array) if logarithmic else array
    low, high = float(scaled.min()), float(scaled.max())
    if low == high:
        low, high = low - 0.5, high + 0.5
    counts, edges = np.histogram(scaled, _bars, (low, high))
    x, y = 20 + at % 3 * (_width + 40), 10 + at // 3 * (_height + 70)
    bars = "".join(
        f'<rect x="{x + i * _width / _bars:.1f}" y="{y + _top + _height * (1 - count / counts.max()):.1f}" '
        f'width="{_width / _bars - 1:.1f}" height="{_height * count / counts.max():.1f}" fill="#3465a4">'
        f"<title>{count:,}</title></rect>"
        for i, count in enumerate(counts)
    )
    shown = [10.0**e if logarithmic else e for e in (float(edges[0]), float(edges[-1]))]
    base = y + _top + _height
    return (
        f'<text x="{x}" y="{y + 16}" font-weight="bold">{escape(name)}{" (log)" if logarithmic else ""}</text>'
        f"{bars}"
        f'<line x1="{x}" y1="{base + 0.5}" x2="{x + _width}" y2="{base + 0.5}" stroke="#555"/>'
        f'<text x="{x}" y="{base + 16}">{shown[0]:.4g}</text>'
        f'<text x="{x + _width}" y="{base + 16}" text-anchor="end">{shown[1]:.4g}</text>'
        f'<text x="{x + _width // 2}" y="{base + 32}" text-anchor="middle" fill="#555">{len(values):,} meshes, '
        f"at most {counts.max():,} a bar</text>"
    )

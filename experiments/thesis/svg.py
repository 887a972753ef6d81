"""Pictures as SVG for the page: lines over axes, and discs; light and dark by CSS."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

Data = Mapping[str, Any]
WIDTH, HEIGHT = 460.0, 250.0
LEFT, RIGHT, TOP, BOTTOM = 52.0, 10.0, 10.0, 36.0
TICKS = 5  # on an axis, about
ROOM = 0.05  # of the range, above and below
COLOURS = 6  # series of the style sheet
DASHES = ("", "6 3", "2 3", "8 3 2 3")


def svg(picture: Data) -> str:
    """Draw a picture; every text is escaped."""
    span_x, span_y = _spans(picture)
    place = _Placed(span_x, span_y)
    parts = [
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" '
        f'aria-label="{escape(picture["title"])}">'
    ]
    parts += _axes(picture, place)
    parts += [_disc(disc, place) for disc in picture["discs"]]
    parts += [_point(x, y, place) for x, y in picture["points"]]
    parts += [_line(k, one, place) for k, one in enumerate(picture["series"])]
    return "\n".join([*parts, "</svg>"])


def key(picture: Data) -> list[tuple[int, str, str]]:
    """List (colour, dash, name) of the lines."""
    return [
        (k % COLOURS, DASHES[k % len(DASHES)], str(one["name"]))
        for k, one in enumerate(picture["series"])
    ]


class _Placed:
    """Turns numbers into places on the drawing."""

    def __init__(self, x: tuple[float, float], y: tuple[float, float]) -> None:
        self.span_x, self.span_y = x, y
        self.per_x = (WIDTH - LEFT - RIGHT) / (x[1] - x[0])
        self.per_y = (HEIGHT - TOP - BOTTOM) / (y[1] - y[0])

    def x(self, value: float) -> float:
        """Give the place across."""
        return LEFT + (value - self.span_x[0]) * self.per_x

    def y(self, value: float) -> float:
        """Give the place down."""
        return HEIGHT - BOTTOM - (value - self.span_y[0]) * self.per_y


def _spans(picture: Data) -> tuple[tuple[float, float], tuple[float, float]]:
    """Find the ranges of both axes."""
    xs = [x for one in picture["series"] for x in one["x"]]
    ys = [y for one in picture["series"] for y in one["y"]]
    for s, l, radius in picture["discs"]:
        xs += [s - radius, s + radius]
        ys += [l - radius, l + radius]
    xs += [x for x, _ in picture["points"]]
    ys += [y for _, y in picture["points"]]
    return _span(xs), _span(ys)


def _span(values: Sequence[float]) -> tuple[float, float]:
    """Give a range with some room; never an empty one."""
    low, high = min(values, default=0.0), max(values, default=1.0)
    room = ROOM * (high - low) or 0.5
    return low - room, high + room


def ticks(low: float, high: float) -> list[float]:
    """Choose round numbers inside a range."""
    rough = (high - low) / TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * m for m in (1.0, 2.0, 5.0, 10.0) if power * m >= rough)
    first, last = math.ceil(low / step), math.floor(high / step)
    return [k * step for k in range(first, last + 1)]


def _axes(picture: Data, place: _Placed) -> list[str]:
    """Draw grid, numbers and names."""
    parts = []
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    for value in ticks(*place.span_x):
        x = place.x(value)
        parts.append(_rule(x, TOP, x, bottom))
        parts.append(_text(x, bottom + 14.0, f"{value:.6g}", "middle"))
    for value in ticks(*place.span_y):
        y = place.y(value)
        parts.append(_rule(LEFT, y, right, y))
        parts.append(_text(LEFT - 5.0, y + 4.0, f"{value:.6g}", "end"))
    parts.append(_text(0.5 * (LEFT + right), HEIGHT - 5.0, picture["x"], "middle"))
    middle = 0.5 * (TOP + bottom)
    turned = f'transform="rotate(-90 12 {middle:g})"'
    parts.append(_text(12.0, middle, picture["y"], "middle", turned))
    return parts


def _rule(x1: float, y1: float, x2: float, y2: float) -> str:
    """Draw a line of the grid."""
    ends = f'x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"'
    return f'<line class="rule" {ends}/>'


def _text(x: float, y: float, words: str, anchor: str, more: str = "") -> str:
    """Write something."""
    at = f'x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {more}'
    return f"<text {at}>{escape(words)}</text>"


def _disc(disc: Sequence[float], place: _Placed) -> str:
    """Draw an obstacle; the axes have different scales."""
    s, l, radius = disc
    radii = f'rx="{radius * place.per_x:.1f}" ry="{radius * place.per_y:.1f}"'
    return (
        f'<ellipse class="disc" cx="{place.x(s):.1f}" cy="{place.y(l):.1f}" {radii}/>'
    )


def _point(x: float, y: float, place: _Placed) -> str:
    """Draw a point."""
    return (
        f'<circle class="point" cx="{place.x(x):.1f}" cy="{place.y(y):.1f}" r="1.8"/>'
    )


def _line(k: int, one: Data, place: _Placed) -> str:
    """Draw one series."""
    points = " ".join(
        f"{place.x(x):.1f},{place.y(y):.1f}"
        for x, y in zip(one["x"], one["y"], strict=True)
    )
    dash = DASHES[k % len(DASHES)]
    pattern = f' stroke-dasharray="{dash}"' if dash else ""
    colour = f"var(--series-{k % COLOURS})"
    return f'<polyline class="way" style="stroke:{colour}"{pattern} points="{points}"/>'

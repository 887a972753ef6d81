"""From straight lines, clothoids and arcs to the polylines that SUMO's edges take.

`python -m sumo_nets.centre_line --start 0 0 0 "line 40" "arc 62.83 0.05"` prints the
value of an edge's `shape`; with `--offset 10 --reverse` that of the oncoming
carriageway.
"""

import argparse
import sys
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sumo_nets.errors import NetworkError

FloatArray = NDArray[np.float64]

# (kind, length [m], curvature at the begin, curvature at the end [1/m])
Segment = tuple[str, float, float, float]

# How many numbers follow the kind of a segment.
NUMBERS = {"line": 1, "arc": 2, "clothoid": 3}

# Eight Gauss points over a piece that turns less than 0.1 rad: exact to rounding.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


def line(length: float) -> Segment:
    """Build a straight segment of `length` [m]."""
    return ("line", float(length), 0.0, 0.0)


def arc(length: float, curvature: float) -> Segment:
    """Build a circular arc; `curvature` [1/m] is positive to the left."""
    return ("arc", float(length), float(curvature), float(curvature))


def clothoid(length: float, begin: float, end: float) -> Segment:
    """Build a segment whose curvature [1/m] grows linearly from `begin` to `end`."""
    return ("clothoid", float(length), float(begin), float(end))


def parse_segment(text: str) -> Segment:
    """Read "line 40", "arc 62.83 0.05" or "clothoid 15 0 0.0167".

    Raises:
        NetworkError: If the kind is unknown or the numbers do not fit it.
    """
    kind, *words = text.split() or [""]
    if len(words) != NUMBERS.get(kind):
        raise NetworkError(
            f'"{text}" is invalid; allowed: "line LENGTH", "arc LENGTH CURVATURE", '
            '"clothoid LENGTH CURVATURE CURVATURE"'
        )
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        raise NetworkError(f'"{text}": {error}') from error
    if numbers[0] <= 0.0:
        raise NetworkError(f'"{text}": the length must be > 0 m')
    if kind == "line":
        return line(numbers[0])
    if kind == "arc":
        return arc(numbers[0], numbers[1])
    return clothoid(numbers[0], numbers[1], numbers[2])


def sample(
    segments: Sequence[Segment],
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    spacing: float = 1.0,
) -> FloatArray:
    """Sample the poses along `segments`.

    Args:
        segments: At least one segment.
        start: x, y [m] and heading [rad] of the first pose.
        spacing: Largest arc length between poses [m]; ends of segments are poses.

    Returns:
        Rows (s, x, y, heading, curvature), (n, 5).
    """
    x, y, heading = start
    s = 0.0
    rows = [(s, x, y, heading, segments[0][2])]
    for _, length, begin, end in segments:
        pieces = max(1, int(np.ceil(length / spacing - 1e-9)))
        step = length / pieces
        rate = (end - begin) / length
        for piece in range(pieces):
            at = piece * step + 0.5 * step * (1.0 + _NODES)
            turned = heading + begin * at + 0.5 * rate * at**2
            x += 0.5 * step * float(_WEIGHTS @ np.cos(turned))
            y += 0.5 * step * float(_WEIGHTS @ np.sin(turned))
            done = (piece + 1) * step
            bearing = heading + begin * done + 0.5 * rate * done**2
            rows.append((s + done, x, y, bearing, begin + rate * done))
        s += length
        heading += 0.5 * (begin + end) * length
    return np.array(rows)


def polyline(
    segments: Sequence[Segment],
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    spacing: float = 1.0,
    offset: float = 0.0,
) -> FloatArray:
    """Sample points beside `segments`, on straight lines only the ends.

    Args:
        segments: At least one segment.
        start: x, y [m] and heading [rad] at the begin of the segments.
        spacing: Largest distance of points on curves, along the segments [m].
        offset: Distance of the points from the segments, positive to the left [m].

    Returns:
        Points (n, 2).
    """
    poses = [np.array([[0.0, *start, segments[0][2]]])]
    for segment in segments:
        begin = poses[-1][-1]
        pose = (float(begin[1]), float(begin[2]), float(begin[3]))
        step = segment[1] if segment[0] == "line" else spacing
        poses.append(sample([segment], pose, step)[1:])
    _, x, y, heading, _ = np.concatenate(poses).T
    return np.column_stack((x - offset * np.sin(heading), y + offset * np.cos(heading)))


def shape_text(points: FloatArray) -> str:
    """Write points (n, 2) as the `shape` of an edge, four decimals."""
    # Adding 0.0 turns -0.0 into 0.0.
    return " ".join(f"{x:.4f},{y:.4f}" for x, y in np.round(points, 4) + 0.0)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the shape of a sequence of segments."""
    parser = argparse.ArgumentParser(prog="sumo_nets.centre_line", description=__doc__)
    parser.add_argument("segments", nargs="+", metavar="SEGMENT")
    parser.add_argument(
        "--start", nargs=3, type=float, default=(0, 0, 0), metavar=("X", "Y", "HEADING")
    )
    parser.add_argument("--offset", type=float, default=0.0, help="to the left [m]")
    parser.add_argument("--spacing", type=float, default=1.0, help="on curves [m]")
    parser.add_argument("--reverse", action="store_true", help="last point first")
    options = parser.parse_args(arguments)
    try:
        segments = [parse_segment(text) for text in options.segments]
    except NetworkError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    points = polyline(segments, tuple(options.start), options.spacing, options.offset)
    sys.stdout.write(shape_text(points[::-1] if options.reverse else points) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

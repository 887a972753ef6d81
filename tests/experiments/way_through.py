"""Brute force that knows nothing of how a field is drawn: is there a way through?

`drivable` drives the true rectangle on arcs of many curvatures, one state kept for
each cell of (s, l, heading): what it finds can be driven. `connected` asks whether
even a disc of the vehicle's width can be pushed from the start to the goal: if not,
nothing gets through.
"""

import numpy as np
from scipy import ndimage

CURVATURES = 0.17 * np.linspace(-1.0, 1.0, 5)  # [1/m]; the vehicle's limit is 0.2
LAYER, STEP = 2.0, 0.5  # [m]
CELL_L, CELL_HEADING = 0.25, 0.1  # [m], [rad]
GRID = 0.1  # of `connected` [m]


def hits(layout, vehicle, x, y, heading):
    """Say which poses of the rear axle touch an obstacle, (n,)."""
    other = layout.road.obstacles
    near = np.hypot(other.x - x.mean(), other.y - y.mean()) < 25.0
    dx, dy = other.x[near, None] - x, other.y[near, None] - y
    cos, sin = np.cos(heading), np.sin(heading)
    front = vehicle.length - vehicle.rear_overhang
    along = dx * cos + dy * sin
    across = np.abs(dy * cos - dx * sin) - 0.5 * vehicle.width
    beyond = np.maximum(np.maximum(along - front, -vehicle.rear_overhang - along), 0.0)
    gap = np.hypot(beyond, np.maximum(across, 0.0)) - other.radius[near, None]
    return np.any(gap <= 0.0, axis=0)


def off_road(layout, vehicle, x, y, heading, s):
    """Say which poses have a corner over the edge of the road, (n,)."""
    cos, sin = np.cos(heading), np.sin(heading)
    over = np.zeros(x.shape, dtype=bool)
    for along in (-vehicle.rear_overhang, vehicle.length - vehicle.rear_overhang):
        for across in (-0.5 * vehicle.width, 0.5 * vehicle.width):
            px, py = x + along * cos - across * sin, y + along * sin + across * cos
            foot, l = layout.road.path.project(px, py, near=s)
            left, right = layout.road.bounds.at(foot)
            over |= (l > left) | (l < right)
    return over


def drivable(layout, vehicle, start, goal, offset=0.0):
    """Drive layer by layer; give the s of the last layer reached by any state."""
    l, heading = np.array([offset]), np.zeros(1)  # against the road
    s = start
    while s < goal:
        l, heading = (np.repeat(a, CURVATURES.size) for a in (l, heading))
        bend = np.tile(CURVATURES, l.size // CURVATURES.size)
        for _ in range(round(LAYER / STEP)):
            # The midpoint rule on dl/ds and dheading/ds of an arc.
            at = layout.road.path.at(np.array([s + STEP / 2.0]))
            k = float(at.curvature[0])
            ahead = 1.0 - k * l
            turned = heading + 0.5 * STEP * (bend * ahead / np.cos(heading) - k)
            middle = l + 0.5 * STEP * ahead * np.tan(heading)
            ahead = 1.0 - k * middle
            heading = heading + STEP * (bend * ahead / np.cos(turned) - k)
            l = l + STEP * ahead * np.tan(turned)
            s += STEP
            at = layout.road.path.at(np.full(l.size, s))
            x, y = at.x - l * at.sin_heading, at.y + l * at.cos_heading
            kept = (np.abs(heading) < 0.9) & ~hits(
                layout, vehicle, x, y, at.heading + heading
            )
            # Who is far from the edges need not be measured.
            left, right = (edge[0] for edge in layout.road.bounds.at(np.array([s])))
            reach = vehicle.length * np.sin(np.abs(heading)) + vehicle.width
            rim = kept & ((l + reach > left) | (l - reach < right))
            pose = (x[rim], y[rim], (at.heading + heading)[rim])
            kept[rim] = ~off_road(layout, vehicle, *pose, np.full(rim.sum(), s))
            l, heading, bend = l[kept], heading[kept], bend[kept]
            if not l.size:
                return s - STEP
        cells = np.round(np.column_stack((l / CELL_L, heading / CELL_HEADING)))
        _, first = np.unique(cells, axis=0, return_index=True)
        l, heading = l[first], heading[first]
    return s


def connected(layout, vehicle, start, goal, offset=0.0):
    """Say whether a disc of the vehicle's width gets through, in doubt yes."""
    s = np.arange(start, goal, GRID)
    left, right = layout.road.bounds.at(s)
    l = np.arange(right.min(), left.max() + GRID, GRID)
    at = layout.road.path.at(s)
    x = at.x[:, None] - l * at.sin_heading[:, None]
    y = at.y[:, None] + l * at.cos_heading[:, None]
    # No point of a cell is farther from its centre than this, on a bend either.
    doubt = GRID
    radius = 0.5 * vehicle.width - doubt
    free = (l <= left[:, None] - radius) & (l >= right[:, None] + radius)
    other = layout.road.obstacles
    for ox, oy, size in zip(other.x, other.y, other.radius, strict=True):
        free &= np.hypot(x - ox, y - oy) >= size + radius
    parts, _ = ndimage.label(free, np.ones((3, 3)))
    begin = parts[0, np.argmin(np.abs(l - offset))]
    return bool(begin and np.any(parts[-1] == begin))

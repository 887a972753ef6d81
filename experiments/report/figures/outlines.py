"""Outlines of bodies and lanes, shared by all pictures."""

import numpy as np

from planner.states import FloatArray

CORNER_POINTS = 9  # of a quarter circle


def rectangle(
    x: float, y: float, heading: float, length: float, width: float, radius: float = 0.0
) -> FloatArray:
    """Outline a rectangle that is grown by `radius` on all sides.

    Args:
        x: Centre [m].
        y: Centre [m].
        heading: [rad].
        length: Before it is grown [m].
        width: Before it is grown [m].
        radius: [m].

    Returns:
        Points counter-clockwise, (n, 2) [m].
    """
    quarter = np.linspace(0.0, np.pi / 2.0, CORNER_POINTS if radius > 0.0 else 1)
    along, across = [], []
    for k, (i, j) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        angle = quarter + k * np.pi / 2.0
        along.append(i * length / 2.0 + radius * np.cos(angle))
        across.append(j * width / 2.0 + radius * np.sin(angle))
    u, v = np.concatenate(along), np.concatenate(across)
    cos, sin = np.cos(heading), np.sin(heading)
    return np.column_stack((x + u * cos - v * sin, y + u * sin + v * cos))


def offset_line(points: FloatArray, offset: float) -> FloatArray:
    """Shift a polyline sideways, positive to the left; (n, 2) [m].

    The offset is taken along the mean normal of the two segments at each point and
    stretched so that both segments are shifted by it.
    """
    steps = np.diff(points, axis=0)
    normals = np.column_stack((-steps[:, 1], steps[:, 0]))
    normals /= np.maximum(np.hypot(*normals.T), 1e-9)[:, None]
    before = np.concatenate((normals[:1], normals))
    after = np.concatenate((normals, normals[-1:]))
    cosine = 1.0 + np.sum(before * after, axis=1)  # 2 cos² of half the bend
    shifted: FloatArray = (
        points + offset * (before + after) / np.maximum(cosine, 0.2)[:, None]
    )
    return shifted

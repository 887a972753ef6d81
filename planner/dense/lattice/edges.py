"""One edge between two waypoints: its shape and its price; [Thesis] 5.5.1, 5.5.3."""

import numpy as np

from planner.dense.field import ObstacleColumns
from planner.numerics.compiled import inlined
from planner.states import FloatArray

MIN_INTEGRAL = 1e-6  # eq. 5.22 has a pole on the line through an obstacle [m²]

# Nodes and weights of Gauss and Legendre on 0 ... 1: exact to degree 11, and the
# square of a quintic has degree 10.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
GAUSS_NODES = 0.5 * (_NODES + 1.0)
GAUSS_WEIGHTS = 0.5 * _WEIGHTS


@inlined
def blend_table(n: int) -> FloatArray:
    """Tabulate the shape of every edge; [Thesis] eq. 5.13-5.16 in closed form.

    With l' = l'' = 0 at both ends the quintic is z_a + (z_b - z_a) B(u) in the local
    coordinate u = (s - s_a) / (s_b - s_a).

    Args:
        n: Number of intervals.

    Returns:
        B and its two derivatives by u at 0, 1/n ... 1, (3, n + 1).
    """
    table = np.empty((3, n + 1))
    for j in range(n + 1):
        u = j / n
        table[0, j] = u * u * u * (10.0 + u * (-15.0 + 6.0 * u))
        table[1, j] = 30.0 * u * u * (1.0 - u) * (1.0 - u)
        table[2, j] = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    return table


@inlined
def fill_blend(
    shape: FloatArray, table: FloatArray, l0: float, l1: float, length: float
) -> None:
    """Fill l, l', l'' of the edge from l0 to l1 into `shape`, (3, n + 1)."""
    rise = l1 - l0
    slope, second = rise / length, rise / (length * length)
    for j in range(table.shape[1]):
        shape[0, j] = l0 + rise * table[0, j]
        shape[1, j] = slope * table[1, j]
        shape[2, j] = second * table[2, j]


@inlined
def quintic_at(
    coefficients: tuple[float, float, float, float, float, float], x: float
) -> tuple[float, float, float, float]:
    """Evaluate a quintic and three derivatives; [Thesis] eq. 5.13-5.15."""
    c0, c1, c2, c3, c4, c5 = coefficients
    return (
        c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5)))),
        c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5))),
        2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5)),
        6.0 * c3 + x * (24.0 * c4 + x * 60.0 * c5),
    )


@inlined
def blend_span(
    l0: float, l1: float, length: float, reach: float
) -> tuple[float, float]:
    """Bound the l of all discs along an edge from l0 to l1 [m].

    A blend is monotone and its slope is largest in the middle, 15/8 of the mean.

    Args:
        l0: At the begin [m].
        l1: At the end [m].
        length: Of the edge [m].
        reach: Of the disc farthest from the ego's point [m].
    """
    swing = reach * min(1.875 * abs(l1 - l0) / length, 1.0)
    return min(l0, l1) - swing, max(l0, l1) + swing


@inlined
def fill_quintic(
    shape: FloatArray,
    coefficients: tuple[float, float, float, float, float, float],
    length: float,
) -> None:
    """Fill l, l', l'' of a quintic over 0 ... length into `shape`, (3, n + 1)."""
    n = shape.shape[1] - 1
    for j in range(n + 1):
        l, slope, second, _ = quintic_at(coefficients, length * j / n)
        shape[0, j], shape[1, j], shape[2, j] = l, slope, second


@inlined
def blend_price(l0: float, l1: float, length: float) -> tuple[float, float]:
    """Integrate an edge between waypoints in closed form; [Thesis] eq. 5.20, 5.21.

    Returns:
        (integral of z² [m³], integral of z'² + z''² + z'''²).
    """
    rise = l1 - l0
    offset = length * (l0 * l0 + l0 * rise + rise * rise * 181.0 / 462.0)
    inverse = 1.0 / length
    smooth = inverse * (10.0 / 7.0 + inverse**2 * (120.0 / 7.0 + inverse**2 * 720.0))
    return offset, rise * rise * smooth


@inlined
def quintic_price(
    coefficients: tuple[float, float, float, float, float, float], length: float
) -> tuple[float, float]:
    """Return the integrals of `blend_price` for any quintic over 0 ... length."""
    offset, smooth = 0.0, 0.0
    for k in range(GAUSS_NODES.size):
        l, first, second, third = quintic_at(coefficients, length * GAUSS_NODES[k])
        offset += GAUSS_WEIGHTS[k] * l * l
        smooth += GAUSS_WEIGHTS[k] * (first**2 + second**2 + third**2)
    return offset * length, smooth * length


@inlined
def printed_safety(
    shape: FloatArray, length: float, obstacles: ObstacleColumns
) -> float:
    """Compute the safety of an edge as printed; [Thesis] eq. 5.22, its pole cut off.

    It does not depend on s: an obstacle far ahead counts like one beside the edge.
    """
    n = shape.shape[1] - 1
    total = 0.0
    for i in range(obstacles.s.size):
        integral = 0.0
        for j in range(n + 1):
            part = 0.5 if j in (0, n) else 1.0
            integral += part * abs(shape[0, j] - obstacles.l[i])
        total += obstacles.radius[i] / max(integral * length / n, MIN_INTEGRAL)
    return total

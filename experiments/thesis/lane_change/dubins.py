"""Shortest paths of bounded curvature between two poses; [Thesis] eq. 6.6-6.10.

Built from the circles left and right of both poses and their common tangents.
"""

import cmath
import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from planner.errors import InvalidInputError
from planner.lane_change.b_spline import Piece
from planner.states import FloatArray

Pose = tuple[float, float, float]  # x [m], y [m], heading [rad]

WHOLE = 2.0 * math.pi
ROUNDING = 1e-11  # a turn this close to a whole one is none [rad]
NOTHING = 1e-12  # a segment this short is left out [m]


class DubinsWord(StrEnum):
    """Left, straight or right, three times; eq. 6.10."""

    LSL = "LSL"
    RSR = "RSR"
    RSL = "RSL"
    LSR = "LSR"
    RLR = "RLR"
    LRL = "LRL"


@dataclass(frozen=True, slots=True)
class DubinsPath:
    """Three segments of one word."""

    word: DubinsWord
    start: Pose
    radius: float  # of the turns [m]
    lengths: tuple[float, float, float]  # of the segments [m]

    @property
    def length(self) -> float:
        """Length of the whole path [m]."""
        return sum(self.lengths)

    @property
    def curvatures(self) -> tuple[float, ...]:
        """Curvature of each segment [1/m]."""
        return tuple(_side(letter) / self.radius for letter in self.word)

    def pieces(self) -> tuple[Piece, ...]:
        """Return the segments as pieces of a plane curve."""
        made = []
        pose = self.start
        for length, curvature in zip(self.lengths, self.curvatures, strict=True):
            if length > NOTHING:
                made.append(_segment(pose, length, curvature))
                pose = _followed(pose, length, curvature)
        return tuple(made)

    def end(self) -> Pose:
        """Follow the segments to the last pose, its heading not wrapped."""
        pose = self.start
        for length, curvature in zip(self.lengths, self.curvatures, strict=True):
            pose = _followed(pose, length, curvature)
        return pose


def shortest_dubins(start: Pose, end: Pose, radius: float) -> DubinsPath:
    """Return the shortest of the six words."""
    return min(dubins_paths(start, end, radius), key=lambda path: path.length)


def dubins_paths(start: Pose, end: Pose, radius: float) -> tuple[DubinsPath, ...]:
    """Return the path of every word that exists; LSL and RSR always do.

    Raises:
        InvalidInputError: Unless the radius is positive and all numbers are finite.
    """
    if not (radius > 0.0 and all(map(math.isfinite, (*start, *end, radius)))):
        raise InvalidInputError(
            f"radius = {radius} must be positive, {start} and {end} finite"
        )
    found = []
    for word in DubinsWord:
        lengths = _lengths(word, start, end, radius)
        if lengths is not None:
            found.append(DubinsPath(word, start, radius, lengths))
    return tuple(found)


def _side(letter: str) -> int:
    """Return the sign of the curvature of a letter."""
    return {"L": 1, "S": 0, "R": -1}[letter]


def _lengths(
    word: DubinsWord, start: Pose, end: Pose, radius: float
) -> tuple[float, float, float] | None:
    """Return the lengths of the segments; None if the word does not reach."""
    first, middle, last = (_side(letter) for letter in word)
    between = _centre(end, last, radius) - _centre(start, first, radius)
    if middle != 0:
        return _three_turns(first, between, start[2], end[2], radius)
    straight = abs(between)
    if first == last:
        heading = cmath.phase(between) if straight > NOTHING else start[2]
    else:
        if straight < 2.0 * radius:
            return None
        straight = math.sqrt(max(straight * straight - 4.0 * radius * radius, 0.0))
        heading = cmath.phase(between) + first * math.atan2(2.0 * radius, straight)
    return (
        radius * _turn(first, start[2], heading),
        straight,
        radius * _turn(last, heading, end[2]),
    )


def _three_turns(
    side: int, between: complex, heading: float, end_heading: float, radius: float
) -> tuple[float, float, float] | None:
    """Return the shorter of the two ways over a third circle."""
    apart = abs(between)
    if apart > 4.0 * radius:
        return None
    opening = math.acos(min(apart / (4.0 * radius), 1.0))
    ways = []
    for way in (opening, -opening):
        # seen from the first and from the last centre towards that of the third circle
        out = cmath.rect(2.0 * radius, cmath.phase(between) + way)
        back = out - between
        first = cmath.phase(out) + side * 0.5 * math.pi
        second = cmath.phase(back) + side * 0.5 * math.pi
        ways.append(
            (
                radius * _turn(side, heading, first),
                radius * _turn(-side, first, second),
                radius * _turn(side, second, end_heading),
            )
        )
    return min(ways, key=sum)


def _centre(pose: Pose, side: int, radius: float) -> complex:
    """Return the centre of the circle on one side of a pose."""
    return complex(pose[0], pose[1]) + cmath.rect(
        side * radius, pose[2] + 0.5 * math.pi
    )


def _turn(side: int, heading: float, end: float) -> float:
    """Return the angle from one heading to another, turning to one side only [rad]."""
    angle = (side * (end - heading)) % WHOLE
    return 0.0 if WHOLE - angle < ROUNDING else angle


def _followed(pose: Pose, length: float, curvature: float) -> Pose:
    """Follow a line or an arc."""
    x, y, heading = pose
    half = 0.5 * length * curvature
    chord = length * (math.sin(half) / half if half != 0.0 else 1.0)
    return (
        x + chord * math.cos(heading + half),
        y + chord * math.sin(heading + half),
        heading + 2.0 * half,
    )


def _segment(pose: Pose, length: float, curvature: float) -> Piece:
    """Build the piece of a line or an arc."""
    x, y, heading = pose

    def piece(u: FloatArray) -> FloatArray:
        half = 0.5 * curvature * length * u
        chord = length * u * np.sinc(half / np.pi)
        cos, sin = np.cos(heading + 2.0 * half), np.sin(heading + 2.0 * half)
        bend = length * length * curvature
        return np.array(
            [
                [
                    x + chord * np.cos(heading + half),
                    y + chord * np.sin(heading + half),
                ],
                [length * cos, length * sin],
                [-bend * sin, bend * cos],
                [-bend * length * curvature * cos, -bend * length * curvature * sin],
            ]
        )

    return piece

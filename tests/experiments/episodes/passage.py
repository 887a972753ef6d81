"""Whether a road admits a body: a search over arcs, with other geometry.

The kinematic body drives forward on arcs of all curvatures that it has, past what
stands, between the road's edges. Of places with nearly the same s, l and heading one is
kept, so that a passage that is found is real, and one that is missed is narrow.

`python -m tests.experiments.episodes.passage SEED ...` says it of episodes of the
campaign.
"""

import sys

import numpy as np
import shapely

from experiments.config import Scenario
from experiments.config.scenario_file import load_scenario
from experiments.world_setup.layout import make_layout
from experiments.world_setup.road import Layout
from tests.experiments.episodes.random_scenarios import random_episode

ARC = 1.0  # driven between two places [m]
CURVATURES = (-1.0, -0.6, -0.25, 0.0, 0.25, 0.6, 1.0)  # of the sharpest
ROUND = 0.1  # places are nearer to each other than that count once: of l [m],
TURN = 0.04  # of the heading [rad],
ALONG = 1.0  # and of s [m]
ASKEW = 1.2  # headings farther off the road's are not followed [rad]
LANE = 0.3  # the road's sides are drawn by points that far apart [m]


def farthest_place(scenario: Scenario, margin: float = 0.0) -> float:
    """Return the largest s that the rear axle can reach, at most the goal [m].

    Args:
        scenario: Of a road with obstacles.
        margin: Kept between the body, edges and obstacles [m].
    """
    layout = make_layout(scenario)
    path, task = layout.road.path, layout.task
    free, body = _free_area(layout, margin), _outline(layout)
    start = path.at(np.array([task.start.s]))
    l = np.array([task.start.l])
    x, y = start.x - l * start.sin_heading, start.y + l * start.cos_heading
    places = np.column_stack((x, y, start.heading, [task.start.s]))
    bends = np.array(CURVATURES) * task.vehicle.limits.max_curvature
    seen, farthest = set(), float(task.start.s)
    while places.size and farthest < task.goal:
        ahead = _driven(places, bends)
        s, l = path.project(ahead[:, 0], ahead[:, 1], near=ahead[:, 3], reach=10.0)
        ahead[:, 3] = s
        askew = ahead[:, 2] - np.interp(s, *_headings(layout))
        cells = np.column_stack((s / ALONG, l / ROUND, askew / TURN)).round()
        cells, first = np.unique(cells.astype(int), axis=0, return_index=True)
        new = np.array([tuple(cell) not in seen for cell in cells.tolist()], bool)
        new &= np.abs(askew[first]) < ASKEW
        seen.update(map(tuple, cells[new].tolist()))
        ahead = ahead[first[new]]
        places = ahead[shapely.covers(free, _bodies(ahead, body))]
        farthest = max(farthest, float(places[:, 3].max(initial=0.0)))
    return min(farthest, task.goal)


def _headings(layout: Layout):
    s = layout.road.path.table.knots[:, 0]
    return s, np.unwrap(layout.road.path.at(s).heading)


def _driven(places, bends):
    """Drive every arc from every place: (x, y, heading, s)."""
    x, y, heading, s = np.repeat(places, bends.size, axis=0).T
    turned = np.tile(bends, len(places)) * ARC
    chord = ARC * np.sinc(0.5 * turned / np.pi)
    middle = heading + 0.5 * turned
    return np.column_stack(
        (x + chord * np.cos(middle), y + chord * np.sin(middle), heading + turned, s)
        if bends.size
        else places
    )


def _outline(layout: Layout):
    body = layout.task.vehicle
    back, front, half = -body.rear_overhang, body.front_reach, 0.5 * body.width
    return np.array([[back, -half], [front, -half], [front, half], [back, half]])


def _bodies(places, outline):
    cos, sin = np.cos(places[:, 2:3]), np.sin(places[:, 2:3])
    along, across = outline.T
    x = places[:, :1] + cos * along - sin * across
    y = places[:, 1:2] + sin * along + cos * across
    return shapely.polygons(np.stack((x, y), axis=-1))


def _free_area(layout: Layout, margin: float):
    """The road without what stands on it, less a margin."""
    path, bounds = layout.road.path, layout.road.bounds
    s = np.arange(0.0, path.length, LANE)
    at, sides = path.at(s), []
    for l in bounds.at(s):
        x, y = at.x - l * at.sin_heading, at.y + l * at.cos_heading
        sides.append(np.column_stack((x, y)))
    left, right = sides
    quads = np.stack((left[:-1], left[1:], right[1:], right[:-1]), axis=1)
    road = shapely.union_all(shapely.make_valid(shapely.polygons(quads)))
    fixed = layout.road.obstacles
    columns = (fixed.x, fixed.y, fixed.heading, fixed.length, fixed.width, fixed.radius)
    standing = [_standing(*row) for row in zip(*columns, strict=True)]
    free = shapely.difference(road, shapely.union_all(standing)).buffer(-margin)
    shapely.prepare(free)
    return free


def _standing(x, y, heading, length, width, radius):
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (length / 2, width / 2)
    cos, sin = np.cos(heading), np.sin(heading)
    placed = corners @ np.array([[cos, sin], [-sin, cos]]) + (x, y)
    return shapely.MultiPoint(placed).convex_hull.buffer(radius, quad_segs=32)


def episode_scenario(seed: int) -> Scenario:
    """Load the scenario of an episode of the campaign."""
    episode = random_episode(seed)
    return load_scenario(
        episode.name, planner=episode.planner, seed=seed, overrides=episode.overrides
    )


if __name__ == "__main__":
    for seed in map(int, sys.argv[1:]):
        scenario = episode_scenario(seed)
        reached = " ".join(
            f"{farthest_place(scenario, margin):.1f}" for margin in (0.0, 0.2)
        )
        goal = scenario.ego.goal_m
        print(f"{seed} {random_episode(seed).name}: {reached} of {goal:g} m")  # noqa: T201

"""Makes the shipped CommonRoad scenarios: `python -m tests...examples FOLDER`."""

import math
import sys
from pathlib import Path

import numpy as np
import shapely

from experiments.commonroad.records import (
    Box,
    CommonRoadScenario,
    GoalState,
    InitialState,
    Lanelet,
    MovingObstacle,
    PlanningProblem,
    Range,
    RoadNetwork,
    TrafficLight,
)
from experiments.commonroad.write import write_commonroad

STEP = 0.1
WIDTH = 3.5


def lanelet(number, points, width=WIDTH, **more):
    """Spread a centre line over its width."""
    points = np.asarray(points, dtype=float)
    tangent = np.gradient(points, axis=0, edge_order=2)
    tangent /= np.hypot(*tangent.T)[:, None]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    half = 0.5 * width * normal
    return Lanelet(number, points + half, points - half, **more)


def straight(begin, end, n=30):
    """Points from one place to another."""
    return np.linspace(begin, end, n)


def arc(begin, heading, radius, angle, n=40):
    """Points of an arc; a positive angle turns left."""
    turned = np.linspace(0.0, angle, n)
    sign = math.copysign(1.0, angle)
    centre = np.array(begin) + sign * radius * np.array(
        [-math.sin(heading), math.cos(heading)]
    )
    at = heading + turned - sign * math.pi / 2.0
    return centre + radius * np.column_stack([np.cos(at), np.sin(at)])


def user(number, points, speed, kind="car", first=0, n=None, size=(4.5, 1.8)):
    """Drive a polyline at a speed, or at the speeds of each step."""
    points = np.asarray(points, dtype=float)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    if np.ndim(speed) == 0:
        n = int(along[-1] / (speed * STEP)) if n is None else n
        speed = np.full(n, float(speed))
    s = np.concatenate([[0.0], np.cumsum(speed[:-1] * STEP)])
    x, y = (np.interp(s, along, axis) for axis in points.T)
    ahead = [np.interp(s + 0.5, along, axis) for axis in points.T]
    back = [np.interp(s - 0.5, along, axis) for axis in points.T]
    heading = np.arctan2(ahead[1] - back[1], ahead[0] - back[0])
    acceleration = np.gradient(speed, STEP) if len(speed) > 1 else np.zeros(1)
    nothing = np.zeros(len(speed))
    sizes = (np.full(len(speed), size[0]), np.full(len(speed), size[1]))
    table = np.array([x, y, heading, speed, acceleration, nothing, *sizes])
    return MovingObstacle(str(number), kind, first, table)


def scenario(name, lanelets, problem, moving=(), static=(), **network):
    """Put a scenario together."""
    by_id = {x.id: x for x in lanelets}
    for one in lanelets:  # normals of sampled lines differ a little where they meet
        for after in one.successors:
            by_id[after].left[0], by_id[after].right[0] = one.left[-1], one.right[-1]
    return CommonRoadScenario(
        Path(f"{name}.xml"),
        name,
        STEP,
        RoadNetwork(by_id, **network),
        tuple(static),
        tuple(moving),
        (problem,) if isinstance(problem, PlanningProblem) else tuple(problem),
    )


def t_junction():
    """Left turn from the minor road, across traffic of the major one."""
    left_turn = arc((1.75, -12.0), math.pi / 2.0, 13.75, math.pi / 2.0)
    lanelets = [
        lanelet(1, straight((1.75, -70.0), (1.75, -12.0)), successors=(2, 3)),
        lanelet(2, left_turn, successors=(4,), predecessors=(1,)),
        lanelet(
            3,
            arc((1.75, -12.0), math.pi / 2.0, 10.25, -math.pi / 2.0),
            successors=(7,),
            predecessors=(1,),
        ),
        lanelet(4, straight((-12.0, 1.75), (-110.0, 1.75)), predecessors=(2, 6)),
        lanelet(5, straight((110.0, 1.75), (12.0, 1.75)), successors=(6,)),
        lanelet(
            6, straight((12.0, 1.75), (-12.0, 1.75)), successors=(4,), predecessors=(5,)
        ),
        lanelet(7, straight((12.0, -1.75), (110.0, -1.75)), predecessors=(3, 9)),
        lanelet(8, straight((-110.0, -1.75), (-12.0, -1.75)), successors=(9,)),
        lanelet(
            9,
            straight((-12.0, -1.75), (12.0, -1.75)),
            successors=(7,),
            predecessors=(8,),
        ),
    ]
    goal = GoalState(Range(90, 200), lanelets=(4,))
    problem = PlanningProblem(
        100, InitialState(0, 1.75, -60.0, math.pi / 2, 8.0), (goal,)
    )
    way = straight((105.0, 1.75), (-108.0, 1.75), 100)
    other = straight((-105.0, -1.75), (108.0, -1.75), 100)
    moving = [user(200 + k, way, 11.0, first=8 + 17 * k) for k in range(2)] + [
        user(210, other, 10.0, first=0),
        user(211, other, 10.0, first=30),
    ]
    turns = {(1, 2): "left", (1, 3): "right", (5, 6): "straight", (8, 9): "straight"}
    return scenario("ZAM_TJunctionLeft-1_1_T-1", lanelets, problem, moving, turns=turns)


def merge():
    """Onto a motorway before the own lane ends."""
    own = straight((0.0, -3.5), (180.0, -3.5), 60)
    lanelets = [
        lanelet(1, own, beside_left=(2, True), signs=(50,)),
        lanelet(
            2,
            straight((0.0, 0.0), (180.0, 0.0), 60),
            successors=(4,),
            beside_left=(3, True),
            beside_right=(1, True),
            signs=(50,),
        ),
        lanelet(
            3,
            straight((0.0, 3.5), (180.0, 3.5), 60),
            successors=(5,),
            beside_right=(2, True),
            signs=(50,),
        ),
        lanelet(
            4,
            straight((180.0, 0.0), (420.0, 0.0), 60),
            predecessors=(2,),
            beside_left=(5, True),
            signs=(50,),
        ),
        lanelet(
            5,
            straight((180.0, 3.5), (420.0, 3.5), 60),
            predecessors=(3,),
            beside_right=(4, True),
            signs=(50,),
        ),
    ]
    area = shapely.box(270.0, -1.75, 300.0, 1.75)
    goal = GoalState(
        Range(100, 200), area, heading=Range(-0.3, 0.3), speed=Range(10, 25)
    )
    problem = PlanningProblem(100, InitialState(0, 12.0, -3.5, 0.0, 18.0), (goal,))
    way = straight((-200.0, 0.0), (420.0, 0.0), 300)
    fast = straight((-200.0, 3.5), (420.0, 3.5), 300)
    moving = [user(200 + k, way[30 * k :], 19.0) for k in range(2, 9) if k != 6]
    moving += [user(220 + k, fast[45 * k :], 23.0, "truck") for k in range(4)]
    return scenario(
        "ZAM_MotorwayMerge-1_1_T-1", lanelets, problem, moving, speed_limits={50: 25.0}
    )


def urban_curve():
    """Behind a slower car through two bends, with a light at the end."""
    first = straight((0.0, 0.0), (40.0, 0.0))
    bend = arc((40.0, 0.0), 0.0, 22.0, math.pi / 2.0)
    back = arc(bend[-1], math.pi / 2.0, 25.0, -math.pi / 2.0)
    last = straight(back[-1], back[-1] + (120.0, 0.0), 60)
    light = TrafficLight(
        70,
        ("red", "redYellow", "green", "yellow"),
        (90, 10, 200, 30),
        0,
        "all",
        active=True,
    )
    lanelets = [
        lanelet(1, first, successors=(2,), beside_left=(11, False)),
        lanelet(2, bend, predecessors=(1,), successors=(3,), beside_left=(12, False)),
        lanelet(3, back, predecessors=(2,), successors=(4,), lights=(70,)),
        lanelet(4, last, predecessors=(3,), signs=(51,)),
        lanelet(11, (first + np.array([0.0, 3.5]))[::-1], beside_left=(1, False)),
        lanelet(
            12,
            arc((40.0, 3.5), 0.0, 18.5, math.pi / 2.0)[::-1],
            successors=(11,),
            beside_left=(2, False),
        ),
    ]
    area = shapely.Point(last[-20]).buffer(4.0)
    goal = GoalState(Range(100, 320), area, speed=Range(0.0, 14.0))
    problem = PlanningProblem(100, InitialState(0, 5.0, 0.2, 0.02, 9.0), (goal,))
    way = np.concatenate([first[15:], bend[1:], back[1:], last[1:]])
    ahead = user(200, way, np.concatenate([np.full(60, 7.0), np.full(160, 9.0)]))
    return scenario(
        "ZAM_UrbanCurve-1_1_T-1",
        lanelets,
        problem,
        [ahead],
        speed_limits={51: 50 / 3.6},
        lights={70: light},
    )


def dense_parking():
    """Past cars parked half on the road, and a polygon of a building site."""
    lanelets = [
        lanelet(
            1, straight((0.0, 0.0), (160.0, 0.0), 60), beside_left=(2, True), width=3.6
        ),
        lanelet(
            2, straight((0.0, 3.6), (160.0, 3.6), 60), beside_right=(1, True), width=3.6
        ),
    ]
    static = [
        (str(200 + k), Box(x, y, turned, 4.4, 1.8))
        for k, (x, y, turned) in enumerate(
            [
                (35.0, -1.4, 0.05),
                (42.0, -1.5, -0.04),
                (70.0, 4.9, 0.0),
                (78.0, 5.0, 0.08),
                (105.0, -1.3, 0.1),
                (112.0, -1.5, 0.0),
            ]
        )
    ]
    static.append(("230", Box(128.0, 5.2, 0.0, 0.0, 0.0, 0.9)))
    goal = GoalState(
        Range(60, 250),
        shapely.box(140.0, -1.8, 152.0, 1.8),
        heading=Range(-0.4, 0.4),
    )
    problem = PlanningProblem(100, InitialState(0, 6.0, 0.0, 0.0, 6.0), (goal,))
    return scenario("ZAM_DenseParking-1_1_T-1", lanelets, problem, (), static)


def cut_in():
    """A vehicle changes into the ego's lane closely ahead and brakes."""
    lanelets = [
        lanelet(1, straight((0.0, 0.0), (500.0, 0.0), 100), beside_left=(2, True)),
        lanelet(
            2,
            straight((0.0, 3.5), (500.0, 3.5), 100),
            beside_left=(3, True),
            beside_right=(1, True),
        ),
        lanelet(3, straight((0.0, 7.0), (500.0, 7.0), 100), beside_right=(2, True)),
    ]
    goal = GoalState(Range(120, 160), lanelets=(2,), speed=Range(8.0, 30.0))
    problem = PlanningProblem(100, InitialState(0, 20.0, 3.5, 0.0, 22.0), (goal,))
    x = np.linspace(0.0, 400.0, 400)
    moved = np.clip((x - 15.0) / 55.0, 0.0, 1.0)
    y = 3.5 * (moved**3 * (10.0 - 15.0 * moved + 6.0 * moved**2))
    way = np.column_stack([x + 32.0, y])
    pace = np.concatenate(
        [np.full(30, 19.0), np.linspace(19.0, 15.0, 25), np.full(110, 15.0)]
    )
    moving = [
        user(200, way, pace),
        user(201, straight((60.0, 0.0), (500.0, 0.0), 100), 18.0),
        user(202, straight((15.0, 7.0), (500.0, 7.0), 100), 24.0),
    ]
    return scenario("ZAM_CutIn-1_1_T-1", lanelets, problem, moving)


EXAMPLES = (t_junction, merge, urban_curve, dense_parking, cut_in)


def write_examples(folder):
    """Write all of them; returns their files."""
    files = []
    for make in EXAMPLES:
        made = make()
        files.append(Path(folder) / f"{made.benchmark_id}.xml")
        write_commonroad(made, files[-1])
    return files


if __name__ == "__main__":
    write_examples(sys.argv[1])

import numpy as np
import pytest
import shapely

from planner.errors import InvalidInputError
from planner.reference_path.body_in_area import (
    body_outline,
    corner_distances,
    depths,
    offsets,
    outline_points,
)
from planner.reference_path.steerable import steerable_path
from planner.reference_path.steered_motion import (
    CURVATURE_RATE,
    Iterate,
    SteeringLimits,
    integrate,
)
from planner.reference_path.steering_program import _dynamics
from planner.vehicle import Vehicle

CAR = Vehicle()
LIMITS = SteeringLimits(0.194)


def strip(begin, end, width):
    line = shapely.LineString([begin, end])
    return line.buffer(width / 2.0, cap_style="flat")


def turn(rng):
    """Draw a bend: two lanes and the junction between them; (area, guide).

    The lanes end before the corner; the junction is what lies between their ends,
    its inner corner rounded or not.
    """
    angle = np.radians(rng.uniform(15.0, 130.0)) * rng.choice([-1.0, 1.0])
    back = rng.uniform(2.0, 12.0)  # from the corner to the ends of the lanes
    widths = rng.uniform(2.8, 4.5, 2)
    away = np.array([np.cos(angle), np.sin(angle)])
    begin, end = np.array([-30.0 - back, 0.0]), (30.0 + back) * away
    first, second = np.array([-back, 0.0]), back * away
    beside = np.array([0.0, 0.5 * widths[0]])
    across = 0.5 * widths[1] * np.array([-away[1], away[0]])
    ends = [first + beside, first - beside, second + across, second - across]
    junction = shapely.MultiPoint(ends).convex_hull
    outer = strip(first, 3.0 * away, widths[0]).union(strip((0, 0), second, widths[1]))
    if rng.random() < 0.5:  # the outer corner is road, too
        junction = junction.union(outer)
    area = shapely.union_all(
        [
            part.buffer(0.02, join_style="mitre")
            for part in (
                strip(begin, first, widths[0]),
                strip(second, end, widths[1]),
                junction,
            )
        ]
    )
    # the ends of the lanes go on: the rear reaches beyond the path's begin
    area = area.union(strip(begin - [8.0, 0.0], begin, widths[0]))
    area = area.union(strip(end, end + 8.0 * away, widths[1]))
    guide = np.array([begin, first, second, end])
    return area, guide


def sides(area):
    rings = [
        np.array(ring.coords)
        for part in getattr(area, "geoms", [area])
        for ring in (part.exterior, *part.interiors)
    ]
    return np.concatenate([np.hstack([ring[:-1], ring[1:]]) for ring in rings])


def bodies(x, y, heading, grown=0.0):
    back, front = -CAR.rear_overhang - grown, CAR.front_reach + grown
    half = CAR.width / 2.0 + grown
    corners = np.array([[back, -half], [front, -half], [front, half], [back, half]])
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    along, across = corners.T
    px = x[:, None] + cos * along - sin * across
    py = y[:, None] + sin * along + cos * across
    return shapely.polygons(np.stack([px, py], axis=-1))


def check(path, area, guide):
    """Check a drivable path by means of its own: positions, shapely."""
    step = np.hypot(np.diff(path.x), np.diff(path.y))
    assert np.abs(path.curvature).max() <= LIMITS.curvature + 1e-9
    rate = np.diff(path.curvature) / step.mean()
    assert np.abs(rate).max() <= CURVATURE_RATE * 1.02
    heading = np.unwrap(np.arctan2(np.diff(path.y), np.diff(path.x)))
    turned = np.diff(heading) / step[1:]
    assert np.abs(turned).max() <= LIMITS.curvature * 1.02
    inside = shapely.covers(area.buffer(0.02), bodies(path.x, path.y, path.heading))
    assert inside.all()
    np.testing.assert_allclose([path.x[0], path.y[0]], guide[0], atol=1e-9)
    np.testing.assert_allclose([path.x[-1], path.y[-1]], guide[-1], atol=0.02)


def test_linearised_dynamics_agree_with_differences():
    rng = np.random.default_rng(3)
    n, step = 30, 1e-6
    curvature, spacing, start = rng.uniform(-0.2, 0.2, n), 0.7, (3.0, -2.0, 0.4)
    rows = _dynamics(Iterate(curvature, spacing, integrate(curvature, spacing, start)))
    for k in range(n + 1):
        low, high = [
            integrate(
                curvature + sign * step * (np.arange(n) == k),
                spacing + sign * step * (k == n),
                start,
            )
            for sign in (-1.0, 1.0)
        ]
        change = [
            (getattr(high, name) - getattr(low, name)) / (2.0 * step)
            for name in ("x", "y", "heading")
        ]
        moved = (np.arange(n) == k).astype(float)
        unknowns = np.concatenate([*change, moved, [float(k == n), 0.0]])
        np.testing.assert_allclose(rows @ unknowns, 0.0, atol=1e-7)


def test_constant_curvature_integrates_to_a_circle():
    motion = integrate(np.full(41, 0.1), 0.5, (0.0, 0.0, 0.0))
    s = 0.5 * np.arange(41)
    np.testing.assert_allclose(motion.heading, 0.1 * s, atol=1e-12)
    np.testing.assert_allclose(motion.x, 10.0 * np.sin(0.1 * s), atol=2e-3)
    np.testing.assert_allclose(motion.y, 10.0 * (1.0 - np.cos(0.1 * s)), atol=2e-3)


def test_depth_and_its_direction_agree_with_shapely():
    rng = np.random.default_rng(5)
    hole = shapely.box(2.0, 2.0, 3.0, 4.0)
    area = shapely.Polygon([(0, 0), (9, 0), (9, 6), (4, 9), (0, 6)]).difference(hole)
    area = area.union(shapely.box(12.0, 0.0, 15.0, 3.0))
    x, y = rng.uniform(-2.0, 17.0, (2, 40, 25))
    depth, inward_x, inward_y = depths(x, y, sides(area))
    points = shapely.points(x, y)
    expected = shapely.distance(points, area.boundary)
    expected = np.where(shapely.covers(area, points), expected, -expected)
    np.testing.assert_allclose(depth, expected, atol=1e-9)
    moved, _, _ = depths(x + 1e-5 * inward_x, y + 1e-5 * inward_y, sides(area))
    np.testing.assert_allclose(moved - depth, 1e-5, atol=1e-8)


def test_distance_from_the_guide_agrees_with_shapely():
    rng = np.random.default_rng(6)
    line = np.array([[0.0, 0.0], [4.0, 1.0], [4.0, 5.0], [9.0, 5.0]])
    x, y = rng.uniform(-2.0, 10.0, (2, 200))
    distance, away_x, away_y = offsets(x, y, line)
    points = shapely.points(x, y)
    expected = shapely.distance(points, shapely.LineString(line))
    np.testing.assert_allclose(distance, expected, atol=1e-9)
    moved, _, _ = offsets(x + 1e-5 * away_x, y + 1e-5 * away_y, line)
    np.testing.assert_allclose(moved - distance, 1e-5, atol=1e-8)


def test_distance_of_corners_from_the_body_agrees_with_shapely():
    rng = np.random.default_rng(8)
    motion = integrate(rng.uniform(-0.2, 0.2, 12), 0.7, (1.0, 2.0, 0.4))
    corners = rng.uniform(-3.0, 12.0, (300, 2))
    box = (-1.0, 3.8, 0.95)
    distance, away_x, away_y = corner_distances(motion.poses, corners, box)
    body = bodies(motion.x, motion.y, motion.heading)[:, None]
    points = shapely.points(corners)[None]
    expected = shapely.distance(shapely.boundary(body), points)
    expected = np.where(shapely.covers(body, points), -expected, expected)
    np.testing.assert_allclose(distance, expected, atol=1e-9)
    for k in range(12):
        moved = corners + 1e-6 * np.column_stack([away_x[k], away_y[k]])
        after, _, _ = corner_distances(motion.poses, moved, box)
        np.testing.assert_allclose(after[k] - distance[k], 1e-6, atol=1e-9)


def test_outline_is_that_of_the_body():
    outline = body_outline(CAR, 0.2)
    x, y = outline_points(np.zeros(1), np.zeros(1), np.zeros(1), outline)
    assert (x.min(), x.max()) == pytest.approx((-1.2, 4.0))
    assert (y.min(), y.max()) == pytest.approx((-1.15, 1.15))


def test_straight_guide_gives_a_straight_path():
    area = shapely.box(-10.0, -1.6, 60.0, 1.6)
    guide = np.array([[0.0, 0.0], [40.0, 0.0]])
    path = steerable_path(guide, sides(area), CAR, LIMITS)
    assert path.drivable
    assert path.outside == 0.0
    np.testing.assert_allclose(path.y, 0.0, atol=1e-6)


def test_guide_without_length_is_refused():
    with pytest.raises(InvalidInputError, match=r"1\.00 m long: too short"):
        steerable_path(
            np.array([[0.0, 0.0], [1.0, 0.0]]), np.zeros((1, 4)), CAR, LIMITS
        )


def test_corner_that_is_too_narrow_is_not_drivable():
    area = shapely.box(-40.0, -1.3, 1.3, 1.3).union(shapely.box(-1.3, -1.3, 1.3, 40.0))
    guide = np.array([[-30.0, 0.0], [0.0, 0.0], [0.0, 30.0]])
    path = steerable_path(guide, sides(area), CAR, LIMITS)
    assert not path.drivable
    assert path.fault > 0.3


def drive_turns(count, seed):
    """Plan random turns and check those that come out; return the share of them."""
    rng, drivable = np.random.default_rng(seed), 0
    for _ in range(count):
        area, guide = turn(rng)
        path = steerable_path(guide, sides(area), CAR, LIMITS)
        if path.fault <= LIMITS.margin:
            check(path, area, guide)
            drivable += 1
    return drivable / count


def test_random_turns_keep_curvature_and_area():
    assert drive_turns(6, 11) > 0.5


@pytest.mark.slow
def test_many_random_turns_keep_curvature_and_area(pytestconfig):
    """`--turns 10000` takes about an hour on one core."""
    assert drive_turns(pytestconfig.getoption("turns"), 12) > 0.6


CELL, TURN, REACH = 0.25, np.radians(4.0), 0.6  # of the search [m, rad, m]


def path_exists(area, guide, curvature, grown):
    """Search all poses in layers of equal length, one kept for each cell.

    The body may jump between curvatures: what is not found here cannot be driven by
    a path of bounded rate, up to the size of the cells.
    """
    shapely.prepare(area)
    ahead = guide[1] - guide[0]
    poses = np.array([[*guide[0], np.arctan2(ahead[1], ahead[0])]])
    last = guide[-1] - guide[-2]
    goal = np.arctan2(last[1], last[0])
    bends = np.linspace(-curvature, curvature, 5)
    seen = set()
    while len(poses):
        heading = poses[:, 2]
        close = np.hypot(*(poses[:, :2] - guide[-1]).T) < 1.0
        if np.any(close & (np.abs(heading - goal) < 0.15)):
            return True
        turned = (heading[:, None] + 0.5 * REACH * bends).ravel()
        x = np.repeat(poses[:, 0], bends.size) + REACH * np.cos(turned)
        y = np.repeat(poses[:, 1], bends.size) + REACH * np.sin(turned)
        heading = np.repeat(heading, bends.size) + np.tile(REACH * bends, len(poses))
        inside = shapely.covers(area, bodies(x, y, heading, grown))
        poses = np.column_stack([x, y, heading])[inside]
        cells = np.rint(poses / [CELL, CELL, TURN]).astype(int).tolist()
        fresh = []
        for k, cell in enumerate(map(tuple, cells)):
            if cell not in seen:
                seen.add(cell)
                fresh.append(k)
        poses = poses[fresh]
    return False


def compare_with_search(count, seed):
    """Hold the planner against the search.

    Returns how many paths only the search found, how many only the planner found (the
    search keeps one pose in a cell, so it may lose the last way), and how many there
    are.
    """
    rng, missed, lost, possible = np.random.default_rng(seed), 0, 0, 0
    for _ in range(count):
        area, guide = turn(rng)
        # short lanes: the search is for the bend
        near = [guide[1] + (guide[0] - guide[1]) * 14.0 / 30.0]
        far = [guide[2] + (guide[3] - guide[2]) * 14.0 / 30.0]
        guide = np.concatenate([near, guide[1:3], far])
        found = steerable_path(guide, sides(area), CAR, LIMITS).fault <= LIMITS.margin
        if found:
            easier = area.buffer(0.1)
            lost += not path_exists(easier, guide, 1.1 * LIMITS.curvature, 0.0)
        elif path_exists(area, guide, 0.85 * LIMITS.curvature, 0.1):
            missed += 1
        possible += found
    return missed, lost, possible


def test_a_search_over_all_poses_agrees_whether_there_is_a_path():
    missed, lost, possible = compare_with_search(6, 21)
    assert missed == lost == 0
    assert possible > 2


@pytest.mark.slow
def test_a_search_agrees_on_many_bends():
    missed, lost, possible = compare_with_search(200, 22)
    assert missed <= 2
    assert lost <= 2
    assert possible > 70

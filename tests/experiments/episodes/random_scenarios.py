"""Random episodes on the shipped roads: body, drivers, flows, obstacles, time step."""

from dataclasses import dataclass

import numpy as np

from experiments.config.scenario_file import load_scenario

CRUISE = ("cruise", "cruise_conventional")
CHANGE = ("lane_change", "lane_change_thesis", "lane_change_dp", "cruise")
DENSE = ("dense", "dense_adaptive", "dense_uniform")

# Scenarios in SUMO, and the planners that fit.
PLANNERS = {
    "straight": (*CRUISE, "lane_change"),
    "curved": CRUISE,
    "intersection": CRUISE,
    "u_shaped": CRUISE,
    "dense": (*DENSE, "cruise"),
    "dense_curved": DENSE,
    "lane_change": CHANGE,
    "lane_change_curved": CHANGE,
    "lane_change_three": CHANGE,
    "lane_change_leader": CHANGE,
}
# length, width, wheelbase, rear overhang [m], acceleration [m/s²], curvature [1/m]
BODIES = {
    "car": (4.8, 1.9, 2.8, 1.0, 3.0, 0.2),
    "van": (6.0, 2.1, 3.7, 1.1, 2.5, 0.16),
    "lorry": (12.0, 2.5, 6.5, 3.0, 1.5, 0.12),
}
BODY_SHARES = (0.56, 0.22, 0.22)
_KEYS = (
    "length_m",
    "width_m",
    "wheelbase_m",
    "rear_overhang_m",
    "limits.max_acceleration_mps2",
    "limits.max_curvature_1pm",
)
FLOWS = ("own_veh_per_h", "oncoming_veh_per_h", "cross_veh_per_h")
FLOW_OF_A_DENSITY = 700.0  # `medium`, in each lane [vehicles/h]
MODELS = ("Krauss", "IDM", "EIDM", "ACC")
# obstacles of a field between which a long body finds a way: radii and gaps [m]
FIELDS = {"van": ("[0.71, 1.58]", 6.0), "lorry": ("[0.71]", 15.0)}
QUEUE_FLOW = 300.0  # behind an ego among dense obstacles [vehicles/h]
SLACK = 2.5  # time to reach the goal, against driving there at the wished speed


@dataclass(frozen=True, slots=True)
class RandomEpisode:
    """One episode of a campaign."""

    name: str
    planner: str
    seed: int
    body: str
    overrides: tuple[str, ...]

    @property
    def command(self) -> str:
        """The command that repeats it."""
        options = " ".join(f"--set '{one}'" for one in self.overrides)
        head = f"rearview run {self.name} --planner {self.planner} --seed {self.seed}"
        return f"{head} {options}"


def random_episode(seed: int) -> RandomEpisode:
    """Draw the episode of a seed."""
    rng = np.random.default_rng(seed)
    name = str(rng.choice(list(PLANNERS)))
    planner = str(rng.choice(PLANNERS[name]))
    body = str(rng.choice(list(BODIES), p=BODY_SHARES))
    wished = load_scenario(name).ego.target_speed_mps * rng.uniform(0.4, 1.0)
    overrides = [
        f"simulation.step_s={rng.choice([0.05, 0.1, 0.2])}",
        f"simulation.predictor={rng.choice(['constant_speed', 'held_braking'])}",
        *_ego(rng, body, name, wished),
        *_traffic(rng, name),
        *_obstacles(rng, name, body),
    ]
    return RandomEpisode(name, planner, seed, body, tuple(overrides))


def _ego(rng, body, name, wished):
    scenario = load_scenario(name)
    if body != "car":
        for key, value in zip(_KEYS, BODIES[body], strict=True):
            yield f"ego.vehicle.{key}={value}"
    yield f"ego.target_speed_mps={wished:.2f}"
    start = "max" if rng.random() < 0.5 else f"{rng.uniform(0.3, 0.9) * wished:.2f}"
    yield f"ego.depart_speed_mps={start}"
    distance = scenario.ego.goal_m - scenario.ego.start_m
    duration = max(scenario.simulation.duration_s, SLACK * distance / wished)
    yield f"simulation.duration_s={duration:.0f}"


def _traffic(rng, name):
    traffic = load_scenario(name).traffic
    if traffic is None:
        if rng.random() < 0.5:
            return
        yield f"traffic.own_veh_per_h={QUEUE_FLOW * rng.uniform(0.3, 2.0):.0f}"
        yield "simulation.warmup_s=0"
    elif traffic.density is not None:
        yield "traffic.density=null"
        lanes = 2 if name == "lane_change_three" else 1
        flow = lanes * FLOW_OF_A_DENSITY * rng.uniform(0.3, 2.0)
        yield f"traffic.own_veh_per_h={flow:.0f}"
    else:
        factor = rng.uniform(0.3, 2.0)
        for key in FLOWS:
            yield f"traffic.{key}={factor * getattr(traffic, key):.0f}"
    cautious, aggressive, _ = rng.dirichlet([1.0, 1.0, 1.0])
    yield f"traffic.cautious_share={cautious:.3f}"
    yield f"traffic.aggressive_share={aggressive:.3f}"
    yield f"traffic.truck_share={rng.uniform(0.0, 0.3):.3f}"
    yield f"traffic.van_share={rng.uniform(0.0, 0.3):.3f}"
    if rng.random() < 0.3:
        first, second = rng.choice(MODELS, 2, replace=False)
        shares = f"{first}: {rng.uniform(0.2, 2):.2f}, {second}: 1"
        yield f"traffic.models={{{shares}}}"


def _obstacles(rng, name, body):
    obstacles = load_scenario(name).obstacles
    if obstacles.random is not None and rng.random() < 0.7:
        least = rng.uniform(25.0, 35.0)
        most = least + rng.uniform(5.0, 30.0)
        yield f"obstacles.random.spacing_m=[{least:.1f}, {most:.1f}]"
        yield f"obstacles.random.max_offset_m={rng.uniform(1.0, 3.0):.2f}"
        yield f"obstacles.random.radius_m=[0.3, {rng.uniform(0.4, 2.0):.2f}]"
    if obstacles.field is not None:
        if body in FIELDS:
            radii, gap = FIELDS[body]
            yield f"obstacles.field.radii_m={radii}"
            yield f"obstacles.field.gap_m={gap}"
            yield f"obstacles.field.count={rng.integers(5, 12)}"
        else:
            yield f"obstacles.field.count={rng.integers(5, 25)}"
        if rng.random() < 0.15:
            yield "obstacles.field.passable=false"

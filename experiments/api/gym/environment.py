"""The environment: one episode at a time, driven by actions instead of a planner."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any, Protocol
from weakref import finalize

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from experiments.api.gym.actions import (
    LANE_CHOICES,
    SPEED_CHOICES,
    Action,
    ActionKind,
    drive,
)
from experiments.api.gym.observation import Observation, ObservationShape, observe
from experiments.api.gym.picture import picture
from experiments.api.scenarios import Scenario
from experiments.config.self_driven import SELF_DRIVEN
from experiments.cosim.loop import RunningEpisode
from experiments.cosim.plant import PlannerOutputError
from experiments.cosim.records import Ending, EpisodeStatus, StepRecord
from experiments.cosim.world import World
from experiments.episode.run import episode_options
from experiments.episode.run_folder import OutputOptions
from experiments.errors import ConfigError, EntryError, SimulationError
from experiments.world_setup.layout import make_layout
from experiments.world_setup.road import Layout
from experiments.world_setup.vehicle_model import make_plant
from experiments.world_setup.world import make_world
from planner.interface import PlanResult, PlanStatus
from planner.scene import OFF_ROAD_TOLERANCE, Scene

TRAINING_SEEDS = range(1000)  # that episodes are drawn from
MOST_TRIES = 20  # to find a drawn seed in which the ego finds room to enter
LARGEST_SEED = 2**31 - 1
OF_ACTIONS = "cruise"  # any planner that leaves the ego's motion to its plans

# an outcome of the driving; anything else ends an episode from outside
TERMINAL = frozenset(
    {
        EpisodeStatus.ARRIVED,
        EpisodeStatus.COLLISION,
        EpisodeStatus.OFF_ROAD,
        EpisodeStatus.BLOCKED,
        EpisodeStatus.PLANNER_FAILED,
    }
)


@dataclass(frozen=True, slots=True)
class Transition:
    """One step, as a reward sees it."""

    before: StepRecord
    after: StepRecord  # the same as before if the action could not be driven
    step: float  # [s]
    target_speed: float  # [m/s]
    ending: Ending | None  # of the episode, if it ended


Reward = Callable[[Transition], float]

FAILURE, ARRIVAL = -10.0, 5.0  # rewards of endings
EFFORT = 0.01  # per (m/s²)² of acceleration and lateral acceleration, a second


def progress_reward(transition: Transition) -> float:
    """Reward progress at the target speed with 1 a second; punish effort and failure.

    Returns:
        Way over the target speed [s], less `EFFORT` for accelerations, less 10 where
        the ego collides, leaves the road, is blocked or cannot be driven, plus 5 where
        it arrives.
    """
    before, after = transition.before, transition.after
    way = 0.0
    if before.ego_frenet is not None and after.ego_frenet is not None:
        way = after.ego_frenet.s - before.ego_frenet.s
    ego = after.ego
    lateral = ego.curvature * ego.speed**2
    effort = min(ego.acceleration**2 + lateral**2, 100.0) * transition.step
    reward = way / transition.target_speed - EFFORT * effort
    if transition.ending is not None:
        status = transition.ending.status
        reward += ARRIVAL if status is EpisodeStatus.ARRIVED else 0.0
        failed = status in TERMINAL and status is not EpisodeStatus.ARRIVED
        reward += FAILURE if failed else 0.0
    return reward


@dataclass(slots=True)
class _ActionPlanner:
    """Drives the action that the environment was given."""

    kind: ActionKind
    action: Action | None = None

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Turn the action into a plan."""
        assert self.action is not None  # noqa: S101 - of `step`
        plan = drive(self.kind, self.action, scene)
        status = PlanStatus.OK if plan is not None else PlanStatus.INVALID_SCENE
        return PlanResult(status, plan, memory)


@dataclass(slots=True)
class _Running:
    """An episode that runs."""

    world: World
    layout: Layout
    episode: RunningEpisode
    record: StepRecord


class DrivingEnv(gym.Env[Observation, Action]):
    """A scenario as an environment.

    SUMO is one simulation per process: environments that run at the same time need a
    process each (`AsyncVectorEnv`, `SubprocVecEnv`). In one process a `reset` ends the
    episode of any other environment, whose next `step` says so.

    Args:
        scenario: Shipped name or file.
        action: `control`, `lane_and_speed` or `frenet`, see `rearview.gym.drive`.
        changes: Keys of the scenario and their values.
        shape: Of the observation.
        repeat: Steps of the simulation that an action is driven for.
        reward: Of each step of the simulation; those of an action are added.
        seeds: That episodes are drawn from where `reset` gets none.
        render_mode: `rgb_array` or None.

    Raises:
        ConfigError: If the scenario is wrong, or does not plan in every step.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as in the base class
        "render_modes": ["rgb_array"],
        "render_fps": 10,
    }

    def __init__(
        self,
        scenario: str | Path = "lane_change",
        action: str = "lane_and_speed",
        changes: Mapping[str, Any] | None = None,
        shape: ObservationShape | None = None,
        repeat: int = 1,
        reward: Reward = progress_reward,
        seeds: Sequence[int] = TRAINING_SEEDS,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise ConfigError(f"render_mode: {render_mode!r}; allowed: rgb_array, None")
        if action not in [kind.value for kind in ActionKind]:
            allowed = ", ".join(ActionKind)
            raise ConfigError(f"action: is {action!r}; allowed: {allowed}")
        self._scenario = Scenario.load(scenario).with_(changes)
        simulation = self._scenario.checked.simulation
        period = simulation.planning_period_s
        if period is not None and period != simulation.step_s:
            raise ConfigError(
                "simulation.planning_period_s: an environment acts in every step; "
                f"allowed: {simulation.step_s:g}"
            )
        if self._scenario.checked.egos is not None:
            raise ConfigError(
                f"scenario: {self._scenario.name} has many egos; allowed: one ego, or "
                "rearview.gym.parallel_env"
            )
        if self._scenario.planner in SELF_DRIVEN:  # whose world moves the ego itself
            self._scenario = self._scenario.with_(planner=OF_ACTIONS)
        require_count("repeat", repeat)
        require_seeds(seeds)
        require_reward(reward)
        self._repeat = repeat
        self._shape = shape or ObservationShape()
        self._reward = reward
        self._seeds = seeds
        self.render_mode = render_mode
        self._planner = _ActionPlanner(ActionKind(action))
        self._running: _Running | None = None
        self._seen: Observation | None = None
        self._folder = Path(mkdtemp(prefix="rearview-gym-"))
        self._tidy = finalize(self, rmtree, self._folder, ignore_errors=True)
        self.action_space = action_space(self._planner.kind)
        self.observation_space = observation_space(self._shape)  # type: ignore[assignment]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Of the scenario: the traffic and obstacles are those of `rearview run
                --seed`. It seeds what is drawn afterwards too. None draws one.
            options: None are known.

        Raises:
            ConfigError: If there are options, or the scenario cannot be run.
            SimulationError: If the simulator fails, runs in this process already, or
                the ego finds no room to enter with this seed.
        """
        super().reset(seed=seed)
        if options:
            raise ConfigError(f"reset: options {sorted(options)}: allowed: none")
        self.end_episode()
        take_process(self)
        for _ in range(1 if seed is not None else MOST_TRIES):
            drawn = self._draw() if seed is None else seed % (LARGEST_SEED + 1)
            try:
                self._running = self._begin(drawn)
            except EntryError as error:
                self.end_episode()
                problem = error
                continue
            self._seen = self._observation(self._running)
            return self._copy(), self._info(None, drawn)
        raise problem

    def step(
        self, action: Action
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive the action, for one step of the simulation or `repeat` of them.

        Returns:
            Observation, reward, whether the driving has ended the episode (arrived,
            collision, off road, blocked, or an action that cannot be driven), whether
            the time or the simulator did, and facts: `status`, `reason`, `time_s`,
            `s_m`, `l_m`, `speed_mps`, `clearance_m`, `is_success`.
        """
        running = self._running
        if running is None:
            raise gym.error.ResetNeeded(
                "call reset() first: no episode runs, or another environment of this "
                "process has begun one (SUMO is one simulation per process: take "
                "AsyncVectorEnv or SubprocVecEnv)"
            )
        action = cast_action(self.action_space, action)
        if not self.action_space.contains(action):
            raise ConfigError(f"step: {action!r} is not in {self.action_space}")
        reward, ending = 0.0, None
        for _ in range(self._repeat):
            before = running.record
            running.record, ending = self._drive(running, action)
            transition = Transition(
                before,
                running.record,
                running.world.step,
                running.layout.task.target_speed,
                ending,
            )
            reward += float(self._reward(transition))
            if ending is not None:
                break
        if ending is None or ending.status is not EpisodeStatus.SIMULATOR_FAILED:
            seen = self._observation(running)
            self._seen = self._seen if seen is None else seen
        terminated = ending is not None and ending.status in TERMINAL
        truncated = ending is not None and not terminated
        info = self._info(ending)
        if ending is not None:
            self.end_episode()
        return self._copy(), reward, terminated, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture of the surroundings from above, (height, width, 3)."""
        if self.render_mode is None or self._running is None:
            return None
        running = self._running
        return picture(running.layout, running.record)

    def close(self) -> None:
        """End the simulation; allowed at any time."""
        self.end_episode()
        self._tidy()

    def _draw(self) -> int:
        """Draw the seed of an episode."""
        return int(self._seeds[int(self.np_random.integers(len(self._seeds)))])

    def _begin(self, seed: int) -> _Running:
        """Set a world up and enter it."""
        scenario = self._scenario.with_(seed=seed).checked
        layout = make_layout(scenario)
        self._folder.mkdir(exist_ok=True)  # also after `close`
        options = replace(
            episode_options(scenario, layout, OutputOptions(full_statistics=False)),
            horizon=scenario.simulation.step_s,  # policies get no predictions
        )
        world = make_world(scenario, layout, self._folder)
        try:
            ego = world.enter()
            episode = RunningEpisode(
                world, self._planner, make_plant(scenario), layout.task, options, _mute
            )
            return _Running(world, layout, episode, episode.begin(ego))
        except BaseException:
            world.close()
            raise

    def _drive(
        self, running: _Running, action: Action
    ) -> tuple[StepRecord, Ending | None]:
        """Drive one step; return its end, and the ending of the episode if it has."""
        self._planner.action = action
        episode, record = running.episode, running.record
        try:
            record, ego = episode.drive(record)
            record = episode.advance(record, ego)
        except PlannerOutputError as error:
            return record, Ending(EpisodeStatus.PLANNER_FAILED, str(error))
        except SimulationError as error:
            return record, Ending(EpisodeStatus.SIMULATOR_FAILED, str(error))
        ending = episode.ending(record)
        if ending is None and record.off_road > OFF_ROAD_TOLERANCE:
            words = f"{record.off_road:.2f} m over the edge at t = {record.time:.1f} s"
            ending = Ending(EpisodeStatus.OFF_ROAD, words)
        return record, ending

    def _observation(self, running: _Running) -> Observation | None:
        """Observe the present; None where the ego has left the path's frame."""
        scene = running.episode.scene(running.record)
        return None if scene is None else observe(scene, self._shape)

    def _copy(self) -> Observation:
        """Return the last observation; callers may write into it."""
        assert self._seen is not None  # noqa: S101 - the first step has one
        return {name: values.copy() for name, values in self._seen.items()}

    def _info(self, ending: Ending | None, seed: int | None = None) -> dict[str, Any]:
        """Return facts about the present step."""
        assert self._running is not None  # noqa: S101 - of reset and step
        info = step_facts(self._running.record, ending)
        return info if seed is None else {**info, "scenario_seed": seed}

    def end_episode(self) -> None:
        """Close the world of the episode, so that another one may begin."""
        if self._running is not None:
            self._running.world.close()
            self._running = None


# The one whose episode runs here; kept, for who is dropped unclosed leaves SUMO behind
_holders: "set[HoldsProcess]" = set()


class HoldsProcess(Protocol):
    """An environment whose episode is the one simulation of its process."""

    def end_episode(self) -> None:
        """End the episode, if one runs."""


def take_process(env: HoldsProcess) -> None:
    """End the episode of another environment in this process."""
    for other in list(_holders):
        if other is not env:
            other.end_episode()
    _holders.clear()
    _holders.add(env)


def step_facts(record: StepRecord, ending: Ending | None) -> dict[str, Any]:
    """Return the facts about a step that `info` holds."""
    frenet = record.ego_frenet
    return {
        "status": "running" if ending is None else ending.status.value,
        "reason": "" if ending is None else ending.reason,
        "time_s": record.time,
        "s_m": None if frenet is None else frenet.s,
        "l_m": None if frenet is None else frenet.l,
        "speed_mps": record.ego.speed,
        "clearance_m": record.clearance,
        "is_success": ending is not None and ending.status is EpisodeStatus.ARRIVED,
    }


def require_seeds(seeds: object) -> None:
    """Raise ConfigError unless these are whole numbers to draw from."""
    allowed = f"a range or list of whole numbers from 0 to {LARGEST_SEED}"
    if not isinstance(seeds, Sequence) or isinstance(seeds, str | bytes):
        raise ConfigError(f"seeds: is {seeds!r}; allowed: {allowed}")
    if not seeds:
        raise ConfigError(f"seeds: are {seeds!r}; allowed: at least one")
    ends = (seeds[0], seeds[-1]) if isinstance(seeds, range) else seeds
    for seed in ends:
        whole = isinstance(seed, int) and not isinstance(seed, bool)
        if not whole or not 0 <= seed <= LARGEST_SEED:
            raise ConfigError(f"seeds: hold {seed!r}; allowed: {allowed}")


def require_reward(reward: object) -> None:
    """Raise ConfigError unless it can be called."""
    if not callable(reward):
        raise ConfigError(
            f"reward: is {reward!r}; allowed: a function of a Transition, see "
            "rearview.gym.progress_reward"
        )


def require_count(name: str, value: object, most: int = 10**6) -> None:
    """Raise a ConfigError unless an option is a whole number from 1 on."""
    if not isinstance(value, int) or not 1 <= value <= most:
        raise ConfigError(f"{name}: is {value!r}; allowed: 1 to {most}")


def observation_space(shape: ObservationShape) -> spaces.Dict:
    """Return the space of observations of a shape."""
    boxes: dict[str, spaces.Space[Any]] = {
        name: spaces.Box(0.0 if name == "mask" else -1.0, 1.0, size, np.float32)
        for name, size in shape.shapes.items()
    }
    return spaces.Dict(boxes)


def action_space(kind: ActionKind) -> spaces.Space[Any]:
    """Return the space of a kind of actions."""
    if kind is ActionKind.LANE_AND_SPEED:
        return spaces.MultiDiscrete([LANE_CHOICES, SPEED_CHOICES])
    size = 2 if kind is ActionKind.CONTROL else 3
    return spaces.Box(-1.0, 1.0, (size,), np.float32)


def cast_action(space: spaces.Space[Any], action: Any) -> Any:
    """Cast an array of numbers to the precision of its space; others stay."""
    if isinstance(space, spaces.Box) and isinstance(action, np.ndarray):
        return action.astype(space.dtype) if action.dtype.kind in "fiu" else action
    return action


def _mute(_: StepRecord) -> None:
    """Take note of no step: `step` returns them."""

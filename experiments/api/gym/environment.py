"""The environment: one episode at a time, driven by actions instead of a planner."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any
from weakref import finalize

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from experiments.api.gym.actions import (
    Action,
    ActionKind,
    drive,
)
from experiments.api.gym.observation import Observation, ObservationShape, observe
from experiments.api.gym.options import (
    LARGEST_SEED,
    TRAINING_SEEDS,
    require_count,
    require_seeds,
)
from experiments.api.gym.picture import picture
from experiments.api.gym.process_holder import take_process
from experiments.api.gym.rewards import Reward, progress_reward, require_reward
from experiments.api.gym.spaces import action_space, cast_action, observation_space
from experiments.api.gym.transition import TERMINAL, Transition, step_facts
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

MOST_TRIES = 20  # to find a drawn seed in which the ego finds room to enter
OF_ACTIONS = "cruise"  # any planner that leaves the ego's motion to its plans


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


def _mute(_: StepRecord) -> None:
    """Take note of no step: `step` returns them."""

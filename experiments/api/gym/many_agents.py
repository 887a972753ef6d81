"""Many egos of one simulation as agents of a PettingZoo environment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any
from weakref import finalize

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from pettingzoo import ParallelEnv

from experiments.api.gym.actions import Action, ActionKind, drive
from experiments.api.gym.observation import Observation, ObservationShape, observe
from experiments.api.gym.options import (
    LARGEST_SEED,
    TRAINING_SEEDS,
    require_count,
    require_seeds,
)
from experiments.api.gym.process_holder import take_process
from experiments.api.gym.rewards import Reward, progress_reward, require_reward
from experiments.api.gym.spaces import action_space, cast_action, observation_space
from experiments.api.gym.transition import TERMINAL, Transition, step_facts
from experiments.api.scenarios import Scenario
from experiments.config.egos import MOST_EGOS
from experiments.cosim.fleet.egos import FleetMoment, SeenEgo
from experiments.cosim.fleet.loop import GONE, FleetLoop
from experiments.cosim.fleet.records import FleetStep
from experiments.cosim.fleet.takeover import FleetGroup
from experiments.cosim.fleet.world import FleetWorld
from experiments.cosim.records import Ending, EpisodeStatus, StepRecord
from experiments.episode.fleet import make_fleet_loop
from experiments.errors import ConfigError, SimulationError
from experiments.world_setup.fleet import fleet_network
from planner.interface import PlanResult, PlanStatus
from planner.scene import Scene

Dicts = tuple[
    dict[str, Observation],
    dict[str, float],
    dict[str, bool],
    dict[str, bool],
    dict[str, dict[str, Any]],
]


@dataclass(slots=True)
class _ActionsPlanner:
    """Drives each ego by the action that its agent was given."""

    kind: ActionKind
    actions: dict[int, Action] = field(default_factory=dict)  # by the scene's identity

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Turn the action for a scene, which is the one that was observed, to a plan.

        An ego that has entered during an action of the others rolls on until its agent
        is asked.
        """
        action = self.actions.get(id(scene))
        if action is None:
            plan = drive(ActionKind.CONTROL, np.zeros(2), scene)
        else:
            plan = drive(self.kind, action, scene)
        status = PlanStatus.OK if plan is not None else PlanStatus.INVALID_SCENE
        return PlanResult(status, plan, memory)


@dataclass(slots=True)
class _Agent:
    """An agent whose ego is on the road, or has just left it."""

    seen: SeenEgo  # as last looked at
    observed: Observation
    reward: float = 0.0  # since its last action
    ending: Ending | None = None


@dataclass(slots=True)
class _Simulation:
    """A simulation that runs, and its agents."""

    world: FleetWorld
    loop: FleetLoop
    steps: list[FleetStep]
    moment: FleetMoment
    names: dict[str, str] = field(default_factory=dict)  # vehicle -> agent, ever
    agents: dict[str, _Agent] = field(default_factory=dict)
    stillborn: set[str] = field(default_factory=set)  # egos that no agent has driven
    ending: Ending | None = None  # of all: the time is over, or the simulator failed


class ManyAgentsEnv(ParallelEnv[str, Observation, Action]):  # type: ignore[misc]
    """A scenario with many egos; each is an agent from its entry to its end.

    Agents are `ego_0`, `ego_1`, ... in the order in which they enter. All act in every
    step. Where none is on the road, time goes on until one is. An agent that has failed
    leaves, and SUMO drives its vehicle on. SUMO is one simulation per process, as for
    `DrivingEnv`.

    Args:
        scenario: Shipped name or file; its egos are the first so many that enter.
        action: `control`, `lane_and_speed` or `frenet`, see `rearview.gym.drive`.
        egos: How many agents there are at most.
        changes: Keys of the scenario and their values.
        shape: Of the observation.
        repeat: Steps of the simulation that an action is driven for.
        reward: Of each agent in each step of the simulation.
        seeds: That episodes are drawn from where `reset` gets none.

    Raises:
        ConfigError: If the scenario is wrong, or has one ego.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as in the base class
        "name": "rearview_many_v0",
        "render_modes": [],
        "is_parallelizable": True,
    }

    def __init__(
        self,
        scenario: str | Path = "motorway",
        action: str = "lane_and_speed",
        egos: int = 20,
        changes: Mapping[str, Any] | None = None,
        shape: ObservationShape | None = None,
        repeat: int = 1,
        reward: Reward = progress_reward,
        seeds: Sequence[int] = TRAINING_SEEDS,
    ) -> None:
        kinds = [kind.value for kind in ActionKind]
        if action not in kinds:
            raise ConfigError(f"action: is {action!r}; allowed: {', '.join(kinds)}")
        require_count("egos", egos, MOST_EGOS)
        require_count("repeat", repeat)
        require_seeds(seeds)
        require_reward(reward)
        loaded = Scenario.load(scenario).with_(changes)
        groups = loaded.checked.egos
        if groups is None:
            raise ConfigError(
                f"scenario: {loaded.name} has one ego; allowed: one with `egos`"
            )
        kept = groups[0].model_dump(
            exclude_defaults=True, exclude={"penetration", "count", "planner"}
        )
        self._scenario = loaded.with_({"egos": {**kept, "count": egos}})
        self._repeat = repeat
        self._shape = shape or ObservationShape()
        self._reward = reward
        self._seeds = seeds
        self._generator = np.random.default_rng()
        self._planner = _ActionsPlanner(ActionKind(action))
        self._running: _Simulation | None = None
        self._folder = Path(mkdtemp(prefix="rearview-many-"))
        self._tidy = finalize(self, rmtree, self._folder, ignore_errors=True)
        self.render_mode = None
        self.agents: list[str] = []
        self.possible_agents = [f"ego_{number}" for number in range(egos)]
        self.observation_spaces: dict[str, spaces.Space[Any]] = {
            name: observation_space(self._shape) for name in self.possible_agents
        }
        self.action_spaces: dict[str, spaces.Space[Any]] = {
            name: action_space(self._planner.kind) for name in self.possible_agents
        }

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(
        self,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002 - none are known
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begin an episode, and go on until the first ego is on the road.

        Args:
            seed: Of the scenario; it seeds what is drawn afterwards too. None draws
                one.
            options: Left alone.

        Raises:
            ConfigError: If the scenario cannot be run.
            SimulationError: If the simulator fails.
        """
        self.end_episode()
        take_process(self)
        if seed is not None:
            self._generator = np.random.default_rng(seed)
            drawn = seed % (LARGEST_SEED + 1)
        else:
            drawn = int(self._seeds[int(self._generator.integers(len(self._seeds)))])
        self._running = running = self._begin(drawn)
        self._look(running, running.moment)
        while not running.agents and running.ending is None:
            self._advance(running, {})
        if not running.agents:
            self.end_episode()
            raise SimulationError(f"seed {drawn}: no ego enters while the time lasts")
        self.agents = list(running.agents)
        infos = {
            name: {**_info(agent, None), "scenario_seed": drawn}
            for name, agent in running.agents.items()
        }
        seen = {name: _copy(agent.observed) for name, agent in running.agents.items()}
        return seen, infos

    def step(self, actions: Mapping[str, Action]) -> Dicts:
        """Drive everybody's action, for one step of the simulation or `repeat` of them.

        Agents whose egos have entered meanwhile are in what is returned too.

        Args:
            actions: Of every agent.

        Returns:
            Observations, rewards, terminations, truncations and infos, by agent; see
            `DrivingEnv.step`.
        """
        running = self._running
        if running is None:
            raise ResetNeeded("call reset() first: no episode runs in this process")
        actions = {
            name: cast_action(self.action_spaces[name], given)
            for name, given in actions.items()
            if name in self.agents
        }
        for name in self.agents:
            given = actions.get(name)
            if given is None or not self.action_spaces[name].contains(given):
                allowed = self.action_spaces[name]
                raise ConfigError(f"step: {name}: {given!r}; allowed: {allowed}")
        for agent in running.agents.values():
            agent.reward = 0.0
        for _ in range(self._repeat):
            self._advance(running, actions)
            if running.ending is not None:
                break
        while running.ending is None and not self._is_over(running):
            if any(agent.ending is None for agent in running.agents.values()):
                break
            self._advance(running, {})
        return self._results(running)

    def close(self) -> None:
        """End the simulation; allowed at any time."""
        self.end_episode()
        self._tidy()

    def end_episode(self) -> None:
        """Close the world of the episode, so that another one may begin."""
        self.agents = []
        if self._running is not None:
            self._running.world.close()
            self._running = None

    def _begin(self, seed: int) -> _Simulation:
        """Start the simulation."""
        scenario = self._scenario.with_(seed=seed).checked
        self._folder.mkdir(exist_ok=True)  # also after `close`
        steps: list[FleetStep] = []
        world, loop = make_fleet_loop(
            scenario,
            fleet_network(scenario),
            (FleetGroup(self._planner),),
            self._folder,
            steps.append,
            horizon=scenario.simulation.step_s,  # policies get no predictions
        )
        try:
            world.enter()
            return _Simulation(world, loop, steps, loop.look(0))
        except BaseException:
            world.close()
            raise

    def _advance(self, running: _Simulation, actions: Mapping[str, Action]) -> None:
        """Go one step of the simulation on."""
        self._planner.actions = {
            id(agent.seen.scene()): actions[name]
            for name, agent in running.agents.items()
            if agent.ending is None and name in actions
        }
        running.steps.clear()
        try:
            if running.loop.move(running.moment):
                words = f"the time is over at t = {running.steps[0].time:.1f} s"
                running.ending = Ending(EpisodeStatus.TIMEOUT, words)
                return
            running.moment = running.loop.look(running.moment.index + 1)
        except SimulationError as error:
            running.ending = Ending(EpisodeStatus.SIMULATOR_FAILED, str(error))
            return
        for left in running.steps[0].leavings:
            agent = running.agents.get(running.names.get(left.id, ""))
            if agent is not None and agent.ending is None and left.how != GONE:
                ending = Ending(EpisodeStatus(left.how), left.reason)
                self._reward_step(running, agent, agent.seen.record, ending)
        self._look(running, running.moment)

    def _look(self, running: _Simulation, moment: FleetMoment) -> None:
        """Take note of what a moment shows, and of the egos that are new in it."""
        there = set()
        for seen in moment.egos:
            there.add(seen.ego.id)
            name = running.names.get(seen.ego.id)
            agent = None if name is None else running.agents.get(name)
            scene = seen.scene()
            if agent is not None and agent.ending is None:
                self._reward_step(running, agent, seen.record, seen.ending)
                agent.seen = seen
                if scene is not None:
                    agent.observed = observe(scene, self._shape)
            elif name is None and (scene is None or seen.ending is not None):
                running.stillborn.add(seen.ego.id)  # touched somebody as it entered
            elif name is None and scene is not None:
                name = self.possible_agents[len(running.names)]
                running.names[seen.ego.id] = name
                running.agents[name] = _Agent(seen, observe(scene, self._shape))
        for agent in running.agents.values():
            if agent.ending is None and agent.seen.ego.id not in there:
                agent.ending = Ending(EpisodeStatus.SIMULATOR_FAILED, GONE)

    def _reward_step(
        self,
        running: _Simulation,
        agent: _Agent,
        after: StepRecord,
        ending: Ending | None,
    ) -> None:
        """Reward an agent for a step, and note its ending."""
        task = agent.seen.ego.way.task
        transition = Transition(
            agent.seen.record, after, running.world.step, task.target_speed, ending
        )
        agent.reward += float(self._reward(transition))
        agent.ending = ending

    def _is_over(self, running: _Simulation) -> bool:
        """Tell whether every agent there can be has left."""
        entered = len(running.names) + len(running.stillborn)
        return entered == len(self.possible_agents) and all(
            agent.ending is not None for agent in running.agents.values()
        )

    def _results(self, running: _Simulation) -> Dicts:
        """Return what a step has brought; drop the agents that have left."""
        agents = running.agents
        endings = {name: one.ending or running.ending for name, one in agents.items()}
        terminated = {
            name: ending is not None and ending.status in TERMINAL
            for name, ending in endings.items()
        }
        truncated = {
            name: ending is not None and not terminated[name]
            for name, ending in endings.items()
        }
        result: Dicts = (
            {name: _copy(one.observed) for name, one in agents.items()},
            {name: one.reward for name, one in agents.items()},
            terminated,
            truncated,
            {name: _info(one, endings[name]) for name, one in agents.items()},
        )
        running.agents = {k: one for k, one in agents.items() if endings[k] is None}
        self.agents = list(running.agents)
        if not self.agents:
            self.end_episode()
        return result


def _copy(observation: Observation) -> Observation:
    """Return an observation that callers may write into."""
    return {name: values.copy() for name, values in observation.items()}


def _info(agent: _Agent, ending: Ending | None) -> dict[str, Any]:
    """Return facts about an agent's ego: those of `DrivingEnv`, and its vehicle."""
    return {**step_facts(agent.seen.record, ending), "vehicle": agent.seen.ego.id}

"""A conflict of UN Regulation 157 among SUMO's reacting traffic."""

from collections.abc import Set
from dataclasses import replace

import numpy as np

from experiments.cosim.conflict_world import ScriptedMotion, ScriptedTraffic
from experiments.cosim.records import TrafficState
from experiments.cosim.sumo import frames
from experiments.cosim.sumo.control_modes import KEEP_ROUTE_EXACT, NO_CHECKS
from experiments.cosim.sumo.ego_entry import EGO_ROUTE
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.obstacle_vehicles import SUMO_TYPE
from experiments.cosim.sumo.settings import VIEW_RADIUS, SumoSettings
from experiments.cosim.sumo.sumo_errors import sumo_errors
from experiments.cosim.sumo.world import SumoWorld
from planner.right_of_way.records import Foe
from planner.scene import RoadUsers
from planner.states import BoolArray, CartesianState
from planner.ways import Ways

PREFIX = "conflict@"  # no demand file names its vehicles like this
SIDE_ROOM = 0.5  # a vehicle of the traffic passing nearer is in the way [m]
STANDSTILL = 5.0  # least gap to a scripted vehicle at the start [m]
REACTION = 1.0  # of the driver behind [s]
BRAKING = 3.0  # of the driver behind [m/s²]


class SumoConflictWorld(SumoWorld):
    """A SUMO world in which scripted vehicles conflict with the ego once it is in.

    SUMO's traffic sees them and reacts to them; they react to nobody. What would be in
    their way when they appear is taken out of the traffic: it had no chance to react.

    Args:
        settings: Of the world.
        motions: Of the scripted vehicles, from where the ego starts.
    """

    def __init__(
        self, settings: SumoSettings, motions: tuple[ScriptedMotion, ...]
    ) -> None:
        super().__init__(settings)
        self._script = ScriptedTraffic(settings.road, settings.task, motions)
        self._start_s = settings.task.start.s
        self._ego_s = settings.task.start.s

    def enter(self) -> CartesianState:
        """Insert the ego, then the scripted vehicles; see `SumoWorld.enter`."""
        ego = super().enter()
        sumo, near = self._running(), super().observe().vehicles
        with sumo_errors(sumo, "inserting the vehicles of the conflict"):
            for name in np.array(near.ids, dtype=object)[self._in_way(near)]:
                sumo.vehicle.remove(name)
                self._hidden.add(name)
            for motion in self._script.motions:
                self._add(sumo, motion)
            self._move(sumo)
        return ego

    def observe(self) -> TrafficState:
        """Read the traffic; the scripted vehicles are where their script says."""
        traffic, script = super().observe(), self._script
        rows = [
            script.row(k)
            for k in range(len(script.motions))
            if script.is_visible(k, self._ego_s)
            and abs(script.place(k)[0] - self._ego_s) < VIEW_RADIUS
        ]
        scripted, others = script.users(rows), traffic.vehicles
        ids = (*others.ids, *scripted.ids)
        order = sorted(range(len(ids)), key=ids.__getitem__)
        table = np.concatenate([others.table, scripted.table], axis=1)[:, order]
        users = RoadUsers.from_table(tuple(ids[k] for k in order), table)
        return replace(traffic, vehicles=users)

    def movements(
        self, near: Set[int], vehicles: RoadUsers
    ) -> tuple[tuple[Foe, ...], Ways]:
        """Read SUMO's own vehicles at junctions; scripted ones have no route."""
        scripted = {motion.id for motion in self._script.motions}
        own = vehicles.among(np.array([x not in scripted for x in vehicles.ids]))
        foes, ways = super().movements(near, own)
        return foes, ways.renamed(own.ids, vehicles.ids)

    def advance(self, ego: CartesianState) -> CartesianState:
        """Move scripted vehicles and ego, and let SUMO move all others."""
        sumo, path = self._running(), self.road.path
        self._script.advance()
        with sumo_errors(sumo, "moving the vehicles of the conflict"):
            self._move(sumo)
        s, _ = path.project(np.array([ego.x]), np.array([ego.y]), near=self._ego_s)
        self._ego_s = float(s[0])
        return super().advance(ego)

    def _in_way(self, near: RoadUsers) -> BoolArray:
        """Return which vehicles of the traffic are in the way of the script, (n,).

        Those in the lanes of ego and scripted vehicle that could not keep out of its
        way: beside or behind it too near to brake, or ahead and too near to leave.
        """
        path, script = self.road.path, self._script
        s, l = path.project(near.x, near.y)
        found = np.zeros(len(near.ids), dtype=np.bool_)
        for k, motion in enumerate(script.motions):
            at, offset, speed = script.place(k)
            lanes = {offset, self._settings.task.start.l}
            beside = np.zeros(found.shape, dtype=np.bool_)
            for lane in lanes:
                room = 0.5 * (motion.width + near.width) + SIDE_ROOM
                beside |= np.abs(l - lane) < room
            gap = np.abs(s - at) - 0.5 * (motion.length + near.length)
            behind = s < at
            fast = np.where(behind, near.speed, speed)
            slow = np.where(behind, speed, near.speed)
            longer = np.maximum(fast**2 - slow**2, 0.0) / (2.0 * BRAKING)
            after_ego = behind & (s < self._start_s) & (np.abs(l - offset) > room)
            found |= beside & (gap < STANDSTILL + REACTION * fast + longer) & ~after_ego
        return found

    def _add(self, sumo: Libsumo, motion: ScriptedMotion) -> None:
        """Add a vehicle that SUMO does not drive."""
        name, vehicles = PREFIX + motion.id, sumo.vehicle
        vehicles.add(name, EGO_ROUTE, typeID=SUMO_TYPE, departSpeed="0")
        vehicles.setLength(name, motion.length)
        vehicles.setWidth(name, motion.width)
        vehicles.setSpeedMode(name, NO_CHECKS)
        vehicles.setLaneChangeMode(name, 0)
        self._hidden.add(name)  # read from the script, not from SUMO

    def _move(self, sumo: Libsumo) -> None:
        """Put all scripted vehicles where their script says."""
        script = self._script
        users = script.users([script.row(k) for k in range(len(script.motions))])
        for k, motion in enumerate(script.motions):
            name, half = PREFIX + motion.id, 0.5 * motion.length
            heading = float(users.heading[k])
            x = float(users.x[k]) + half * np.cos(heading)
            y = float(users.y[k]) + half * np.sin(heading)
            sumo.vehicle.setSpeed(name, float(users.speed[k]))
            angle = frames.angle_from_heading(heading)
            sumo.vehicle.moveToXY(name, "", -1, x, y, angle, KEEP_ROUTE_EXACT)

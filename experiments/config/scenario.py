"""The whole scenario: sections that agree, and what follows from all of them."""

from collections.abc import Mapping
from typing import Any, Self

from pydantic import ConfigDict, model_validator

from experiments.config.checks.conflicts import check_conflict
from experiments.config.checks.egos import check_egos
from experiments.config.checks.timing import check_timing
from experiments.config.checks.worlds import check_world
from experiments.config.planner_choice import PlannerChoice, default_planner
from experiments.config.sections import ScenarioSections
from experiments.config.self_driven import SUMO
from experiments.config.yaml_reader import KeyPath


class Scenario(ScenarioSections):
    """One episode: a road, an ego, what is in its way, and a planner."""

    model_config = ConfigDict(title="rearview scenario")

    @model_validator(mode="before")
    @classmethod
    def _planner_of_the_network(cls, data: Any) -> Any:
        """Choose the planner where none is named."""
        if isinstance(data, Mapping) and "planner" not in data:
            return {**data, "planner": default_planner(data)}
        return data

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        """Reject sections that do not go together."""
        check_egos(self)
        check_world(self)
        check_timing(self)
        check_conflict(self)
        return self

    @property
    def driven_by(self) -> str:
        """Name what drives: the planner of the ego, or those of the groups of egos.

        A group without a share or number of vehicles drives nothing; without any group
        that does, SUMO's driver drives all.
        """
        if self.egos is None:
            return self.planner.name
        groups = [group for group in self.egos if group.penetration or group.count]
        names = [(group.planner or self.planner).name for group in groups]
        return "+".join(dict.fromkeys(names)) or SUMO

    def planner_choices(self) -> list[tuple[KeyPath, PlannerChoice]]:
        """List all planners that the scenario names, and the keys that name them."""
        found: list[tuple[KeyPath, PlannerChoice]] = [
            (("planner", "name"), self.planner)
        ]
        for number, group in enumerate(self.egos or ()):
            if group.planner is not None:
                one = len(self.egos or ()) == 1
                place: KeyPath = ("egos",) if one else ("egos", number)
                found.append(((*place, "planner", "name"), group.planner))
        return found

    def resolved(self) -> dict[str, Any]:
        """Return the whole configuration as plain data that reads back the same."""
        data: dict[str, Any] = self.model_dump(
            mode="json", exclude_none=True, by_alias=True
        )
        if self.network is not None and self.network.name is not None:
            data["network"] = self.network.name
        if self.egos is not None and len(self.egos) == 1:
            data["egos"] = data["egos"][0]
        if self.obstacles.closure is None:
            listed = data["obstacles"].pop("listed")
            data["obstacles"] = data["obstacles"] or listed
        if self.world == "sumo":
            data.setdefault("traffic", "none")
        if self.world == "commonroad" and self.ego.plant is None:
            data["ego"]["plant"] = "perfect"  # silence would mean a kinematic one
        return data

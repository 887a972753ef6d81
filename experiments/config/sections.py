"""The sections of a scenario, and the place where each key was written."""

import re
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Discriminator, Field, PrivateAttr, Tag

from experiments.config.base import LONGEST_NAME, Name, Strict, as_section
from experiments.config.conflict import Conflict
from experiments.config.ego import Ego
from experiments.config.egos import EgoGroup, Measurement, read_groups
from experiments.config.obstacles import (
    ClosureSection,
    DrawnSection,
    Obstacle,
    ObstaclesConfig,
    read_obstacles,
)
from experiments.config.planner_choice import (
    DEFAULT_PLANNER,
    NETWORK_PLANNER,
    PlannerChoice,
)
from experiments.config.road import KinematicRoad, NetworkConfig
from experiments.config.simulation import Simulation
from experiments.config.traffic import (
    ScriptedVehicleConfig,
    SumoTraffic,
    Traffic,
    read_traffic,
    traffic_kind,
)
from experiments.config.yaml_reader import Document, KeyPath, dotted
from experiments.errors import ConfigError

AnyTraffic = Annotated[
    Annotated[Traffic, Tag("flows")] | Annotated[SumoTraffic, Tag("files")],
    Discriminator(traffic_kind),
]


def scenario_name(text: str) -> str:
    """Make the name of a scenario of any text, such as that of a file."""
    return re.sub("[^A-Za-z0-9_]", "_", text)[:LONGEST_NAME] or "_"


class ScenarioSections(Strict):
    """What a scenario file may say; `Scenario` checks that it agrees."""

    _document: Document | None = PrivateAttr(None)

    name: Name
    purpose: str = Field("", description="one sentence, shown by `rearview list`")
    world: Literal["sumo", "kinematic", "commonroad"] = "sumo"
    network: (
        Annotated[
            NetworkConfig,
            BeforeValidator(
                as_section("name"), json_schema_input_type=str | NetworkConfig
            ),
        ]
        | None
    ) = Field(
        default=None,
        description="world sumo: a network of the catalogue or a file; world "
        "commonroad: a scenario's file",
    )
    road: KinematicRoad | None = Field(default=None, description="world kinematic")
    single_ego: Ego | None = Field(
        default=None, alias="ego", description="needed unless there are `egos`"
    )
    egos: Annotated[
        tuple[EgoGroup, ...] | None,
        Field(min_length=1),
        BeforeValidator(
            read_groups, json_schema_input_type=EgoGroup | tuple[EgoGroup, ...]
        ),
    ] = Field(
        default=None,
        description="world sumo: vehicles of the traffic driven by planners, instead "
        "of one ego",
    )
    measurement: Measurement | None = Field(default=None, description="with egos")
    obstacles: Annotated[
        ObstaclesConfig,
        BeforeValidator(
            read_obstacles,
            json_schema_input_type=Literal["none"]
            | tuple[Obstacle, ...]
            | DrawnSection
            | ClosureSection,
        ),
    ] = ObstaclesConfig()
    traffic: Annotated[
        AnyTraffic | None,
        BeforeValidator(
            read_traffic, json_schema_input_type=Literal["none"] | AnyTraffic
        ),
    ] = Field(default=None, description="world sumo")
    vehicles: tuple[ScriptedVehicleConfig, ...] = Field(
        default=(), description="world kinematic"
    )
    conflict: Conflict | None = Field(
        default=None,
        description="world kinematic: on a straight road of three lanes; world sumo: "
        "among traffic, which reacts to its vehicles",
    )
    planner: Annotated[
        PlannerChoice,
        BeforeValidator(as_section("name"), json_schema_input_type=str | PlannerChoice),
    ] = Field(
        default=PlannerChoice(name=DEFAULT_PLANNER),
        description=f"default: {NETWORK_PLANNER} on the network of a file, else "
        f"{DEFAULT_PLANNER}",
    )
    simulation: Simulation = Simulation()

    @property
    def ego(self) -> Ego:
        """The ego's section.

        Raises:
            ConfigError: If the scenario has many egos.
        """
        if self.single_ego is None:
            problem = "is missing: this is for one ego; allowed: ego instead of egos"
            raise self.error(("ego",), problem, ("egos",))
        return self.single_ego

    def from_document(self, document: Document) -> Self:
        """Remember where the keys were written, for messages that come later."""
        self._document = document
        return self

    def error(
        self, path: KeyPath, problem: str, written: KeyPath | None = None
    ) -> ConfigError:
        """Build the error about a key, naming the place where it was written.

        Args:
            path: The key.
            problem: What is wrong with it, and what is allowed.
            written: Another key whose place is named instead.
        """
        place = path if written is None else written
        document = self._document
        where, clash = (
            (document.where(place), document.beside(place))
            if document
            else (self.name, "")
        )
        return ConfigError(f"{where}{clash}: {dotted(path)}: {problem}")

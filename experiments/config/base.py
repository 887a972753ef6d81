"""What all sections of a scenario have in common."""

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

Speed = Annotated[float, Field(ge=0.0, le=70.0)]
Position = Annotated[float, Field(ge=0.0, le=100_000.0)]
Offset = Annotated[float, Field(ge=-100.0, le=100.0)]
Size = Annotated[float, Field(gt=0.0, le=50.0)]
Heading = Annotated[float, Field(ge=-6.3, le=6.3)]
Curvature = Annotated[float, Field(ge=-1.0, le=1.0)]
Length = Annotated[float, Field(gt=0.0, le=100_000.0)]
Rate = Annotated[float, Field(gt=0.0, le=30.0)]
Flow = Annotated[float, Field(ge=0.0, le=9000.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
NAME = r"^[A-Za-z0-9_]+$"
LONGEST_NAME = 100  # names become parts of those of folders, which have 255 characters
Name = Annotated[str, Field(pattern=NAME, max_length=LONGEST_NAME)]


class Strict(BaseModel):
    """A section of the file: closed, strictly typed, finite, unchangeable."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False
    )


def as_section(key: str) -> Callable[[Any], Any]:
    """Build a reader that lets a bare name stand for `{key: name}`."""

    def read(value: Any) -> Any:
        return {key: value} if isinstance(value, str) else value

    return read


def mismatch(key: str, problem: str) -> PydanticCustomError:
    """Build an error about `key`, seen from the section that is checked."""
    return PydanticCustomError(
        "inconsistent", "{problem}", {"key": key, "problem": problem}
    )

"""What the thesis publishes: `published.yaml`, read strictly into frozen records."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError

from experiments.config.base import Strict
from experiments.config.scenario_file import tuples
from experiments.config.validation_errors import describe
from experiments.config.yaml_reader import Document, read_document
from experiments.errors import ConfigError

FILE = Path(__file__).parent / "published.yaml"


@dataclass(frozen=True, slots=True)
class PublishedTable:
    """One table of the thesis as printed."""

    number: str
    title: str
    columns: tuple[str, ...]
    rows: Mapping[str, tuple[float | None, ...]]

    @property
    def place(self) -> str:
        """Place in the thesis."""
        return f"Table {self.number}"

    def value(self, row: str, column: str) -> float:
        """Look up one number.

        Raises:
            KeyError: If there is no such row, or no number in this column.
        """
        found = self.rows[row][self.columns.index(column)]
        if found is None:
            raise KeyError(f"{self.place}: {row}, {column} has no number")
        return found


class Statement(Strict):
    """One number of the text."""

    place: str
    value: float
    unit: str
    words: str


class Slip(Strict):
    """A printed number that contradicts the thesis itself."""

    place: str
    printed: float
    unit: str
    right: float
    why: str


@dataclass(frozen=True, slots=True)
class Published:
    """All that the thesis publishes in chapters 4 to 6."""

    tables: Mapping[str, PublishedTable]
    text: Mapping[str, Statement]
    slips: tuple[Slip, ...]


class _Table(Strict):
    """One table of the file."""

    title: str
    columns: Annotated[tuple[str, ...], Field(min_length=1)]
    rows: dict[str, tuple[float | None, ...]]


class _File(Strict):
    """The file."""

    tables: dict[str, _Table]
    text: dict[str, Statement]
    slips: tuple[Slip, ...]


@cache
def published(file: Path = FILE) -> Published:
    """Read the file.

    Raises:
        ConfigError: One line that says what does not fit.
    """
    document = read_document(file)
    try:
        found = _File.model_validate(tuples(document.data))
    except ValidationError as error:
        line = describe(error, document, _File.model_json_schema())
        raise ConfigError(line) from error
    tables = {
        number: _table(number, table, document)
        for number, table in found.tables.items()
    }
    return Published(tables, found.text, found.slips)


def _table(number: str, table: _Table, document: Document) -> PublishedTable:
    """Check that every row has all columns."""
    for name, row in table.rows.items():
        if len(row) != len(table.columns):
            where = document.where(("tables", number, "rows", name))
            raise ConfigError(
                f"{where}: {name}: has {len(row)} numbers; allowed: "
                f"{len(table.columns)}, one a column"
            )
    return PublishedTable(number, table.title, table.columns, table.rows)

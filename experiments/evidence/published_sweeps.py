"""The shipped sweeps whose figures are published, whole or reduced."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from experiments.config.axes import Axes, Values
from experiments.config.sweep import SeedRange, Sweep
from experiments.config.sweep_file import load_sweep, sweep_names
from experiments.config.validation_errors import unknown_name
from experiments.config.yaml_reader import Document
from experiments.errors import ConfigError

Kept = TypeVar("Kept")
QUICK_SEEDS = 1
SCENARIO = "scenario"  # beside the axes, a key of `--only`


@dataclass(frozen=True, slots=True)
class Reduction:
    """What is left out of the published sweeps."""

    seeds: int | None = None  # the first ones only
    only: tuple[str, ...] = ()  # KEY=VALUE of an axis, or scenario=NAME
    quick: bool = False  # one seed of the first scenario and the first values


@dataclass(frozen=True, slots=True, eq=False)
class PublishedSweep:
    """A published sweep as it is run, and what its file asks for."""

    sweep: Sweep
    document: Document
    asked_seeds: int
    asked_runs: int


def published_names() -> list[str]:
    """List the shipped sweeps whose claim is published."""
    found = ((name, load_sweep(name)[0].claim) for name in sweep_names())
    return [name for name, claim in found if claim is not None and claim.published]


def published_sweeps(
    names: Sequence[str], reduction: Reduction
) -> list[PublishedSweep]:
    """Read published sweeps.

    Args:
        names: Which; all if empty.
        reduction: What is left out.

    Raises:
        ConfigError: If there is no such published sweep, or it has fewer seeds, or no
            such value on an axis.
    """
    known = published_names()
    for name in names:
        if name not in known:
            raise ConfigError(
                f"{name}: no such published sweep; {unknown_name(name, known)}"
            )
    found = []
    for name in names or known:
        sweep, document = load_sweep(name)
        reduced = _reduced(sweep, reduction)
        asked = len(sweep.all_seeds)
        found.append(PublishedSweep(reduced, document, asked, sweep.count))
    return found


def _reduced(sweep: Sweep, reduction: Reduction) -> Sweep:
    """Return a sweep with fewer seeds, scenarios and values."""
    asked, seeds = len(sweep.all_seeds), sweep.seeds
    count = QUICK_SEEDS if reduction.quick else reduction.seeds or asked
    if count > asked:
        raise ConfigError(
            f"--seeds {count}: {sweep.name} has {asked}; allowed: 1 to {asked}"
        )
    fewer = (
        SeedRange(first=seeds.first, count=count)
        if isinstance(seeds, SeedRange)
        else seeds[:count]
    )
    scenarios, axes = sweep.scenarios, sweep.axes
    if reduction.quick:
        scenarios = scenarios[:1]
        axes = _with_grid(axes, {key: of[:1] for key, of in axes.grid.items()})
    for words in reduction.only:
        key, _, value = words.partition("=")
        if key == SCENARIO:
            scenarios = _kept(words, scenarios, value)
        elif key in axes.grid:
            kept = _kept(words, axes.grid[key], value)
            axes = _with_grid(axes, {**axes.grid, key: kept})
        else:
            hint = unknown_name(key, [SCENARIO, *axes.grid])
            raise ConfigError(f"--only {words}: {sweep.name} has no such axis; {hint}")
    changes = {"seeds": fewer, "scenarios": scenarios, "axes": axes}
    return sweep.model_copy(update=changes)


def _kept(words: str, values: Sequence[Kept], value: str) -> tuple[Kept, ...]:
    """Return the values of an axis that were asked for."""
    kept = tuple(one for one in values if str(one) == value)
    if not kept:
        hint = unknown_name(value, [str(one) for one in values])
        raise ConfigError(f"--only {words}: no such value; {hint}")
    return kept


def _with_grid(axes: Axes, grid: dict[str, Values]) -> Axes:
    """Return axes with another grid."""
    return axes.model_copy(update={"grid": grid})

"""Options of environments: seeds and numbers."""

from collections.abc import Sequence

from experiments.errors import ConfigError

TRAINING_SEEDS = range(1000)  # that episodes are drawn from
LARGEST_SEED = 2**31 - 1


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


def require_count(name: str, value: object, most: int = 10**6) -> None:
    """Raise a ConfigError unless an option is a whole number from 1 on."""
    if not isinstance(value, int) or not 1 <= value <= most:
        raise ConfigError(f"{name}: is {value!r}; allowed: 1 to {most}")

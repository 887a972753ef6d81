"""What a document says of runs on seeds that planners are tuned on."""

from collections.abc import Iterable

from experiments.config.sweep import DEVELOPMENT_SEEDS

WORDS = (
    "With development seeds, {range}, on which planners are tuned: "
    "a first look and no claim.\n"
)


def first_look(seeds: Iterable[int]) -> list[str]:
    """Return the paragraph that goes with results; none without such seeds."""
    if not any(seed in DEVELOPMENT_SEEDS for seed in seeds):
        return []
    tuned = f"{DEVELOPMENT_SEEDS[0]} to {DEVELOPMENT_SEEDS[-1]}"
    return [WORDS.format(range=tuned)]

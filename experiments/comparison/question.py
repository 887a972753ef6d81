"""The question of a sweep: its claim, where the command line asks nothing else."""

from collections.abc import Sequence
from pathlib import Path

from experiments.comparison.compare import Center, Question
from experiments.config.sweep import SweepClaim
from experiments.errors import ConfigError
from experiments.metrics.catalogue import MEANS, RATES
from experiments.sweep.folder import has_sweep_copy, load_sweep_copy


def question_of(
    folder: Path,
    baseline: str | None = None,
    metrics: Sequence[str] | None = None,
    by: Sequence[str] | None = None,
    center: Center = Center.MEAN,
) -> Question:
    """Build the question that is put to a sweep.

    Args:
        folder: Of the sweep.
        baseline: Of the claim if None.
        metrics: Those of the claim and the usual ones if None; the p values of given
            ones are corrected together.
        by: See `Question`; those of the claim if None.
        center: See `Question`.

    Raises:
        ConfigError: If there is neither a baseline nor a claim.
    """
    claim = load_sweep_copy(folder).claim if has_sweep_copy(folder) else None
    baseline = baseline or (claim.baseline if claim else None)
    if baseline is None:
        raise ConfigError(
            f"--baseline: is missing; {folder} is of a sweep without a claim, which "
            "would name one"
        )
    if metrics is None and claim is not None:
        return claimed(claim, baseline, by, center)
    penalty = claim.penalty_s if claim else None
    return Question(baseline, metrics, None, by, center, penalty)


def claimed(
    claim: SweepClaim,
    baseline: str,
    by: Sequence[str] | None = None,
    center: Center = Center.MEAN,
) -> Question:
    """Build the question of a claim: its metrics in one family, the usual beside."""
    others = [name for name in (*RATES, *MEANS) if name not in claim.primary]
    metrics = (*claim.primary, *others)
    by = claim.by if by is None else by
    return Question(baseline, metrics, claim.primary, by, center, claim.penalty_s)

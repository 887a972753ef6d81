"""From verdicts and cost terms to the cheapest candidate; [Thesis] eq. 4.14."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.cruise import costs
from planner.cruise.costs import N_TERMS, SAFETY, TERMS, convolve
from planner.cruise.feasibility import Check
from planner.cruise.settings import CruiseSettings, Normalisation, SafetyTerm
from planner.numerics.compiled import inlined
from planner.states import FloatArray, IntArray

TINY = 1e-12  # a term that is nowhere larger makes no difference
N_CHECKS = len(Check)
PASSED = int(Check.PASSED)
COLLISION = int(Check.COLLISION)
UNJUDGED = -1  # verdict on a candidate that cannot be the cheapest
WITHOUT_MEMORY = np.array([float(name != "consistency") for name in TERMS])

PricingColumns = tuple[FloatArray, FloatArray, bool, FloatArray, bool]


@dataclass(frozen=True, slots=True, eq=False)
class Pricing:
    """Weights and scales of the prices, from the settings."""

    weights: FloatArray  # (9,), in the order of `costs.TERMS`
    scales: FloatArray  # (9,); not used where the normalisation is per cycle
    per_cycle: bool
    kernel: FloatArray  # of the safety by convolution, empty without it
    binary: bool

    @property
    def separable(self) -> bool:
        """Whether a candidate's cost is its own and no term lowers it.

        Then candidates can be left out that cost too much before all terms are known.
        """
        own = self.kernel.size == 0 and not self.per_cycle
        return own and bool((self.weights >= 0.0).all() and (self.scales > 0.0).all())

    @classmethod
    def of(cls, settings: CruiseSettings) -> "Pricing":
        """Return the settings as arrays."""
        scales = {name: getattr(settings.scales, name, 1.0) for name in TERMS}
        scales["jerk"] *= settings.horizon or max(settings.times)
        term = settings.safety_term
        return cls(
            np.array([getattr(settings.weights, name) for name in TERMS]),
            np.array([scales[name] for name in TERMS]),
            settings.normalisation is Normalisation.PER_CYCLE,
            costs.safety_kernel(
                term, settings.lateral_step, settings.convolution_sigma
            ),
            term is SafetyTerm.BINARY_CONVOLUTION,
        )

    def columns(self, *, remembers: bool) -> PricingColumns:
        """Return the columns for `choose`; consistency needs a last plan."""
        weights = self.weights if remembers else self.weights * WITHOUT_MEMORY
        return weights, self.scales, self.per_cycle, self.kernel, self.binary


class Choice(NamedTuple):
    """The outcome of one cycle; candidates count profile by profile."""

    best: int  # cheapest candidate that passed, -1 without one
    cheapest: int  # cheapest of those that passed or only collide, -1 without one
    counts: IntArray  # candidates by verdict, without the unjudged, (n_checks,)
    terms: FloatArray  # weighted terms of the best one, (9,)
    raw: FloatArray  # the same without weights and scales, (9,)


@inlined
def choose(
    verdict: IntArray, hit_size: FloatArray, terms: FloatArray, pricing: PricingColumns
) -> Choice:
    """Make the terms comparable, add them up and take the least.

    Args:
        verdict: The `Check` that removed each candidate, (n_profiles, n_offsets).
        hit_size: Radius of the largest body that each hits, 0 if none, in the same
            shape [m].
        terms: Raw ones, (n_profiles, 9, n_offsets); the safety is overwritten if it is
            one by convolution.
        pricing: Columns of the `Pricing`.
    """
    weights, _, per_cycle, kernel, binary = pricing
    n = verdict.shape[1]
    if kernel.size > 0:
        _put_safety(convolve(hit_size, kernel, binary), terms)
    factor = fixed_factors(pricing)
    if per_cycle:
        for t in range(N_TERMS):
            factor[t] = weights[t] / _largest_of_passed(terms, verdict, t)
    counts = np.zeros(N_CHECKS, np.int64)
    best, cheapest = -1, -1
    least, least_of_all = np.inf, np.inf
    for k in range(verdict.size):
        p, o = k // n, k % n
        check = verdict[p, o]
        if check == UNJUDGED:
            continue
        counts[check] += 1
        total = total_of(terms[p], factor, o)
        if check == PASSED and total < least:
            best, least = k, total
        if check in (PASSED, COLLISION) and total < least_of_all:
            cheapest, least_of_all = k, total
    raw, weighted = np.zeros(N_TERMS), np.zeros(N_TERMS)
    if best >= 0:
        for t in range(N_TERMS):
            raw[t] = terms[best // n, t, best % n]
            weighted[t] = factor[t] * raw[t]
    return Choice(best, cheapest, counts, weighted, raw)


@inlined
def _put_safety(safety: FloatArray, terms: FloatArray) -> None:
    """Overwrite the safety; in a loop, as a slice takes numba 2 s to compile."""
    for p in range(safety.shape[0]):
        for o in range(safety.shape[1]):
            terms[p, SAFETY, o] = safety[p, o]


@inlined
def fixed_factors(pricing: PricingColumns) -> FloatArray:
    """Return the weights over the scales, (9,); useless where these are per cycle."""
    weights, scales, _, _, _ = pricing
    factor = np.empty(N_TERMS)
    for t in range(N_TERMS):
        factor[t] = weights[t] / scales[t]
    return factor


@inlined
def total_of(own: FloatArray, factor: FloatArray, o: int) -> float:
    """Weighted sum of the terms of one candidate of a profile; grows with each."""
    total = 0.0
    for t in range(N_TERMS):
        total += factor[t] * own[t, o]
    return total


@inlined
def _largest_of_passed(terms: FloatArray, verdict: IntArray, t: int) -> float:
    """Return the largest value of a term among the feasible, 1 if hardly any."""
    largest = 0.0
    for p in range(verdict.shape[0]):
        for o in range(verdict.shape[1]):
            if verdict[p, o] == PASSED:
                largest = max(largest, terms[p, t, o])
    return largest if largest > TINY else 1.0

"""Which vehicles are egos: by a hash of seed and id, or the first that enter."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import blake2b

from experiments.cosim.fleet.records import HUMAN


@dataclass(frozen=True, slots=True)
class GroupShare:
    """Who may belong to a group, and how many."""

    of: tuple[str, ...] | None = None  # types, flows, vehicles; None: anybody
    penetration: float | None = None
    count: int | None = None

    def admits(self, name: str, kind: str) -> bool:
        """Tell whether a vehicle may belong to the group.

        Args:
            name: Its id: that of its flow, a dot, and a number.
            kind: Its type.
        """
        if self.of is None:
            return True
        return any(one in (name, kind, name.rpartition(".")[0]) for one in self.of)


def lot(seed: int, name: str) -> float:
    """Return a number in [0, 1) that is the vehicle's own."""
    digest = blake2b(f"{seed} {name}".encode(), digest_size=8).digest()
    return int.from_bytes(digest) / 2.0**64


@dataclass(slots=True)
class EgoSelection:
    """Decides for each vehicle that enters to which group it belongs.

    A vehicle's lot decides for shares. Groups take consecutive intervals of the lots:
    the vehicles of a smaller first share are among those of a larger one.
    """

    groups: Sequence[GroupShare]
    seed: int
    _counts: list[int] = field(init=False)
    _matched: list[int] = field(init=False)  # vehicles that each group admits
    _kinds: set[str] = field(init=False)  # types of vehicles that entered

    def __post_init__(self) -> None:
        """Begin without vehicles."""
        self._counts = [0] * len(self.groups)
        self._matched = [0] * len(self.groups)
        self._kinds = set()

    def never_met(self) -> list[str]:
        """Say for each group whose types, flows or vehicles never entered which."""
        there = ", ".join(sorted(self._kinds)) or "none"
        return [
            f"no vehicle was of {', '.join(group.of)} (types that entered: {there})"
            for group, matched in zip(self.groups, self._matched, strict=True)
            if group.of is not None and not matched
        ]

    def release(self, group: int) -> None:
        """Give a place back: its vehicle cannot be an ego."""
        self._counts[group] -= 1

    def choose(self, name: str, kind: str) -> int:
        """Return the group of a vehicle that enters, or HUMAN.

        Args:
            name: Its id.
            kind: Its type.
        """
        self._kinds.add(kind)
        drawn, begin = lot(self.seed, name), 0.0
        chosen = HUMAN
        for number, group in enumerate(self.groups):
            if not group.admits(name, kind):
                continue
            self._matched[number] += 1
            if group.count is not None:
                takes = self._counts[number] < group.count
            else:
                end = begin + (group.penetration or 0.0)
                takes = begin <= drawn < end
                begin = end
            if takes and chosen == HUMAN:
                self._counts[number] += 1
                chosen = number
        return chosen

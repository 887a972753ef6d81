"""Which columns of a wide table stand side by side, and which below."""

from collections.abc import Sequence

WIDTH = 120  # where there is no terminal [characters]
KEYS = ("metric", "where", "planner")  # that tell a row, and stand in every block
FRAME = 3  # characters between two columns; one more closes the table


def blocks(
    names: Sequence[str], rows: Sequence[Sequence[str]], width: int
) -> list[list[int]]:
    """Divide the columns of a table into blocks, each as wide as it can be.

    Args:
        names: Of the columns.
        rows: Texts.
        width: Of the terminal [characters].

    Returns:
        Numbers of columns; every block has those that tell a row, and at least one
        other one if there is one.
    """
    keys = [number for number, name in enumerate(names) if name in KEYS]
    others = [number for number in range(len(names)) if number not in keys]
    widths = _widths(names, rows)
    found: list[list[int]] = []
    for number in others:
        room = width - 1 - widths[number] - FRAME
        if found and sum(widths[k] + FRAME for k in found[-1]) <= room:
            found[-1].append(number)
        else:
            found.append([*keys, number])
    return found or [keys]


def says(row: Sequence[str], block: Sequence[int], names: Sequence[str]) -> bool:
    """Tell whether a row has anything to say in a block but which row it is."""
    return any(row[number] for number in block if names[number] not in KEYS)


def whole_width(names: Sequence[str], rows: Sequence[Sequence[str]]) -> int:
    """Return the width of the whole table [characters]."""
    return sum(width + FRAME for width in _widths(names, rows)) + 1


def _widths(names: Sequence[str], rows: Sequence[Sequence[str]]) -> list[int]:
    """Return the widths of columns."""
    return [
        max(len(text) for text in (name, *(row[number] for row in rows)))
        for number, name in enumerate(names)
    ]

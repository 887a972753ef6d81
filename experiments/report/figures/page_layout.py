"""Layout of the figure of a run, in inches from its lower left corner."""

from dataclasses import dataclass

WIDTH = 7.2  # two columns of a journal [in]
LEFT, RIGHT = 0.55, 0.1  # margins, the left one for the numbers of the axes [in]
BOTTOM = 0.42  # for numbers and name of the time axis [in]
HEADER = 0.68  # title and legend [in]
BETWEEN = 0.52  # view and curves, columns of curves; for numbers and names [in]
GAP = 0.1  # curves above each other [in]
CURVE = 1.05  # height of a curve [in]
BAR = (1.3, 0.07)  # colour bar, length and thickness [in]
TALL = 0.75  # height over width from which the curves stand beside the view
MAX_VIEW_WIDTH = 3.4  # of a tall view [in]
MAX_VIEW_HEIGHT = 5.6  # of a tall view [in]

Box = tuple[float, float, float, float]  # left, bottom, width, height [in]


@dataclass(frozen=True, slots=True)
class Page:
    """Size of the page and boxes of its parts."""

    width: float  # [in]
    height: float  # [in]
    view: Box
    bar: Box
    panels: tuple[Box, Box, Box, Box]
    named: tuple[int, ...]  # panels that name the time axis

    def share(self, box: Box) -> Box:
        """Convert a box to fractions of the page."""
        left, bottom, width, height = box
        return (
            left / self.width,
            bottom / self.height,
            width / self.width,
            height / self.height,
        )


def page_for(ratio: float) -> Page:
    """Choose the layout for a view with this ratio of height to width."""
    return _beside(ratio) if ratio > TALL else _beneath(ratio)


def _beneath(ratio: float) -> Page:
    """Place two rows of two curves below a wide view."""
    room = WIDTH - LEFT - RIGHT
    width = (room - BETWEEN) / 2.0
    right = LEFT + width + BETWEEN
    rows = (BOTTOM + CURVE + GAP, BOTTOM)
    view_bottom = rows[0] + CURVE + BETWEEN
    height = view_bottom + room * ratio + HEADER
    return Page(
        width=WIDTH,
        height=height,
        view=(LEFT, view_bottom, room, room * ratio),
        bar=_bar(height),
        panels=(
            (LEFT, rows[0], width, CURVE),
            (right, rows[0], width, CURVE),
            (LEFT, rows[1], width, CURVE),
            (right, rows[1], width, CURVE),
        ),
        named=(2, 3),
    )


def _beside(ratio: float) -> Page:
    """Place four curves beside a tall view."""
    view_width = min(MAX_VIEW_WIDTH, MAX_VIEW_HEIGHT / ratio)
    room = max(view_width * ratio, 4.0 * CURVE + 3.0 * GAP)
    curve = (room - 3.0 * GAP) / 4.0
    left = LEFT + view_width + BETWEEN + 0.05
    width = WIDTH - left - RIGHT
    height = BOTTOM + room + HEADER
    bottoms = [BOTTOM + k * (curve + GAP) for k in (3, 2, 1, 0)]
    first, second, third, fourth = ((left, b, width, curve) for b in bottoms)
    return Page(
        width=WIDTH,
        height=height,
        view=(LEFT, BOTTOM + room - view_width * ratio, view_width, view_width * ratio),
        bar=_bar(height),
        panels=(first, second, third, fourth),
        named=(3,),
    )


def _bar(height: float) -> Box:
    """Place the colour bar in the upper right corner."""
    length, thickness = BAR
    return (WIDTH - RIGHT - length - 0.05, height - 0.17, length, thickness)

"""Colours and line widths of all pictures; readable with any colour vision.

The colours of the moments are of the set of Okabe and Ito (2008), the colour map is
viridis: both can be told apart with any colour vision. Moments are numbered as well.
"""

from typing import Any, Final

MOMENTS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
SPEED_MAP: Final = "viridis"

ASPHALT: Final = "#E9E9E9"
MARKING: Final = "#FFFFFF"
KERB: Final = "#B0B0B0"
ROAD_EDGE: Final = "#303030"
OBSTACLE: Final = "#4A4A4A"
REFERENCE: Final = "#707070"
CURVE: Final = "#202020"
SECOND_CURVE: Final = "#E69F00"
LIMIT: Final = "#707070"
WAITING: Final = "#DADADA"  # behind the curves, while a stop line is closed

FONT_SIZE: Final = 7.5  # [pt]
THIN, MEDIUM, EDGE, THICK = 0.6, 1.0, 1.3, 2.2  # [pt]

# Text stays text in vector files, and the same data give the same bytes.
STYLE: Final[dict[Any, Any]] = {
    "font.size": FONT_SIZE,
    "axes.linewidth": 0.6,
    "svg.fonttype": "none",
    "svg.hashsalt": "rearview",
}

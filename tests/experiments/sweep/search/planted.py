"""Search files for the planted defects of `broken_planner`, and where each shows."""

import shutil
from pathlib import Path

import yaml

HERE = Path(__file__).parent
CUT_IN = {
    "conflict.gap_m": {"range": [110.0, 260.0], "mild": 260.0},
    "conflict.other_speed_mps": {"range": [3.0, 12.0], "mild": 12.0},
    "conflict.lateral_speed_mps": {"range": [1.2, 1.8], "mild": 1.2},
    "ego.target_speed_mps": {"range": [12.5, 30.0], "mild": 12.5},
}
SPACES = {
    "lorries": {**CUT_IN, "conflict.length_m": {"range": [4.0, 16.0], "mild": 4.0}},
    "weak": CUT_IN,
    "window": CUT_IN,
    "late": CUT_IN,
    "left": {
        "obstacles[0].s_m": {"range": [150.0, 280.0], "mild": 280.0},
        "obstacles[0].l_m": {"range": [-5.0, 5.0], "mild": 5.0},
        "obstacles[0].radius_m": {"range": [0.2, 1.0], "mild": 0.2},
        "ego.target_speed_mps": {"range": [8.0, 16.0], "mild": 8.0},
    },
}
TIME = {"metric": "min_ttc_s", "direction": "minimise"}
OBJECTIVES = {"lorries": TIME, "weak": TIME, "window": TIME, "late": TIME}
DISC = """\
name: disc
world: kinematic
road: {segments: [[line, 500]], half_width_m: 7}
ego: {start_m: 50, target_speed_mps: 12, goal_m: 320}
obstacles: [{s_m: 200, l_m: 4, radius_m: 0.3}]
simulation: {duration_s: 40, blocked_after_s: 3}
"""


def write_search(
    folder: Path, defect: str, space: str = "", *, rare: bool = False, **keys: object
) -> str:
    """Write the search file of a defect, with the planner beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(HERE / "broken_planner.py", folder)
    (folder / "disc.yaml").write_text(DISC)
    place = space or defect
    search = {
        "name": f"{defect}_search",
        "scenario": "disc.yaml" if place == "left" else "cut_in",
        "planner": {
            "name": "broken_planner:make",
            "settings": {"defect": defect, "rare": rare},
        },
        "set": {} if place == "left" else {"simulation.duration_s": 14},
        "space": SPACES[place],
        "objective": OBJECTIVES.get(place, "clearance"),
        **keys,
    }
    path = folder / f"{defect}.yaml"
    path.write_text(yaml.safe_dump(search))
    return str(path)

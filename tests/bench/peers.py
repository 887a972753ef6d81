"""Our planners and projection beside those of others, on the same scene in one run.

`python -m tests.bench.peers [-o docs/planners/peers.md]` (`make bench-peers`). Cycles
are timed in turns, so that a busy machine slows all of them; times are CPU time of the
thread. A peer's time is that of its own `plan`, without what the adapter adds.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from statistics import median
from time import thread_time
from unittest.mock import patch

import numpy as np

from experiments.api import peers
from experiments.commonroad.checker import find_python
from experiments.errors import ConfigError
from experiments.evidence.quote import quoted
from planner import cruise
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from tests.planner.scenes import Car, Disc, ego_on, make_scene, winding

ROUNDS = 200
POINTS = 2000
PEERS = ("fop", "fop_plus", "fiss", "fiss_plus")
# (n, 2) points and a line as JSON on stdin -> seconds for all points, the best of ten
CLCS = """
import json, sys, time
import numpy as np
from commonroad_clcs.clcs import CurvilinearCoordinateSystem
from commonroad_clcs.config import CLCSParams
given = json.load(sys.stdin)
frame = CurvilinearCoordinateSystem(np.array(given["line"]), CLCSParams())
points = [np.array(p) for p in given["points"]]
best = 1e9
for _ in range(10):
    start = time.thread_time()
    found = [frame.convert_to_curvilinear_coords(*p) for p in points]
    best = min(best, time.thread_time() - start)
batch = 1e9
for _ in range(10):
    start = time.process_time()
    frame.convert_list_of_points_to_curvilinear_coords(points, 1)
    batch = min(batch, time.process_time() - start)
print(json.dumps([best, batch]))
"""


def busy_scene():
    """A winding road with six vehicles and four obstacles."""
    path = winding()
    vehicles = [Car(30.0 + 14.0 * k, (2.5, -2.5)[k % 2], 6.0) for k in range(6)]
    obstacles = [Disc(50.0 + 25.0 * k, (1.8, -1.8)[k % 2], 0.4) for k in range(4)]
    ego = ego_on(path, 10.0, 0.0, 9.0)
    return make_scene(path, ego, obstacles, vehicles, full_statistics=False)


class _Timed:
    """Their planner, whose own `plan` is timed apart from the adapter."""

    def __init__(self, native):
        self.native = native
        self.times = []

    def plan(self, *arguments, **options):
        started = thread_time()
        try:
            return self.native.plan(*arguments, **options)
        finally:
            self.times.append(thread_time() - started)


def cycle_times():
    """Return CPU seconds of each cycle, by planner: own, and with the adapter."""
    import fiss_planner as fp

    scene, made, memory = busy_scene(), {}, {}
    make = fp.make_planner
    times = {name: ([], []) for name in ("cruise", *PEERS)}
    planners = {"cruise": cruise.proposed()}
    planners |= {name: getattr(peers, name)() for name in PEERS}
    for name, planner in planners.items():  # compiles, too

        def timed(*arguments, name=name):
            made[name] = _Timed(make(*arguments))
            return made[name]

        with patch.object(fp, "make_planner", timed):
            memory[name] = planner.plan(scene, None).memory
    for _ in range(ROUNDS):
        for name, planner in planners.items():
            before = len(made[name].times) if name in made else 0
            started = thread_time()
            planner.plan(scene, memory[name])
            whole = thread_time() - started
            own = sum(made[name].times[before:]) if name in made else whole
            times[name][0].append(own)
            times[name][1].append(whole)
    return {name: tuple(map(median, both)) for name, both in times.items()}


def projection_times():
    """Return microseconds a point: ours in one call, theirs one by one and in one."""
    path = ReferencePath.from_segments(
        [line(60.0), arc(120.0, 0.01), arc(120.0, -0.01)]
    )
    s = np.arange(0.0, path.length, 1.0)
    at = path.at(s)
    rng = np.random.default_rng(1)
    place = rng.uniform(5.0, path.length - 5.0, POINTS)
    aside = rng.uniform(-5.0, 5.0, POINTS)
    on = path.at(place)
    x, y = on.x - aside * on.sin_heading, on.y + aside * on.cos_heading
    own = []
    for _ in range(10):
        started = thread_time()
        found, _ = path.project(x, y)
        own.append(thread_time() - started)
    assert np.abs(found - place).max() < 0.01
    given = {
        "line": np.column_stack([at.x, at.y]).tolist(),
        "points": np.column_stack([x, y]).tolist(),
    }
    done = subprocess.run(
        [str(find_python()), "-I", "-c", CLCS],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    single, batch = json.loads(done.stdout.splitlines()[-1])
    return tuple(1e6 * t / POINTS for t in (min(own), single, batch))


def table():
    """Return the tables as paragraphs of Markdown."""
    times = cycle_times()
    base = times["cruise"][0]
    lines = [
        "| planner | its own `plan` [ms] | over `cruise` | with the adapter [ms] |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| `{name}` | {1e3 * own:.2f} | {own / base:.2f} | {1e3 * whole:.2f} |"
        for name, (own, whole) in times.items()
    ]
    parts = ["\n".join(lines)]
    try:
        ours, single, batch = projection_times()
    except ConfigError as error:
        parts.append(f"Projection was not compared: {error}")
        return parts
    rows = [
        "| projection of 2,000 points | CPU time a point [µs] | over ours |",
        "|---|---|---|",
        f"| `ReferencePath.project`, one call | {ours:.2f} | 1 |",
        f"| commonroad-clcs, one call | {batch:.2f} | {batch / ours:.1f} |",
        f"| commonroad-clcs, a call each | {single:.2f} | {single / ours:.1f} |",
    ]
    return [*parts, "\n".join(rows)]


def main():
    """Print the tables, or put them into a document."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    found = table()
    if options.output is None:
        sys.stdout.write("\n\n".join(found) + "\n")
    else:
        text = options.output.read_text(encoding="utf-8")
        options.output.write_text(quoted(text, found), encoding="utf-8")


if __name__ == "__main__":
    main()

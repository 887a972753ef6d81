"""Write where the time goes, by samples, into docs/performance.md.

`python -m tests.bench.limits [NAME ...]` measures, and replaces what stands between
`<!-- limits: NAME -->` and `<!-- end -->` by the table of that name. The stack is read
every few milliseconds of CPU time, which costs next to nothing and does not depend
on what else the machine does. A sample belongs to the innermost function that a part
names.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType

PAGE = Path(__file__).parents[2] / "docs" / "performance.md"
SECTION = re.compile(r"(<!-- limits: ([\w ]+) -->\n).*?(<!-- end -->)", re.DOTALL)
TICK = 0.004  # of CPU time, between samples; Linux has no shorter one [s]
OWN = ("planner", "experiments", "sumo_nets", "tests", "__main__")
REST = "everything else"
LARGEST = "in all of these: the largest function"

Parts = Mapping[str, tuple[str, ...]]  # label: beginnings of module:function

CYCLE: Parts = {
    "candidates: costs, limits, clearance": (
        "planner.cruise.planner:CruisePlanner._evaluate",
    ),
    "sampled profiles and offsets": ("planner.cruise.sampling",),
    "bodies, road and limits ahead": (
        "planner.bodies",
        "planner.cruise.cycle",
        "planner.cruise.surroundings",
    ),
    "checks of the scene and the plan, records": (
        "planner.cruise.planner",
        "planner.scene_checks",
        "planner.states",
        "planner.interface",
    ),
}
SPEED: Parts = {
    "projection of vehicles, bounds, tables": (
        "planner.lane_change.speed.st_graph",
        "planner.lane_change.speed.program",
    ),
    "orders that are possible": ("planner.lane_change.speed.passing_orders",),
    "search on the grid": ("planner.lane_change.speed.dynamic_programming",),
    "programs of the orders": ("planner.lane_change.speed.order_solver",),
    "records": ("planner.lane_change.speed.plan", "planner.states"),
}
RUN: Parts = {
    "SUMO's own step": ("libsumo.libsumo:simulation.step",),
    "other calls of SUMO": ("libsumo",),
    "reading vehicles": (
        "experiments.cosim.sumo.vehicle_reader",
        "experiments.cosim.sumo.world:SumoWorld.observe",
    ),
    "moving the ego and its ghost": (
        "experiments.cosim.sumo.world",
        "experiments.cosim.sumo.ghost_",
        "experiments.cosim.sumo.waiting_place",
    ),
    "scene and predictions": (
        "experiments.cosim.scene_builder",
        "experiments.cosim.ego_driver:EgoDriver._scene",
        "planner.prediction",
    ),
    "planning": ("experiments.cosim.planning",),
    "check of contacts": ("experiments.cosim.collision_monitor",),
    "trace, candidates, their hash": (
        "experiments.trace",
        "experiments.episode.recorder",
    ),
    "row of metrics": ("experiments.metrics",),
    "road and traffic of the run": ("experiments.world_setup", "sumo_nets"),
    "rest of the loop": ("experiments.cosim",),
}
COMPILER: Parts = {
    "LLVM": ("llvmlite.binding",),
    "text for LLVM": ("llvmlite.ir",),
    "lowering": ("numba.core.lowering", "numba.core.base", "numba.core.callconv"),
    "types": ("numba.core.typeinfer", "numba.core.typing", "numba.core.types"),
    "analysis of bytecode": (
        "numba.core.interpreter",
        "numba.core.byteflow",
        "numba.core.ssa",
        "numba.core.analysis",
        "numba.core.ir_utils",
        "numba.core.ir",
    ),
}
START: Parts = {
    "numba and LLVM": ("numba", "llvmlite"),
    "numpy and scipy": ("numpy", "scipy"),
    "pydantic, typer, YAML": ("pydantic", "annotated_types", "typing", "typer", "yaml"),
    "DuckDB, Jinja, shapely": ("duckdb", "_duckdb", "jinja2", "markupsafe", "shapely"),
    "modules of this project": ("planner", "experiments", "sumo_nets"),
    "of the standard library": tuple(sorted(sys.stdlib_module_names)),
}


@dataclass(slots=True)
class Samples:
    """Samples by part, and how many of them were outside of this project's Python."""

    parts: Parts
    all: Counter[str] = field(default_factory=Counter)
    outside: Counter[str] = field(default_factory=Counter)
    cpu: float = 0.0  # [s]

    def take(self, _: int, frame: FrameType | None) -> None:
        """Take one sample."""
        assert frame is not None
        inner = _name(frame).partition(".")[0].partition(":")[0]
        label = REST
        while frame is not None and label == REST:
            name = _name(frame)
            for part, begins in self.parts.items():
                if name.startswith(begins):
                    label = part
                    break
            frame = frame.f_back
        self.all[label] += 1
        self.outside[label] += inner not in OWN

    def share(self, label: str) -> tuple[float, float]:
        """Return the share of a part, and that outside of our Python [%]."""
        n = max(self.all.total(), 1)
        return 100.0 * self.all[label] / n, 100.0 * self.outside[label] / n


def _name(frame: FrameType) -> str:
    """Name the function of a frame as module:function."""
    return f"{frame.f_globals.get('__name__', '')}:{frame.f_code.co_qualname}"


def sampled(work: Callable[[], object], parts: Parts) -> Samples:
    """Do some work and sample it."""
    samples = Samples(parts)
    kept = signal.signal(signal.SIGPROF, samples.take)
    begin = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, TICK, TICK)
    try:
        work()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, kept)
    samples.cpu = time.process_time() - begin
    return samples


def cycle_table() -> str:
    """Sample cycles of `cruise` among ten bodies."""
    from tests.bench.test_bench_cruise import PLANNERS, ten_bodies

    planner, n = PLANNERS["closed_loop_231"], 12_000
    scene = replace(ten_bodies(), full_statistics=False)
    memory = planner.plan(scene, None).memory
    found = sampled(lambda: [planner.plan(scene, memory) for _ in range(n)], CYCLE)
    return _table({f"{1e3 * found.cpu / n:.3f} ms a cycle": found})


def speed_table() -> str:
    """Sample speed plans among eight vehicles, of every order and of DP&QP."""
    from tests.bench.test_bench_lane_change import RULES, plan, speed_tasks

    tasks, n, columns = list(speed_tasks(8)), 200, {}
    for rule, words in (("ours", "every order"), ("dp_17x321", "DP&QP 17 x 321")):
        settings = RULES[rule]

        def work(settings=settings) -> None:
            for task in n * tasks:
                plan(*task, settings)

        work()
        found = sampled(work, SPEED)
        columns[f"{words}: {1e3 * found.cpu / n / len(tasks):.3f} ms"] = found
    return _table(columns)


def run_table() -> str:
    """Sample runs in SUMO: two planners, full traces, short runs of a sweep."""
    from experiments.config.scenario_file import load_scenario

    light = [
        "traffic.density=light",
        "obstacles=[{s_m: 450, l_m: 0, length_m: 12, width_m: 2.6}]",
        "ego.goal_m=560",
        "simulation.warmup_s=40",
    ]
    kinds = (
        ("`cruise`", "cruise", (), False),
        ("`lane_change`", "lane_change", (), False),
        ("with trace and candidates", "lane_change", (), True),
        ("a run of `light`", "lane_change", light, False),
    )
    columns = {}
    for words, planner, overrides, keeps in kinds:
        scenarios = [
            load_scenario("lane_change", planner=planner, seed=k, overrides=overrides)
            for k in range(4)
        ]
        _drive(scenarios, keeps)
        steps: list[int] = []
        found = sampled(
            lambda s=scenarios, k=keeps, n=steps: n.append(_drive(s, k)), RUN
        )
        columns[f"{words}: {1e3 * found.cpu / steps[0]:.2f} ms a step"] = found
    return _table(columns)


def _drive(scenarios: Sequence[object], keeps: bool) -> int:  # noqa: FBT001
    """Drive scenarios as a sweep does; number of steps."""
    from experiments.episode.drive import run_scenario
    from experiments.episode.run_folder import OutputOptions

    steps: list[object] = []
    with TemporaryDirectory() as folder:
        for scenario in scenarios:
            output = OutputOptions(keeps_candidates=keeps)
            run_scenario(
                scenario, out=Path(folder), on_step=steps.append, output=output
            )
    return len(steps)


def compilation_table() -> str:
    """Sample the compilation of all that `cruise` needs."""
    with TemporaryDirectory() as cache:
        code = "from tests.bench.limits import compilation; compilation()"
        shares = _in_a_process(code, NUMBA_CACHE_DIR=cache)
    return _shares(shares)


def compilation() -> None:
    """Compile into an empty cache and print the shares, in a process of its own."""
    from experiments.cli.kernel_list import compile_one, missing

    listed, times = missing(["cruise"]), []

    def compile_all() -> None:
        for each in listed:
            begin = time.process_time()
            compile_one(each)
            times.append(time.process_time() - begin)

    found = sampled(compile_all, COMPILER)
    shares = {label: found.share(label)[0] for label in (*COMPILER, REST)}
    shares[LARGEST] = 100.0 * max(times) / sum(times)
    title = f"{len(listed)} functions"
    sys.stdout.write(json.dumps({title: found.cpu, **shares}) + "\n")


def start_table() -> str:
    """Measure what each package takes of a start, least of five."""
    code = "from tests.bench.limits import start; start()"
    _in_a_process(code)
    found = [_in_a_process(code) for _ in range(5)]
    return _shares(min(found, key=lambda each: next(iter(each.values()))))


def start() -> None:
    """Import what `rearview run` imports, drive one step, and print the shares."""
    import importlib._bootstrap as bootstrap

    load, children, own = bootstrap._load_unlocked, [0.0], Counter()

    def timed(spec):
        begin = time.process_time()
        children.append(0.0)
        try:
            return load(spec)
        finally:
            whole = time.process_time() - begin
            own[_package(spec.name)] += whole - children.pop()
            children[-1] += whole

    before = time.process_time()  # interpreter and numpy, which this module imports
    bootstrap._load_unlocked = timed
    import experiments.cli.app
    import experiments.cli.compile_notice
    import experiments.cli.episode_progress
    import experiments.report.run.page
    from experiments.config.scenario_file import load_scenario

    one_step = ["simulation.duration_s=0.1"]
    scenario = load_scenario("thesis_straight", planner="cruise", overrides=one_step)
    import experiments.episode.drive  # noqa: F401

    begin, imported = time.process_time(), own.total()
    _drive([scenario], keeps=True)
    run = time.process_time() - begin - (own.total() - imported)
    whole = time.process_time()
    shares = {label: 100.0 * own[label] / whole for label in (*START, REST)}
    shares["interpreter and numpy"] = 100.0 * before / whole
    shares["compiled loops restored, one step, files"] = 100.0 * run / whole
    sys.stdout.write(json.dumps({"of the start": whole, **shares}) + "\n")


def _package(module: str) -> str:
    """Return the part of a start that a module belongs to."""
    root = module.partition(".")[0]
    return next((label for label, names in START.items() if root in names), REST)


def _in_a_process(code: str, **environment: str) -> dict[str, float]:
    """Run code in a process of its own and read the JSON that it prints."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        cwd=PAGE.parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def _shares(found: Mapping[str, float]) -> str:
    """Return a table of shares; the first entry is the whole [s]."""
    (title, whole), *shares = found.items()
    rows = sorted(shares, key=lambda row: -row[1])
    lines = [f"| {title}: {whole:.2f} s | % |", "|---|---|"]
    return "\n".join([*lines, *(f"| {a} | {b:.0f} |" for a, b in rows)]) + "\n"


def _table(columns: Mapping[str, Samples]) -> str:
    """Return a table: the share of each part, and how much of it is not our Python."""
    first = next(iter(columns.values()))
    lines = [f"| | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    for label in (*first.parts, REST):
        shares = [samples.share(label) for samples in columns.values()]
        if max(share for share, _ in shares) >= 0.5:
            cells = [f"{share:.0f} ({outside:.0f})" for share, outside in shares]
            lines.append(f"| {label} | {' | '.join(cells)} |")
    sums = [100.0 * s.outside.total() / s.all.total() for s in columns.values()]
    cells = [f"100 ({share:.0f})" for share in sums]
    return "\n".join([*lines, f"| sum | {' | '.join(cells)} |"]) + "\n"


TABLES: Mapping[str, Callable[[], str]] = {
    "cycle": cycle_table,
    "speed": speed_table,
    "runs": run_table,
    "start": start_table,
    "compilation": compilation_table,
}


def filled(page: str, tables: Mapping[str, str]) -> str:
    """Return the page with tables in their places; others stay."""
    return SECTION.sub(
        lambda part: (
            part[1] + tables[part[2]] + part[3] if part[2] in tables else part[0]
        ),
        page,
    )


def main() -> int:
    """Measure the tables that are named, or all, and write them into the page."""
    names = sys.argv[1:] or list(TABLES)
    if not set(names) <= set(TABLES):
        sys.stderr.write(f"usage: python -m tests.bench.limits {list(TABLES)}\n")
        return 2
    tables = {name: TABLES[name]() for name in names}
    page = filled(PAGE.read_text(encoding="utf-8"), tables)
    PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

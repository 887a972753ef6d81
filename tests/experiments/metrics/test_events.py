"""Events of hand-made episodes, and the moments of metrics."""

import json
from dataclasses import replace

import numpy as np
import pytest

from experiments.cosim.records import EpisodeStatus, TrackingReport
from experiments.metrics import columns, safety
from experiments.metrics.catalogue import METRICS
from experiments.metrics.events import EventKind, Gravity, events
from experiments.metrics.lane_crossings import lane_crossings
from experiments.metrics.moments import moments
from experiments.metrics.row import metric_row
from experiments.trace.schema import Kind, column
from planner.interface import PlanStats, PlanStatus
from planner.states import CartesianState
from tests.experiments.report.run_folders import driven_trace, plan_from
from tests.experiments.road_users import road_users
from tests.experiments.traces import STEP, cruising, record, trace_of


def of_kind(trace, kind):
    return [event for event in events(trace) if event.kind is kind]


def driving(n, **changes):
    """10 m/s on a straight; each change is a function of the step."""
    made = []
    for k in range(n):
        fields = {name: value(k) for name, value in changes.items()}
        speed = fields.pop("speed", 10.0)
        y = fields.pop("y", 0.0)
        rate = fields.pop("rate", 0.0)
        ego = CartesianState(10.0 * STEP * k, y, 0.0, 0.0, speed, rate)
        made.append(record(k, ego, **fields))
    return made


def with_lanes(trace, centres=(-1.75, 1.75), width=3.5):
    n = len(centres)
    lanes = {
        "lane": np.repeat(np.arange(n), 2),
        "s_m": np.tile([0.0, 1000.0], n),
        "centre_m": np.repeat(np.array(centres), 2),
        "width_m": np.full(2 * n, width),
        "left_hand": np.zeros(2 * n, dtype=np.int64),
        "solid": np.zeros(2 * n, dtype=np.int64),
    }
    return replace(trace, lanes=lanes)


def test_no_steps_no_events():
    empty = trace_of([], status=EpisodeStatus.CRASHED)
    assert events(empty) == []
    assert moments(empty) == {}


def test_each_body_is_touched_once():
    trace = trace_of(
        driving(9, contacts=lambda k: ("b", "a") if k in (3, 4) else ("a",) * (k == 7)),
        status=EpisodeStatus.COLLISION,
    )
    found = of_kind(trace, EventKind.CONTACT)
    assert [(event.step, event.subject) for event in found] == [(3, "b"), (3, "a")]
    assert all(event.gravity is Gravity.BAD for event in found)
    assert of_kind(trace, EventKind.CLEARANCE) == []
    (end,) = of_kind(trace, EventKind.END)
    assert (end.step, end.text) == (8, "end: collision")


def test_stretches_that_are_close_are_one():
    hard = {10, 11, 14, 30}
    trace = trace_of(driving(40, rate=lambda k: -3.5 if k in hard else 0.0))
    found = of_kind(trace, EventKind.EGO_BRAKING)
    assert [(event.step, event.until) for event in found] == [(10, 14), (30, 30)]
    assert found[0].value == pytest.approx(3.5)


def test_standing_counts_from_one_second_on():
    trace = trace_of(driving(60, speed=lambda k: float(not (5 <= k < 12 or k >= 40))))
    (found,) = of_kind(trace, EventKind.STANDING)
    assert (found.step, found.until) == (40, 59)
    assert found.value == pytest.approx(1.9)


@pytest.mark.parametrize(
    ("status", "kind"),
    [
        (PlanStatus.FULL_STOP, EventKind.FALLBACK),
        (PlanStatus.EMERGENCY_BRAKING, EventKind.EMERGENCY),
    ],
)
def test_cycles_without_a_fresh_plan(status, kind):
    made = driving(12)
    for k in (4, 5, 6):
        plan = plan_from(made[k].ego, PlanStats())
        made[k] = replace(made[k], plan=replace(plan, status=status), planning=None)
    (found,) = of_kind(trace_of(made), kind)
    assert (found.step, found.until, found.value) == (4, 6, 3)
    assert moments(trace_of(made))[columns.FALLBACK_CYCLES] == 4


def change(k):
    """Offset of the centre: two seconds from lane to lane, from step 10 on."""
    share = min(max((k - 10) / 20.0, 0.0), 1.0)
    return -1.75 + 3.5 * share


def test_body_over_the_line_and_in_the_next_lane():
    trace = with_lanes(trace_of(driving(60, y=change)))
    (found,) = lane_crossings(trace)
    half = float(trace.fact("width_m")) / 2.0
    y = np.array([change(k) for k in range(60)])
    over = int(np.flatnonzero(y + half > 0.01)[0])
    inside = int(np.flatnonzero(y - half >= -0.01)[0])
    assert (found.begin, found.end, found.home, found.lane) == (over, inside, 0, 1)
    assert found.left
    kinds = [event.kind for event in events(trace)]
    assert kinds.count(EventKind.OVER_LINE) == kinds.count(EventKind.NEW_LANE) == 1


def test_a_change_that_turns_back_is_no_new_lane():
    trace = with_lanes(
        trace_of(driving(80, y=lambda k: min(change(k), change(50 - k))))
    )
    (found,) = lane_crossings(trace)
    assert (found.home, found.lane) == (0, 0)
    assert of_kind(trace, EventKind.NEW_LANE) == []
    assert "comes back" in of_kind(trace, EventKind.OVER_LINE)[0].text


def test_an_episode_that_ends_on_the_line_has_no_end_of_the_crossing():
    trace = with_lanes(trace_of(driving(22, y=change)))
    (found,) = lane_crossings(trace)
    assert (found.end, found.lane) == (None, None)


def test_a_road_without_lanes_has_no_lines():
    assert lane_crossings(trace_of(driving(60, y=change))) == []


def test_phases_of_a_planner_and_its_commitment():
    trace = cruising(40)
    said = ["keep: -"] * 10 + ["seek: a gap"] * 10 + ["committed"] * 15 + ["keep"] * 5
    steps = {**trace.steps, "explanation": column(said, Kind.TEXT)}
    trace = replace(trace, steps=steps)
    found = [event for event in events(trace) if event.text.startswith("planner: ")]
    assert [(event.step, event.kind) for event in found] == [
        (10, EventKind.PHASE),
        (20, EventKind.COMMITMENT),
        (35, EventKind.PHASE),
    ]
    sentences = [f"margin {k} m" for k in range(40)]
    steps["explanation"] = column(sentences, Kind.TEXT)
    assert of_kind(replace(trace, steps=steps), EventKind.PHASE) == []


def test_signals_count_until_their_line_is_passed():
    trace = cruising(40)  # the front passes 30 m in step 27
    states = ["r"] * 10 + ["G"] * 20 + ["y"] * 10
    signals = {
        "index": np.arange(40),
        "id": column(["light"] * 40, Kind.TEXT),
        "stop_m": np.full(40, 30.0),
        "state": column(states, Kind.TEXT),
    }
    found = of_kind(replace(trace, signals=signals), EventKind.SIGNAL)
    assert [(event.step, event.text) for event in found] == [(10, "light turns green")]


def test_hard_braking_of_a_follower():
    def cars(k):
        rate = -4.0 if 12 <= k < 15 else 0.0
        return [("behind", 10.0 * STEP * k - 20.0, 0.0, 0.0, 10.0, rate)]

    trace = trace_of(driving(30, cars=cars))
    (found,) = of_kind(trace, EventKind.FOLLOWER_BRAKING)
    assert (found.step, found.until, found.subject) == (12, 14, "behind")
    assert moments(trace)[columns.REAR_MAX_DECELERATION] == 12


def test_metrics_have_their_value_at_their_moment():
    trace = driven_trace(60, n_cars=6)
    found, row = moments(trace), metric_row(trace)
    assert set(found) <= set(METRICS)
    steps, timing = trace.steps, trace.timing
    for name, values in (
        (columns.MIN_CLEARANCE, steps["clearance_m"]),
        (columns.MAX_ACCELERATION, np.abs(steps["acceleration_mps2"])),
        (columns.MAX_CURVATURE, np.abs(steps["curvature_1pm"])),
        (columns.PLANNING_MAX, timing["planning_ms"]),
        (columns.PLANNING_CPU_MAX, timing["planning_cpu_ms"]),
    ):
        assert values[found[name]] == pytest.approx(row[name]), name
    assert steps["time_s"][found[columns.TRAVEL_TIME]] == pytest.approx(
        row[columns.TRAVEL_TIME]
    )
    trace = trace_of(driving(60, cars=approached))
    found, row = moments(trace), metric_row(trace)
    alone = until(trace, found[columns.MIN_TTC])
    assert safety.min_time_to_collision(alone) == row[columns.MIN_TTC]
    before = until(trace, found[columns.MIN_TTC] - 1)
    assert safety.min_time_to_collision(before) != row[columns.MIN_TTC]


def approached(k):
    """A car that pulls away when the ego has come near."""
    t = k * STEP
    speed = 4.0 if t < 3.0 else 14.0
    x = 40.0 + 4.0 * min(t, 3.0) + 14.0 * max(t - 3.0, 0.0)
    return [("ahead", x, 0.0, 0.0, speed, 0.0)]


def until(trace, step):
    """The trace up to a step."""
    kept = trace.vehicles["index"] <= step
    return replace(
        trace, vehicles={key: values[kept] for key, values in trace.vehicles.items()}
    )


def test_events_as_json(tmp_path, capsys):
    from experiments.cli.app import app
    from tests.experiments.report.run_folders import write_run

    run = write_run(tmp_path / "run", driven_trace(30))
    with pytest.raises(SystemExit) as left:
        app(("events", str(run), "--json"))
    assert not left.value.code
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[-1]["event"] == "end"
    assert lines[-1]["time_s"] == pytest.approx(2.9)
    assert [line["step"] for line in lines] == sorted(line["step"] for line in lines)
    with pytest.raises(SystemExit) as left:
        app(("events", str(tmp_path / "none")))
    out, err = capsys.readouterr()
    assert (left.value.code, out, err.count("\n")) == (2, "", 1)


def test_a_vehicle_nearby_that_is_not_seen_and_a_plan_that_is_missed():
    def near(k):
        return [("near", 8.0 + 10.0 * STEP * k, 3.0, 0.0, 10.0, 0.0)]

    made = [
        replace(
            record(k, CartesianState(10.0 * STEP * k, 0, 0, 0, 10.0, 0), cars=near(k)),
            seen=road_users(*(near(k) if k < 5 or k > 14 else [])),
            tracking=TrackingReport(
                0.3 if k == 20 else 0.1, 0, 0, 0, 0, 0, 0, float(k in (8, 9)), 0.4
            ),
        )
        for k in range(30)
    ]
    trace = trace_of(made)
    (unseen,) = of_kind(trace, EventKind.UNSEEN)
    assert (unseen.step, unseen.until, unseen.subject) == (5, 14, "near")
    assert unseen.value == pytest.approx(1.0)
    (limit,) = of_kind(trace, EventKind.AT_LIMIT)
    assert (limit.step, limit.until) == (8, 9)
    (off,) = of_kind(trace, EventKind.TRACKING)
    assert (off.step, off.value) == (20, 0.3)

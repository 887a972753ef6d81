"""Decisions at single junctions, one rule after the other."""

from hypothesis import given
from hypothesis import strategies as st

from planner.right_of_way.decision import (
    BEFORE_ZONE,
    DEADLOCK,
    IMPATIENT,
    QUIET,
    decide,
    is_near,
)
from planner.right_of_way.records import AtJunction, JunctionAhead, Rule, Waiting
from tests.planner.right_of_way.test_gaps import FOE, WAITING

STEP = 0.1
STOPPED = Waiting(stopped=True, stood=2.0)


def junction(rule, wait_s=None):
    return JunctionAhead("j", rule, 100.0, 120.0, 8.0, wait_s)


def lines(rule, ego=WAITING, foes=(), memory=Waiting(), wait_s=None):  # noqa: B008
    return decide(ego, junction(rule, wait_s), foes, memory, STEP)


def test_a_free_road_is_open_without_a_stop():
    coming = AtJunction(80.0, 75.0, 8.0, 13.9, 3.0, 8.0)
    assert lines(Rule.MINOR, coming).stop_s is None
    assert lines(Rule.RIGHT_BEFORE_LEFT, coming).stop_s is None


def test_a_stop_sign_asks_for_a_stop_also_on_a_free_road():
    coming = AtJunction(80.0, 75.0, 8.0, 13.9, 3.0, 8.0)
    decision = lines(Rule.STOP, coming)
    assert (decision.stop_s, decision.because_of) == (100.0, "stop sign")
    stands = lines(Rule.STOP, WAITING)
    assert stands.stop_s is None
    assert stands.memory.stopped
    far_away = WAITING._replace(front=90.0, rear=85.0)  # in a queue
    assert lines(Rule.STOP, far_away).stop_s == 100.0


def test_the_one_with_the_right_of_way_is_named():
    decision = lines(Rule.MINOR, foes=[FOE])
    assert (decision.stop_s, decision.because_of) == (100.0, "foe")
    assert lines(Rule.MINOR, foes=[FOE._replace(goes_first=False)]).stop_s is None


def test_all_way_stop_goes_by_the_time_of_waiting():
    at_line = FOE._replace(to_line=1.0, entry=4.0, speed=0.0)
    longer, shorter = at_line._replace(stood=5.0), at_line._replace(stood=1.0)
    assert lines(Rule.ALL_WAY_STOP, foes=[longer], memory=STOPPED).stop_s == 100.0
    assert lines(Rule.ALL_WAY_STOP, foes=[shorter], memory=STOPPED).stop_s is None
    queued = longer._replace(to_line=9.0, entry=12.0)
    assert lines(Rule.ALL_WAY_STOP, foes=[queued], memory=STOPPED).stop_s is None
    crossing_now = at_line._replace(to_line=-2.0, entry=1.0, speed=3.0, stood=0.0)
    decision = lines(Rule.ALL_WAY_STOP, foes=[crossing_now], memory=STOPPED)
    assert decision.stop_s == 100.0


def test_four_that_wait_for_each_other_are_resolved():
    right = FOE._replace(to_line=1.0, entry=4.0, speed=0.0, stood=4.0)
    soon = Waiting(stopped=True, stood=1.0)
    late = Waiting(stopped=True, stood=DEADLOCK)
    rule = Rule.RIGHT_BEFORE_LEFT
    assert lines(rule, foes=[right], memory=soon).stop_s == 100.0
    assert lines(rule, foes=[right], memory=late).stop_s is None
    moves_off = right._replace(speed=1.0, stood=0.0)
    assert lines(rule, foes=[moves_off], memory=late).stop_s == 100.0


def test_a_vehicle_that_stands_in_the_zone_is_never_driven_into():
    stuck = FOE._replace(to_line=-5.0, entry=-2.0, exit=6.0, speed=0.0, stood=99.0)
    late = Waiting(stopped=True, stood=99.0)
    for rule in (Rule.MINOR, Rule.STOP, Rule.RIGHT_BEFORE_LEFT, Rule.ALL_WAY_STOP):
        assert lines(rule, foes=[stuck], memory=late).stop_s is not None


def test_left_turns_wait_inside_where_they_may():
    inside = AtJunction(99.0, 94.0, 2.0, 13.9, 3.0, 8.0)
    zone = FOE._replace(begin_s=108.0, end_s=114.0)
    assert lines(Rule.MINOR, inside, [zone], wait_s=105.0).stop_s == 105.0
    before = FOE._replace(begin_s=102.0)
    assert lines(Rule.MINOR, inside, [before], wait_s=105.0).stop_s == 100.0


def test_a_late_foe_is_braked_for_before_the_zone_if_that_is_possible():
    going = Waiting(goes=True)
    over = AtJunction(101.0, 96.0, 2.0, 13.9, 3.0, 8.0)
    sudden = FOE._replace(to_line=10.0, entry=13.0)
    decision = lines(Rule.MINOR, over, [sudden], going)
    assert decision.stop_s is not None
    assert 100.0 < decision.stop_s < 103.0
    fast = over._replace(front=102.9, rear=97.9, speed=8.0)
    assert lines(Rule.MINOR, fast, [sudden], going).stop_s is None


def test_an_ego_in_the_zone_drives_out_of_it():
    inside = AtJunction(104.0, 99.0, 3.0, 13.9, 3.0, 8.0)
    close = FOE._replace(to_line=2.0, entry=5.0)
    assert lines(Rule.MINOR, inside, [close]).stop_s is None


@given(
    st.sampled_from([Rule.MINOR, Rule.STOP, Rule.RIGHT_BEFORE_LEFT]),
    st.floats(40.0, 99.9),
    st.floats(0.0, 15.0),
    st.floats(0.1, 140.0),
    st.floats(0.0, 16.0),
)
def test_a_closed_line_can_be_kept_without_an_emergency(rule, front, speed, way, foe):
    """And an open one is open for a foe that is a little farther away, too."""
    ego = AtJunction(front, front - 5.0, speed, 13.9, 3.0, 8.0)
    other = FOE._replace(to_line=way, entry=way + 3.0, exit=way + 15.0, speed=foe)
    decision = lines(rule, ego, [other], STOPPED)
    if decision.stop_s == 100.0:
        assert speed**2 <= 2.0 * 3.0 * (100.3 - front) + 1e-9


@given(st.floats(0.0, 20.0), st.floats(0.0, 99.0))
def test_nobody_decides_from_far_away(speed, front):
    ego = AtJunction(front, front - 5.0, speed, 20.0, 3.0, 8.0)
    way = 100.0 - front
    braking = speed**2 / 3.0
    assert is_near(ego, junction(Rule.MINOR)) == (way <= braking + speed + 5.0)


def test_one_that_waits_inside_for_the_ego_is_passed():
    inside = AtJunction(101.0, 96.0, 1.0, 13.9, 3.0, 8.0)
    waits = FOE._replace(
        entry=-1.9, exit=12.4, to_line=-4.2, speed=0.0, stood=1.5,
        goes_first=False, gives_way=True,
    )  # fmt: skip
    assert lines(Rule.MINOR, inside, [waits]).stop_s is None
    # not from before the line, not past one that moves or has the right of way
    assert lines(Rule.MINOR, WAITING, [waits]).stop_s == 100.0
    for other in (
        waits._replace(stood=0.5),
        waits._replace(stood=0.0, speed=1.0),
        waits._replace(goes_first=True, gives_way=False),
    ):
        assert lines(Rule.MINOR, inside, [other]).because_of == "foe"
    # who was to go first but has stood there for long waits for the ego as well
    first = waits._replace(goes_first=True, gives_way=False, stood=6.0)
    assert lines(Rule.MINOR, inside, [first]).stop_s is None
    assert lines(Rule.MINOR, WAITING, [first]).stop_s == 100.0


def test_who_has_waited_for_long_takes_a_shorter_gap():
    # at the zone in 8.1 s at the earliest; the ego has surely left it in 5.5 s
    foe = FOE._replace(entry=120.0, exit=130.0, to_line=118.0)
    new, tired = (
        Waiting(stopped=True, waited=waited) for waited in (0.0, IMPATIENT + 1.0)
    )
    opens = {}
    for name, memory in (("new", new), ("tired", tired)):
        opens[name] = min(
            entry
            for entry in range(40, 200)
            if lines(
                Rule.MINOR,
                foes=[foe._replace(entry=entry, exit=entry + 10, to_line=entry - 2)],
                memory=memory,
            ).stop_s
            is None
        )
    assert 60 < opens["tired"] < opens["new"] - 15
    creeps = lines(Rule.MINOR, WAITING._replace(speed=0.3), [FOE], tired)
    assert creeps.memory.waited == tired.waited  # moving up is no reason to start anew


def test_one_that_stands_with_the_right_of_way_is_no_free_road():
    """It may stand in a queue and set off at once; two that stand wait for one."""
    at_line = FOE._replace(to_line=1.0, entry=4.0, exit=14.0, speed=0.0, stood=6.0)
    coming = AtJunction(90.0, 85.0, 4.0, 13.9, 3.0, 8.0)
    assert lines(Rule.MINOR, coming, [at_line]).stop_s == 100.0
    waited = Waiting(stopped=True, stood=0.0, waited=DEADLOCK)
    assert lines(Rule.MINOR, foes=[at_line], memory=waited).stop_s is None
    far_back = at_line._replace(to_line=60.0, entry=63.0, exit=73.0)
    assert lines(Rule.MINOR, coming, [far_back]).stop_s is None


def test_who_creeps_up_behind_one_that_stands_is_not_waited_for():
    first = FOE._replace(to_line=1.0, entry=4.0, exit=14.0, speed=0.0, stood=6.0)
    creeps = first._replace(
        vehicle="creeps", to_line=8.0, entry=11.0, exit=21.0, speed=0.4, stood=0.0
    )
    waited = Waiting(stopped=True, stood=DEADLOCK, waited=DEADLOCK)
    assert lines(Rule.MINOR, foes=[creeps], memory=waited).stop_s == 100.0
    assert lines(Rule.MINOR, foes=[creeps, first], memory=waited).stop_s is None
    beside = creeps._replace(begin_s=first.begin_s + 1.0)  # in another lane
    assert lines(Rule.MINOR, foes=[beside, first], memory=waited).stop_s == 100.0
    moves = first._replace(speed=3.0, stood=0.0)
    assert lines(Rule.MINOR, foes=[creeps, moves], memory=waited).stop_s == 100.0
    # one at a stop of buses can be overtaken
    bus = first._replace(to_line=20.0, entry=23.0, exit=35.0)
    comes = creeps._replace(to_line=40.0, entry=43.0, exit=53.0, speed=13.9)
    assert lines(Rule.MINOR, foes=[comes, bus], memory=waited).stop_s == 100.0


def test_one_that_stands_for_the_same_stream_as_the_ego_goes_first_when_it_ends():
    """A left turner inside the junction sets off once the last one has passed."""
    turner = FOE._replace(to_line=-4.6, entry=1.3, exit=11.3, speed=0.0, stood=11.0)
    stream = FOE._replace(vehicle="stream", begin_s=106.5, to_line=18.0, entry=20.0)
    memory = Waiting(stopped=True, stood=9.0, waited=9.0)
    decision = lines(Rule.MINOR, foes=[turner, stream], memory=memory)
    assert decision.because_of == "stream"
    quiet = 0
    while decision.stop_s is not None:
        decision = lines(Rule.MINOR, foes=[turner], memory=decision.memory)
        quiet += 1
        assert decision.because_of == ("foe" if decision.stop_s else "")
    assert quiet == round(QUIET / STEP)  # it does not go: then the ego does
    waits = lines(Rule.MINOR, foes=[turner, stream], memory=memory).memory
    sets_off = turner._replace(speed=1.0, stood=0.0)
    assert lines(Rule.MINOR, foes=[sets_off], memory=waits).because_of == "foe"


def test_nobody_waits_inside_in_the_way_of_who_goes_first():
    inside = AtJunction(99.0, 94.0, 2.0, 13.9, 3.0, 8.0)
    zone = FOE._replace(begin_s=108.0, end_s=114.0)
    across = FOE._replace(vehicle="across", begin_s=102.0, end_s=106.0, entry=120.0)
    far = across._replace(entry=140.0, exit=150.0, to_line=139.0, held=True)
    free = across._replace(goes_first=False, gives_way=True, speed=3.0)
    for foe, place in ((across, 100.0), (far, 105.0), (free, 105.0)):
        decision = lines(Rule.MINOR, inside, [zone, foe], wait_s=105.0)
        assert decision.stop_s == place


def test_over_its_line_an_ego_does_not_creep_on_while_it_is_blocked():
    """Farther in it would stand in the way of those who go straight on."""
    ahead = FOE._replace(begin_s=105.0, end_s=112.0, vehicle="straight")
    beyond = FOE._replace(begin_s=110.0, end_s=118.0, vehicle="turning")
    inside = AtJunction(103.0, 98.0, 0.0, 13.9, 3.0, 8.0)
    first = lines(Rule.MINOR, inside, [ahead, beyond])
    assert first.stop_s == 105.0 - BEFORE_ZONE
    later = lines(Rule.MINOR, inside, [beyond], first.memory)
    assert (later.stop_s, later.because_of) == (first.stop_s, "turning")
    free = lines(Rule.MINOR, inside, [], later.memory)
    assert free.stop_s is None
    again = lines(Rule.MINOR, inside, [beyond], free.memory)
    assert again.stop_s == 110.0 - BEFORE_ZONE  # it may have gone there

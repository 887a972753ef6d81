"""Networks of all kinds, the same ones everywhere, that can be driven."""

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.config.sweep_file import load_sweep
from experiments.evidence.generated_networks.prepare import (
    COUNT,
    RIGHT_OF_WAY,
    main,
    options,
    prepare,
)
from experiments.sweep.plan import Plan
from experiments.world_setup.layout import make_layout
from tests.sumo_nets.generated import netgenerate


def test_a_number_gives_the_same_options_and_all_kinds_come_up():
    drawn = [options(number) for number in range(COUNT)]
    assert drawn == [options(number) for number in range(COUNT)]
    words = {word for one in drawn for word in one}
    assert {"--grid", "--spider", "--rand"} <= words
    assert {f"--default.lanenumber={n}" for n in (1, 2, 3)} <= words
    assert {f"--default-junction-type={kind}" for kind in RIGHT_OF_WAY} <= words
    assert {"--lefthand=true", "--turn-lanes=1", "--default.lanewidth=2.8"} <= words


@pytest.mark.slow
def test_what_is_written_can_be_driven(tmp_path):
    netgenerate()  # skips without it
    file = prepare(tmp_path / "first", range(3), range(2), body="lorry")
    again = prepare(tmp_path / "again", range(3), range(2), body="lorry")
    assert len(Plan(*load_sweep(str(file)))) == 3 * 2 * 2
    for number in range(3):
        one, other = (f.parent / f"net_{number:02d}.net.xml" for f in (file, again))
        # the line that says when and by which command differs
        assert one.read_text().splitlines()[20:] == other.read_text().splitlines()[20:]
    scenario = load_scenario(str(file.parent / "net_01.yaml"), seed=1)
    layout = make_layout(scenario)
    assert layout.task.vehicle.length == 12.0
    assert layout.road.path.length > 20.0


@pytest.mark.parametrize("wrong", ["--count=0", "--seeds=0"])
def test_nothing_to_make_is_one_line(wrong, tmp_path, capsys):
    assert main([str(tmp_path / "x"), wrong]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "x").exists()

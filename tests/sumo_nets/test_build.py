import importlib.util
import shutil

import pytest

from sumo_nets import build
from sumo_nets.errors import NetworkError

netconvert = pytest.mark.skipif(
    importlib.util.find_spec("sumo") is None, reason="eclipse-sumo is not installed"
)
NAMES = [
    "all_way_stop",
    "bottleneck",
    "crossing",
    "curved",
    "dense",
    "dense_curved",
    "intersection",
    "lane_change",
    "lane_change_curved",
    "lane_change_end",
    "lane_change_three",
    "lane_drop",
    "left_hand",
    "merge_ramp",
    "motorway",
    "on_ramp",
    "right_before_left",
    "ring",
    "roundabout",
    "stop_sign",
    "straight",
    "t_junction",
    "town",
    "u_shaped",
    "unprotected_left",
]


@pytest.fixture
def tree(tmp_path, monkeypatch):
    shutil.copytree(build.ROOT / "straight", tmp_path / "straight")
    monkeypatch.setattr(build, "ROOT", tmp_path)
    return tmp_path


def test_every_network_has_sources_and_is_built():
    assert build.source_names() == NAMES
    assert all(build.net_path(name).is_file() for name in NAMES)


@netconvert
@pytest.mark.parametrize("name", NAMES)
def test_committed_network_is_what_netconvert_makes(name):
    text = build.convert(name)
    assert text == build.net_path(name).read_text(encoding="utf-8")
    assert "<!--" not in text
    assert "/" + "tmp" not in text


@netconvert
def test_check_names_the_stale_network_and_writes_nothing(tree, capsys):
    target = tree / "straight" / "straight.net.xml"
    assert build.main(["--check"]) == 0
    changed = target.read_text().replace("13.8900", "20.0000")
    target.write_text(changed)
    assert build.main(["--check"]) == 1
    assert "straight: stale" in capsys.readouterr().err
    assert target.read_text() == changed


@netconvert
def test_rebuild_restores_a_missing_network_and_leaves_nothing_aside(tree):
    target = tree / "straight" / "straight.net.xml"
    before = target.read_bytes()
    files = sorted(path.name for path in target.parent.iterdir())
    target.unlink()
    assert build.main(["--check", "straight"]) == 1
    assert build.main(["straight"]) == 0
    assert target.read_bytes() == before
    assert sorted(path.name for path in target.parent.iterdir()) == files


@netconvert
def test_damaged_source_is_an_error_and_keeps_the_old_network(tree, capsys):
    source = tree / "straight" / "straight.edg.xml"
    before = (tree / "straight" / "straight.net.xml").read_bytes()
    source.write_text(source.read_text().replace('to="own_end"', 'to="nowhere"'))
    assert build.main(["straight"]) == 2
    assert "nowhere" in capsys.readouterr().err
    assert (tree / "straight" / "straight.net.xml").read_bytes() == before


def test_unknown_network_lists_the_known_ones(capsys):
    assert build.main(["moebius"]) == 2
    assert capsys.readouterr().err == (
        f'no network "moebius"; there are {", ".join(NAMES)}\n'
    )


def test_missing_netconvert_says_what_to_install(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(NetworkError, match="pip install eclipse-sumo==1"):
        build.convert("straight")

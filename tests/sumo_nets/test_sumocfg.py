import pytest

from sumo_nets.errors import NetworkError
from sumo_nets.sumocfg import command_options, read_sumocfg


def test_configuration_names_files_begin_and_options_of_the_traffic(tmp_path):
    file = tmp_path / "a.sumocfg"
    file.write_text(
        "<configuration><input><net-file value='n.net.xml'/>"
        "<route-files value='a.rou.xml,sub/b 2.rou.xml'/>"
        "<additional-files value='c.add.xml'/></input>"
        "<time><begin value='25200'/></time>"
        "<processing><lateral-resolution value='0.8'/><step-length value='1'/>"
        "<time-to-teleport value='300'/><log value='a.log'/>"
        "<ignore-route-errors value='--log=b.log'/></processing>"
        "<routing><device.rerouting.output value='c.xml'/></routing>"
        "<output><fcd-output value='big.xml'/></output></configuration>"
    )
    found = read_sumocfg(file)
    assert found.route_files == (tmp_path / "a.rou.xml", tmp_path / "sub/b 2.rou.xml")
    assert found.additional_files == (tmp_path / "c.add.xml",)
    assert found.net_file == tmp_path / "n.net.xml"
    assert found.begin == 25200.0
    assert list(command_options(found)) == [
        "--lateral-resolution=0.8",
        "--ignore-route-errors=--log=b.log",
    ]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("<configuration/>", "names no route-files"),
        ("<configuration>", "damaged configuration"),
        (
            "<c><route-files value='a'/><begin value='noon'/></c>",
            'begin: is "noon"; allowed: seconds',
        ),
        (
            "<c><route-files value='a'/><begin value='nan'/></c>",
            'begin: is "nan"; allowed: seconds >= 0',
        ),
        ("<?xml version='1.0' encoding='foo'?><c/>", "damaged configuration"),
        ("<c><load-state value='a'/></c>", "load-state: is not supported"),
    ],
)
def test_damaged_configurations_name_what_is_wrong(tmp_path, content, expected):
    file = tmp_path / "a.sumocfg"
    file.write_text(content)
    with pytest.raises(NetworkError, match=expected):
        read_sumocfg(file)


@pytest.mark.parametrize(
    ("value", "seconds"),
    [("07:00:30", 25230.0), ("1:00:00:00", 86400.0), ("12.5", 12.5)],
)
def test_the_begin_is_read_as_sumo_reads_it(tmp_path, value, seconds):
    file = tmp_path / "a.sumocfg"
    file.write_text(f"<c><route-files value='a'/><begin value='{value}'/></c>")
    assert read_sumocfg(file).begin == seconds


@pytest.mark.parametrize("value", ["-1", "7:00", "1:2:3:4:5", "a:b:c", "1:-30:0"])
def test_another_begin_is_refused(tmp_path, value):
    file = tmp_path / "a.sumocfg"
    file.write_text(f"<c><route-files value='a'/><begin value='{value}'/></c>")
    with pytest.raises(NetworkError, match="allowed: seconds >= 0, H:M:S"):
        read_sumocfg(file)

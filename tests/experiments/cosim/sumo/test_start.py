"""What SUMO itself refuses of a user's demand is one line, and nothing is written."""

import pytest
import yaml

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.start import split_messages
from experiments.episode.run import run_episode
from experiments.errors import ConfigError
from sumo_nets.catalogue import networks
from sumo_nets.demand_files import CHANGING_MODELS, FOLLOWING_MODELS

pytestmark = pytest.mark.sumo
CAR = '<vType id="car"/>'


def vehicle(**attributes):
    told = {"id": "v", "type": "car", "depart": "0", **attributes}
    written = " ".join(f'{key}="{value}"' for key, value in told.items())
    return f'<vehicle {written}><route edges="west_in north_out"/></vehicle>'


def car(**attributes):
    written = " ".join(f'{key}="{value}"' for key, value in attributes.items())
    return f'<vType id="car" {written}/>{vehicle()}'


def flow(**attributes):
    told = {"begin": "0", "end": "9", **attributes}
    written = " ".join(f'{key}="{value}"' for key, value in told.items())
    route = '<route edges="west_in north_out"/>'
    return f'{CAR}<flow id="f" type="car" {written}>{route}</flow>'


def drive(folder, content, **simulation):
    (folder / "d.rou.xml").write_text(f"<routes>{content}</routes>")
    scenario = {
        "name": "own",
        "network": {
            "file": str(networks()["intersection"].net_file),
            "route": ["west_in", "north_out"],
        },
        "ego": {"start_m": 60, "goal_m": 220},
        "traffic": {"route_files": ["d.rou.xml"]},
        "simulation": {"duration_s": 1, "warmup_s": 5, **simulation},
    }
    file = folder / "own.yaml"
    file.write_text(yaml.safe_dump(scenario))
    return run_episode(load_scenario(str(file)), out=folder / "runs")


REFUSED = {
    "unknown type": (
        CAR + vehicle(type="cra"),
        "The vehicle type 'cra' for vehicle 'v' is not known; did you mean \"car\"\\? "
        "allowed: a vType that is defined before",
    ),
    "length": (car(length="long"), "'length' in definition of vType 'car' Invalid"),
    "negative length": (car(length=-2), 'vType "car": length="-2": length must be'),
    "acceleration": (car(accel="x"), 'vType "car": accel="x": Invalid Car-Following'),
    "sigma": (car(sigma=2, accel=2), 'sigma="2": Invalid .* between \\[0-1\\]'),
    "in a child": (
        '<vType id="car"><carFollowing-IDM accel="x"/></vType>' + vehicle(),
        'vType "car": accel="x"',
    ),
    "speed factor": (car(speedFactor="x"), 'vType "car": speedFactor="x": '),
    "emissions": (car(emissionClass="x"), 'vType "car": emissionClass="x": '),
    "no type id": (f"<vType/>{vehicle()}", "line 1: <vType> has no id"),
    "two types": (CAR + car(), "Another vehicle type .* with the id 'car' exists"),
    "two vehicles": (CAR + vehicle() + vehicle(depart=900), "with id 'v' already"),
    "depart": (CAR + vehicle(depart="soon"), "Invalid departure .* a float >= 0"),
    "lane": (CAR + vehicle(departLane="left"), "Invalid departLane .* an int>=0"),
    "begin": (flow(begin="x", number=3), "Invalid begin time for flow 'f'"),
    "number": (flow(number="x"), "'number' in definition of flow 'f' Invalid Number"),
    "rate": (flow(vehsPerHour="x"), "'vehsPerHour' in definition of flow 'f'"),
    "following": (
        car(carFollowModel="Gipps"),
        f"Unknown car following model 'Gipps' .* {', '.join(FOLLOWING_MODELS.split())}",
    ),
    "changing": (
        car(laneChangeModel="MOBIL"),
        f"Unknown lane change model 'MOBIL' .*{', '.join(CHANGING_MODELS.split())}",
    ),
    "unknown route": (CAR + vehicle(route="r"), "The route 'r' for vehicle 'v'"),
    # seen only as the vehicle departs, here before the ego does
    "unreachable stop": (
        f'{CAR}<trip id="v" type="tram" depart="1" from="north_out" to="west_in"/>'
        '<vType id="tram" vClass="tram"/>',
        "'tram' for vehicle 'v' is not known",
    ),
    "on the way": (
        '<vType id="tram" vClass="tram"/>'
        '<trip id="v" type="tram" depart="1" from="north_out" to="west_in"/>',
        "SUMO failed while warming up: Vehicle 'v' has no valid route",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused_demand_is_one_line_and_leaves_nothing(tmp_path, capfd, kind):
    content, expected = REFUSED[kind]
    with pytest.raises(ConfigError, match=expected) as caught:
        drive(tmp_path, content)
    assert "d.rou.xml: " in str(caught.value)
    assert "\n" not in str(caught.value)
    assert list((tmp_path / "runs").iterdir()) == []
    assert "Error" not in capfd.readouterr().err


@pytest.mark.parametrize("key", ["carFollowModel", "laneChangeModel"])
def test_models_that_are_called_allowed_are_known_to_sumo(tmp_path, key):
    listed = {"carFollowModel": FOLLOWING_MODELS, "laneChangeModel": CHANGING_MODELS}
    types = "".join(
        f'<vType id="t{number}" {key}="{name}" lanesCount="2"/>'
        for number, name in enumerate(listed[key].split())
    )
    assert drive(tmp_path, types).ending.status == "timeout"


def test_the_file_of_several_that_holds_the_mistake_is_named(tmp_path):
    (tmp_path / "types.add.xml").write_text(f"<additional>{CAR}</additional>")
    (tmp_path / "d.rou.xml").write_text(f"<routes>{vehicle(type='cra')}</routes>")
    text = yaml.safe_dump(
        {
            "name": "own",
            "network": {
                "file": str(networks()["intersection"].net_file),
                "route": ["west_in", "north_out"],
            },
            "ego": {"start_m": 60, "goal_m": 220},
            "traffic": {
                "route_files": ["d.rou.xml"],
                "additional_files": ["types.add.xml"],
            },
        }
    )
    file = tmp_path / "own.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as caught:
        run_episode(load_scenario(str(file)), out=tmp_path)
    assert str(caught.value).startswith(f"{tmp_path / 'd.rou.xml'}: The vehicle type")


def test_messages_of_others_are_kept_apart_from_sumos():
    said = "10 % done\nError: A is bad.\n And so is B.\nError: Process Error\n"
    assert split_messages(said) == ("10 % done\n", "A is bad. And so is B")
    assert split_messages("fine\n") == ("fine\n", "")

"""Configurations of SUMO: which files and options of theirs are a demand."""

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from sumo_nets.demand_records import DemandFiles
from sumo_nets.errors import NetworkError

# Options of a configuration that shape the traffic. None names a file: a configuration
# of somebody else must not write or read any. Neither are those here that the episode
# sets: step length, seed, teleporting, collisions.
TRAFFIC_OPTIONS = frozenset(
    (
        "step-method.ballistic",
        "extrapolate-departpos",
        "lateral-resolution",
        "route-steps",
        "no-internal-links",
        "ignore-junction-blocker",
        "ignore-route-errors",
        "keep-after-arrival",
        "max-num-vehicles",
        "max-num-persons",
        "scale",
        "scale-suffix",
        "waiting-time-memory",
        "startup-wait-threshold",
        "max-depart-delay",
        "sloppy-insert",
        "eager-insert",
        "emergency-insert",
        "insertion-checks",
        "random-depart-offset",
        "lanechange.overtake-right",
        "tls.all-off",
        "tls.actuated.jam-threshold",
        "tls.actuated.detector-length",
        "tls.delay_based.detector-range",
        "tls.yellow.min-decel",
        "railsignal-moving-block",
        "railsignal.moving-block.default-classes",
        "railsignal.moving-block.max-dist",
        "railsignal.max-block-length",
        "railsignal.default-classes",
        "slope-centered",
        "time-to-impatience",
        "default.departspeed",
        "default.departlane",
        "default.action-step-length",
        "default.carfollowmodel",
        "default.speeddev",
        "default.emergencydecel",
        "parking.maneuver",
        "use-stop-ended",
        "use-stop-started",
        "pedestrian.model",
        "pedestrian.timegap-crossing",
        "pedestrian.striping.stripe-width",
        "pedestrian.striping.dawdling",
        "pedestrian.striping.mingap-to-vehicle",
        "pedestrian.striping.jamtime",
        "pedestrian.striping.jamtime.crossing",
        "pedestrian.striping.jamtime.narrow",
        "pedestrian.striping.jamfactor",
        "pedestrian.striping.reserve-oncoming",
        "pedestrian.striping.reserve-oncoming.junctions",
        "pedestrian.striping.reserve-oncoming.max",
        "pedestrian.striping.legacy-departposlat",
        "pedestrian.striping.walkingarea-detail",
        "pedestrian.jupedsim.step-length",
        "pedestrian.jupedsim.exit-tolerance",
        "pedestrian.jupedsim.model",
        "pedestrian.jupedsim.strength-neighbor-repulsion",
        "pedestrian.jupedsim.range-neighbor-repulsion",
        "pedestrian.jupedsim.strength-geometry-repulsion",
        "pedestrian.jupedsim.range-geometry-repulsion",
        "ride.stop-tolerance",
        "mapmatch.distance",
        "mapmatch.junctions",
        "mapmatch.taz",
        "routing-algorithm",
        "weights.turnaround-penalty",
        "weights.reversal-penalty",
        "weights.random-factor",
        "weights.random-factor.dynamic",
        "weights.minor-penalty",
        "weights.tls-penalty",
        "weights.priority-factor",
        "weights.separate-turns",
        "persontrip.walk-opposite-factor",
        "persontrip.walkfactor",
        "persontrip.transfer.car-walk",
        "persontrip.transfer.taxi-walk",
        "persontrip.transfer.walk-taxi",
        "persontrip.default.group",
        "persontrip.taxi.waiting-time",
        "persontrip.ride-public-line",
        "railway.max-train-length",
        "replay-rerouting",
        "device.rerouting.probability",
        "device.rerouting.explicit",
        "device.rerouting.deterministic",
        "device.rerouting.period",
        "device.rerouting.pre-period",
        "device.rerouting.adaptation-weight",
        "device.rerouting.adaptation-steps",
        "device.rerouting.adaptation-interval",
        "device.rerouting.threshold.factor",
        "device.rerouting.threshold.constant",
        "device.rerouting.with-taz",
        "device.rerouting.mode",
        "device.rerouting.synchronize",
        "device.rerouting.railsignal",
        "device.rerouting.bike-speeds",
        "person-device.rerouting.probability",
        "person-device.rerouting.explicit",
        "person-device.rerouting.deterministic",
        "person-device.rerouting.period",
        "person-device.rerouting.mode",
        "person-device.rerouting.scope",
    )
)


MINUTE, HOUR, DAY = 60.0, 3600.0, 86400.0  # [s]


def read_sumocfg(file: Path) -> DemandFiles:
    """Read the demand of a .sumocfg.

    Raises:
        NetworkError: If it is missing, damaged, or has no demand.
    """
    try:
        root = ElementTree.parse(file).getroot()
    except OSError as error:
        raise NetworkError(f"{file}: no such configuration") from error
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise NetworkError(f"{file}: damaged configuration ({error})") from error
    values = {item.tag: item.get("value", "") for item in root.iter()}
    if "load-state" in values:
        raise NetworkError(
            f"{file}: load-state: is not supported; allowed: route-files"
        )
    routes = _paths(file, values.get("route-files", ""))
    if not routes:
        raise NetworkError(f"{file}: names no route-files: there is no demand in it")
    begin = _seconds(values.get("begin") or "0")
    if not 0.0 <= begin < math.inf:
        raise NetworkError(
            f'{file}: begin: is "{values["begin"]}"; '
            "allowed: seconds >= 0, H:M:S, D:H:M:S"
        )
    options = [
        (name, value) for name, value in values.items() if name in TRAFFIC_OPTIONS
    ]
    net = _paths(file, values.get("net-file", ""))
    return DemandFiles(
        routes,
        _paths(file, values.get("additional-files", "")),
        begin,
        tuple(options),
        net[0] if net else None,
    )


def _seconds(text: str) -> float:
    """Read a time as SUMO does: seconds, H:M:S or D:H:M:S; nan if it is none."""
    parts = text.split(":")
    if len(parts) not in (1, 3, 4):
        return math.nan
    try:
        *more, hours, minutes, seconds = [0.0, 0.0, *map(float, parts)]
    except ValueError:
        return math.nan
    if min(*more, hours, minutes, seconds) < 0.0:
        return math.nan
    return DAY * sum(more) + HOUR * hours + MINUTE * minutes + seconds


def _paths(file: Path, value: str) -> tuple[Path, ...]:
    """Split a list of files, which are relative to the configuration."""
    names = (name.strip() for name in value.split(","))  # which may hold blanks
    return tuple((file.parent / name).resolve() for name in names if name)


def command_options(demand: DemandFiles) -> Iterator[str]:
    """Return the options of SUMO's command line, files aside."""
    for name, value in demand.options:
        # In one word: a value that looks like an option would be one.
        yield f"--{name}={value}"

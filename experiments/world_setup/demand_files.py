"""The demand of a user's own SUMO files, as a scenario names them."""

from pathlib import Path

from experiments.config import Scenario, SumoTraffic
from sumo_nets.demand_files import check_demand, named_vehicle, times_missed
from sumo_nets.demand_records import DemandFiles, NamedVehicle
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Net
from sumo_nets.sumocfg import read_sumocfg


def demand_files(scenario: Scenario) -> DemandFiles | None:
    """Return the files that the traffic section names, None if it names none.

    Raises:
        NetworkError: If a configuration cannot be read.
    """
    traffic = scenario.traffic
    if not isinstance(traffic, SumoTraffic):
        return None
    if traffic.sumocfg is not None:
        found = read_sumocfg(Path(traffic.sumocfg))
    else:
        found = DemandFiles(
            tuple(map(Path, traffic.route_files or ())),
            tuple(map(Path, traffic.additional_files or ())),
        )
    begin = found.begin if traffic.begin_s is None else traffic.begin_s
    return DemandFiles(
        found.route_files,
        found.additional_files,
        begin,
        found.options,
        found.net_file,
    )


def checked_demand(scenario: Scenario, net_file: Path) -> DemandFiles | None:
    """Return the files of a demand that fits a network.

    Raises:
        ConfigError: If it does not, or a file is damaged; file, id and what to do.
    """
    try:
        demand = demand_files(scenario)
        if demand is not None:
            _check_network(demand, net_file)
            check_demand(demand, read_net(net_file))
    except NetworkError as error:
        raise scenario.error(("traffic",), str(error)) from error
    return demand


def missed_demand(scenario: Scenario) -> str:
    """Say so if nobody of a scenario's demand departs in a run.

    Returns:
        A sentence; "" if somebody does, or nobody is asked for. A vehicle to take over
        departs, whenever that is.

    Raises:
        NetworkError: If a file is missing or damaged.
    """
    demand = demand_files(scenario)
    taken = scenario.network is not None and scenario.network.vehicle is not None
    if demand is None or taken:
        return ""
    simulation = scenario.simulation
    end = demand.begin + simulation.warmup_s + simulation.duration_s
    missed = times_missed(demand, end)
    if not missed:
        return ""
    names = ", ".join(file.name for file in demand.files)
    return f"No vehicle of {names} is on the road: {missed}."


def taken_vehicle(scenario: Scenario, net: Net) -> NamedVehicle | None:
    """Return the vehicle whose place the ego takes, None without one.

    Raises:
        NetworkError: If it is not in the files.
    """
    name = scenario.network.vehicle if scenario.network is not None else None
    demand = demand_files(scenario)
    if name is None or demand is None:
        return None
    check_demand(demand, net)
    found = named_vehicle(demand, net, name)
    if found.depart < demand.begin:
        raise NetworkError(
            f'vehicle "{name}" departs at {found.depart:g} s; allowed: from '
            f"traffic.begin_s = {demand.begin:g} on"
        )
    return found


def _check_network(demand: DemandFiles, net_file: Path) -> None:
    """Raise if the demand says that it was made for another network."""
    made_for = demand.net_file
    if made_for is None or made_for == net_file.resolve():
        return
    same = made_for.is_file() and made_for.read_bytes() == net_file.read_bytes()
    if not same:
        raise NetworkError(
            f"is for the network {made_for}, not {net_file}; take that one as "
            "network.file"
        )

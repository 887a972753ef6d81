"""Networks from maps: OpenDRIVE and OpenStreetMap by netconvert, and what came out.

A converted network is kept by the content of its map, so that a map is converted once.
"""

import hashlib
import os
import re
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from sumo_nets.build import sumo_home
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Edge, Net

OPENDRIVE = (".xodr",)
OPENSTREETMAP = (".osm", ".osm.xml", ".osm.gz")
MAPS = (*OPENDRIVE, *OPENSTREETMAP)

COMMON = (
    "--no-turnarounds=true",
    "--precision=4",
    "--junctions.internal-link-detail=40",
)
OPENDRIVE_OPTIONS = ("--opendrive.curve-resolution=0.5",)
OPENSTREETMAP_OPTIONS = (
    "--geometry.remove=true",
    "--ramps.guess=true",
    "--junctions.join=true",
    "--tls.guess-signals=true",
    "--tls.discard-simple=true",
    "--tls.join=true",
    "--keep-edges.by-vclass=passenger",
    "--remove-edges.isolated=true",
)
VERSION = "1"  # of the options: with others a map is converted anew
LONGEST = 600.0  # of a conversion [s]
SHOWN = 200  # letters of netconvert's message


def is_map(file: str | Path) -> bool:
    """Tell whether a file is a map that becomes a network by conversion."""
    return str(file).endswith(MAPS)


def network_of_map(file: Path) -> Path:
    """Convert a map, or find the network that it was converted to before.

    Returns:
        The .net.xml.

    Raises:
        NetworkError: If the map or netconvert is missing, the map cannot be converted,
            or no road for cars came out.
    """
    try:
        content = hashlib.sha256(file.read_bytes() + VERSION.encode()).hexdigest()
    except OSError as error:
        raise NetworkError(f"{file}: no such map") from error
    stem = file.name.partition(".")[0]
    target = _folder() / f"{stem}-{content[:16]}.net.xml"
    if not target.is_file():
        text, _ = _converted(file)
        target.parent.mkdir(parents=True, exist_ok=True)
        aside = target.with_name(f".{target.name}.{os.getpid()}")
        aside.write_text(text, encoding="utf-8")
        aside.replace(target)
    if not any(edge.drivable_lanes for edge in read_net(target).roads):
        said = _converted(file)[1]
        words = f": {said}" if said else ""
        raise NetworkError(
            f"{file}: no road for cars came out of the conversion{words}"
        )
    return target


def missing_parts(file: Path, net: Net) -> list[str]:
    """List what a conversion has lost, one line each.

    Roads for cars that end at a junction with others and lead nowhere; of OpenDRIVE
    also connections of the map that no connection of the network stands for.
    """
    lines = [
        f'{file}: edge "{edge.id}" leads nowhere at junction "{edge.end}"'
        for edge in net.roads
        if edge.drivable_lanes and _is_cut_off(net, edge)
    ]
    if str(file).endswith(OPENDRIVE):
        lines += _missing_connections(file, net)
    return lines


def _is_cut_off(net: Net, edge: Edge) -> bool:
    """Check whether roads go on at the end of an edge, but not from it."""
    if any(x.target.drivable for lane in edge.drivable_lanes for x in lane.links):
        return False
    onward = [e for e in net.roads if e.start == edge.end and e.end != edge.start]
    return any(e.drivable_lanes for e in onward)


def _missing_connections(file: Path, net: Net) -> list[str]:
    """List the connections of OpenDRIVE junctions that the network does not have."""
    root = ElementTree.parse(file).getroot()
    onward = {road.get("id", ""): _neighbours(road) for road in root.iter("road")}
    made = {
        (_road_of(edge), _road_of(link.target.edge))
        for edge in net.roads
        for lane in edge.lanes
        for link in lane.links
    }
    lines = []
    for junction in root.iter("junction"):
        for connection in junction.iter("connection"):
            begin = connection.get("incomingRoad", "")
            over = connection.get("connectingRoad", "")
            ends = onward.get(over, set()) - {begin}
            lines += [
                f'{file}: junction "{junction.get("id")}": the way from road "{begin}" '
                f'to road "{end}" is missing'
                for end in sorted(ends)
                if (begin, end) not in made
            ]
    return lines


def _neighbours(road: ElementTree.Element) -> set[str]:
    """Return the roads before and after a road."""
    found = (road.find("link/predecessor"), road.find("link/successor"))
    return {
        link.get("elementId", "")
        for link in found
        if link is not None and link.get("elementType") == "road"
    }


def _road_of(edge: Edge) -> str:
    """Return the road of the map that an edge comes from: of -12.30.00 it is 12."""
    return edge.id.removeprefix("-").partition(".")[0]


def _converted(file: Path) -> tuple[str, str]:
    """Convert a map.

    Returns:
        The text of the network, comments stripped, and of what netconvert warns first.
    """
    drive = str(file).endswith(OPENDRIVE)
    source = "--opendrive-files" if drive else "--osm-files"
    try:
        home = sumo_home()
    except NetworkError as error:
        raise NetworkError(
            f"{file}: is a map; {error}, or convert it elsewhere with netconvert "
            f"{source} {file.name} -o {file.name.partition('.')[0]}.net.xml"
        ) from error
    options = OPENDRIVE_OPTIONS if drive else OPENSTREETMAP_OPTIONS
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / "built.net.xml"
        command = [home / "bin" / "netconvert", f"{source}={file}", *COMMON, *options]
        done = _run([*map(str, command), f"--output-file={built}"], home)
        if done.returncode != 0 or not built.is_file():
            raise NetworkError(f"{file}: netconvert cannot read it: {_reason(done)}")
        text = built.read_text(encoding="utf-8")
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    return text, _reason(done) if done.stderr.strip() else ""


def _run(command: Sequence[str], home: Path) -> subprocess.CompletedProcess[str]:
    """Run netconvert."""
    try:
        return subprocess.run(
            command,
            env={**os.environ, "SUMO_HOME": str(home)},
            capture_output=True,
            text=True,
            check=False,
            timeout=LONGEST,
        )
    except subprocess.TimeoutExpired as error:
        raise NetworkError(f"netconvert took more than {LONGEST:g} s") from error


def _reason(done: subprocess.CompletedProcess[str]) -> str:
    """Pick what netconvert says about a failure."""
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("Error")] or lines
    return errors[0][:SHOWN] if errors else f"exit status {done.returncode}"


def _folder() -> Path:
    """Return where converted networks are kept."""
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache) / "rearview" / "networks"

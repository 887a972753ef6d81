"""Build the committed .net.xml files from their plain XML sources with netconvert.

`python -m sumo_nets.build` rebuilds all, `... intersection` one, `--check` compares
without writing and exits 1 naming what is stale. netconvert comes with eclipse-sumo;
its output is the same byte for byte once its comments (date, paths) are stripped.
"""

import argparse
import importlib.metadata
import importlib.util
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from sumo_nets.errors import NetworkError

ROOT = Path(__file__).parent / "networks"

OPTIONS = (
    "--no-turnarounds=true",
    # Keep the coordinates of the sources.
    "--offset.disable-normalization=true",
    "--precision=4",
    # Points of a path over a junction; five by default, with jumps of 28 degrees.
    "--junctions.internal-link-detail=40",
    # Edges end where their shapes end: no rounded corners cut out of them.
    "--junctions.corner-detail=0",
)

# What single networks need besides.
OWN_OPTIONS = {"left_hand": ("--lefthand=true",)}

# Kinds of source files and the options that take them.
SOURCES = {
    "nod": "--node-files",
    "edg": "--edge-files",
    "con": "--connection-files",
    "tll": "--tllogic-files",
}


def source_names() -> list[str]:
    """List the networks that have sources."""
    return sorted(path.parent.name for path in ROOT.glob("*/*.nod.xml"))


def net_path(name: str) -> Path:
    """Return the file of the built network `name`."""
    return ROOT / name / f"{name}.net.xml"


def convert(name: str) -> str:
    """Convert the sources of `name`.

    Returns:
        The text of the .net.xml, comments stripped.

    Raises:
        NetworkError: If `name` has no sources, or netconvert is missing or fails.
    """
    if name not in source_names():
        raise NetworkError(
            f'no network "{name}"; there are {", ".join(source_names())}'
        )
    home = sumo_home()
    sources = [
        f"{option}={ROOT / name / f'{name}.{kind}.xml'}"
        for kind, option in SOURCES.items()
        if (ROOT / name / f"{name}.{kind}.xml").is_file()
    ]
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / "built.net.xml"
        done = subprocess.run(
            [
                home / "bin" / "netconvert",
                *sources,
                *OPTIONS,
                *OWN_OPTIONS.get(name, ()),
                f"--output-file={built}",
            ],
            env={**os.environ, "SUMO_HOME": str(home)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0 or _warnings(done.stderr) or not built.is_file():
            raise NetworkError(f"netconvert failed on {name}: {done.stderr.strip()}")
        text = built.read_text(encoding="utf-8")
    return re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)


def is_stale(name: str) -> bool:
    """Check whether the committed network differs from its sources."""
    built = net_path(name)
    return not built.is_file() or built.read_text(encoding="utf-8") != convert(name)


def rebuild(name: str) -> None:
    """Write the network `name`, whole or not at all."""
    text = convert(name)
    target = net_path(name)
    aside = target.with_name(f".{target.name}.{os.getpid()}")
    aside.write_text(text, encoding="utf-8")
    aside.replace(target)


def _warnings(messages: str) -> list[str]:
    """Pick the warnings of netconvert: the network is then not what was meant.

    Opposite left turns may cross: their greens never come together here.
    """
    lines = [line for line in messages.splitlines() if line.startswith("Warning")]
    return [line for line in lines if "Intersecting left turns" not in line]


def sumo_home() -> Path:
    """Find the folder of the eclipse-sumo package, which holds bin/netconvert."""
    spec = importlib.util.find_spec("sumo")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        suffix = ".exe" if os.name == "nt" else ""
        if (Path(folder) / "bin" / f"netconvert{suffix}").is_file():
            return Path(folder)
    release = importlib.metadata.version("sumolib")
    raise NetworkError(f"netconvert is missing: pip install eclipse-sumo=={release}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Rebuild or check networks.

    Returns:
        0; with --check 1 if a network is stale; 2 on an error.
    """
    parser = argparse.ArgumentParser(prog="sumo_nets.build", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="all by default")
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    options = parser.parse_args(arguments)
    names = options.names or source_names()
    try:
        if not options.check:
            for name in names:
                rebuild(name)
                sys.stdout.write(f"built {net_path(name)}\n")
            return 0
        stale = [name for name in names if is_stale(name)]
    except NetworkError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    for name in stale:
        sys.stderr.write(f"{name}: stale, run python -m sumo_nets.build {name}\n")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())

"""Loads the simulator, or explains why it cannot be loaded.

`python -m experiments.cosim.sumo.system_libraries` checks it from the shell.

The wheel of libsumo links some libraries that only the system has.
"""

import re
import sys
from typing import cast

from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.errors import SimulationError

# library -> package on Debian and Ubuntu, on Fedora
PACKAGES = {
    "libX11": ("libx11-6", "libX11"),
    "libXext": ("libxext6", "libXext"),
    "libXrender": ("libxrender1", "libXrender"),
    "libGL": ("libgl1", "mesa-libGL"),
    "libatomic": ("libatomic1", "libatomic"),
    "libexpat": ("libexpat1", "expat"),
    "libz": ("zlib1g", "zlib"),
}
_MISSING = re.compile(r"(lib[A-Za-z0-9_+-]+)\.so[.0-9]*: cannot open shared object")


def load_libsumo() -> Libsumo:
    """Import libsumo, which needs libraries of the system.

    Raises:
        SimulationError: One line that names the missing library and how to install it.
    """
    try:
        import libsumo
    except (ImportError, OSError) as error:
        raise SimulationError(explain(error)) from error
    return cast(Libsumo, libsumo)


def explain(error: Exception) -> str:
    """Return what to install, given the error of loading libsumo."""
    text = " ".join(str(error).split())
    found = _MISSING.search(text)
    if isinstance(error, ModuleNotFoundError) and error.name == "libsumo":
        return "libsumo is not installed: make install"
    if found is None:
        return f"libsumo cannot be loaded: {text}"
    debian = " ".join(package for package, _ in PACKAGES.values())
    fedora = " ".join(package for _, package in PACKAGES.values())
    return (
        f"the system library {found[1]} is missing, which libsumo needs; install it: "
        f"apt-get install {debian} (Fedora: dnf install {fedora})"
    )


def main() -> int:
    """Report on the simulator; 0 if it can be loaded, else 2."""
    try:
        load_libsumo()
    except SimulationError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

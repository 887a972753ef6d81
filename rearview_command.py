"""The command `rearview`, from outside its packages.

A module of the user's called `experiments` hides the package of that name, and the
command line inside it with it: that can only be noticed from here.
"""

import gc
import sys
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent
PACKAGES = ("experiments", "planner", "sumo_nets")
BAD_INPUT, INTERRUPTED = 2, 130  # exit statuses


def main() -> None:
    """Run the command line, unless a module of the user's hides a package of ours."""
    problem = hidden_package()
    if problem is not None:
        sys.stderr.write(f"rearview: {problem}\n")
        sys.exit(BAD_INPUT)
    gc.disable()  # while the command line is imported, which sets how often it works
    try:
        from experiments.cli.app import main as run
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    gc.enable()
    run()


def hidden_package() -> str | None:
    """Find a package of ours that a module of the user's hides.

    Returns:
        The line that says which, and what to do; None if there is none.
    """
    for name in PACKAGES:
        spec = find_spec(name)
        origin = None if spec is None else spec.origin
        if origin is None or Path(origin).resolve().parent != ROOT / name:
            return (
                f"{origin or name}: the name {name} is taken by rearview; allowed: "
                f"another name for this file, such as my_{name}.py"
            )
    return None


if __name__ == "__main__":
    main()

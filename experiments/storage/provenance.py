"""Provenance of a run: versions, hashes, state of the repository."""

import hashlib
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("planner", "sumo_nets", "experiments")
LIBRARIES = (
    "rearview",
    "libsumo",
    "shapely",
    "numpy",
    "scipy",
    "numba",
    "pydantic",
    "duckdb",
)
GIT_PATIENCE = 5.0  # [s]
# as `git status` writes the commit, and what stands there before the first one
_COMMIT, _NO_COMMIT = "# branch.oid ", "(initial)"


def versions() -> dict[str, str | None]:
    """Return the versions of Python and of the libraries that affect results."""
    found: dict[str, str | None] = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # the tree is used without being installed
            found[name] = None
    return found


def code_hash() -> str:
    """Hash all Python sources of the three packages; sha256, hexadecimal."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for source in sorted((ROOT / package).rglob("*.py")):
            digest.update(f"{source.relative_to(ROOT)}\n".encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()


def file_hash(path: Path) -> str:
    """Hash a file; sha256, hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def text_hash(text: str) -> str:
    """Hash a text; sha256, hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def git_state() -> dict[str, Any] | None:
    """Return commit and whether the tree differs from it; None outside a checkout."""
    if not (ROOT / ".git").exists():
        return None
    status = _git("status", "--porcelain=v2", "--branch", "--untracked-files=no")
    lines = [] if status is None else status.splitlines()
    commits = [line.removeprefix(_COMMIT) for line in lines if line.startswith(_COMMIT)]
    if not commits or commits[0] == _NO_COMMIT:
        return None
    changed = any(not line.startswith("#") for line in lines)
    return {"commit": commits[0], "dirty": changed}


def _git(*arguments: str) -> str | None:
    """Run git in the tree; None if it fails."""
    try:
        done = subprocess.run(
            ["git", "-C", str(ROOT), *arguments],
            capture_output=True,
            text=True,
            timeout=GIT_PATIENCE,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()

"""Self-contained pages: one template, its style and scripts, its data.

Nothing that comes from a run can become markup: Jinja escapes what stands in the text,
data go into a block of JSON in which `<`, `>` and `&` are written as escapes, and the
page's own content security policy lets only the script run that was put in here, and
nothing be fetched.
"""

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from experiments.storage.atomic_folder import write_atomically

PAGES = Path(__file__).parent / "pages"
PAGE_FILE = "report.html"

_ESCAPES = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028"}


def render(
    template: str, scripts: Sequence[str], data: Any, facts: Mapping[str, Any]
) -> str:
    """Render a page.

    Args:
        template: File of `pages`.
        scripts: Files of `pages`, in their order; they share one scope.
        data: For the scripts; anything that JSON can hold.
        facts: For the template.

    Returns:
        The page.
    """
    script = _script(tuple(scripts))
    page: str = (
        _environment()
        .get_template(template)
        .render(
            style=_asset("page.css"),
            script=script,
            script_hash=_hash(script),
            data=_json(data),
            **facts,
        )
    )
    return page


def save(page: str, file: Path) -> Path:
    """Write a page atomically and return its file.

    Raises:
        ResultsError: If the disk refuses.
    """
    write_atomically(file, page)
    return file


def _json(data: Any) -> str:
    """Encode JSON that cannot end its script block."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    for sign, escape in _ESCAPES.items():
        text = text.replace(sign, escape)
    return text


def _script(names: tuple[str, ...]) -> str:
    """Join scripts in one function scope."""
    parts = "\n".join(_asset(name) for name in names)
    return f'(() => {{\n"use strict";\n{parts}\n}})();\n'


def _hash(script: str) -> str:
    """Hash a script for a content security policy."""
    digest = hashlib.sha256(script.encode()).digest()
    return f"sha256-{base64.b64encode(digest).decode('ascii')}"


@cache
def _asset(name: str) -> str:
    """Read an asset of pages."""
    return (PAGES / name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    """Set up Jinja: everything is escaped, an undefined name is an error."""
    return Environment(
        loader=FileSystemLoader(PAGES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

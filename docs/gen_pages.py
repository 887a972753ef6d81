"""MkDocs hook: fill the generated parts of the reference into its pages.

A page asks for a part by a line of its own: `<!-- generated: scenario keys -->`. Keys
come from the JSON Schemas that `rearview schema` prints, columns from the schema of the
trace, metrics from their catalogue, so that the site cannot differ from the code.
"""

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from experiments.config.scenario_file import schema_text
from experiments.config.search_file import search_schema
from experiments.config.sweep_file import sweep_schema
from experiments.metrics import catalogue
from experiments.trace.schema import MODEL_TABLES, TABLES

HERE = Path(__file__).parent
MARK = re.compile(r"^<!-- generated: (.+) -->$", re.MULTILINE)

Schema = Mapping[str, Any]


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the marks of a page; MkDocs calls this for every page."""
    return fill(markdown)


def fill(markdown: str) -> str:
    """Replace every mark by the part that it names.

    Raises:
        KeyError: If there is no such part.
    """
    return MARK.sub(lambda mark: PARTS[mark[1]](), markdown)


def scenario_keys() -> str:
    """Return one table for each section of a scenario file."""
    return schema_tables(json.loads(schema_text()))


def sweep_keys() -> str:
    """Return one table for each section of a sweep file."""
    return schema_tables(sweep_schema())


def search_keys() -> str:
    """Return one table for each section of a search file."""
    return schema_tables(search_schema())


def metric_table() -> str:
    """Return the table of metrics."""
    return catalogue.markdown_table()


def trace_columns() -> str:
    """Return the tables of a run folder with their columns."""
    lines = ["| file | columns |", "|---|---|"]
    for table, columns in {**TABLES, **MODEL_TABLES}.items():
        file = "trace" if table == "steps" else table
        names = " ".join(f"`{column}`" for column in columns)
        lines.append(f"| `{file}.parquet` | {names} |")
    return "\n".join(lines)


PARTS: Mapping[str, Callable[[], str]] = {
    "scenario keys": scenario_keys,
    "sweep keys": sweep_keys,
    "search keys": search_keys,
    "metrics": metric_table,
    "trace columns": trace_columns,
}


def schema_tables(schema: Schema) -> str:
    """Return Markdown for a schema: the file's own keys, then each section."""
    schema = _without_references_to_values(schema, schema["$defs"])
    parts = [_table(schema)]
    sections = _in_order_of_use(schema)
    for name in sections:
        section = schema["$defs"][name]
        words = section.get("description", "")
        parts.append(f"### {name}\n\n{words}\n\n{_table(section)}")
    return "\n\n".join(parts)


def _without_references_to_values(part: Any, definitions: Schema) -> Any:
    """Put definitions other than sections (enumerations) where they are referred to."""
    if isinstance(part, list):
        return [_without_references_to_values(item, definitions) for item in part]
    if not isinstance(part, Mapping):
        return part
    target = definitions.get(str(part.get("$ref", "")).rpartition("/")[2])
    if target is not None and "properties" not in target:
        part = {**target, **{key: part[key] for key in part if key != "$ref"}}
    return {
        key: _without_references_to_values(value, definitions)
        for key, value in part.items()
    }


def _in_order_of_use(schema: Schema) -> list[str]:
    """Return the names of all sections, each after the one that first mentions it."""
    found: list[str] = []
    queue: list[Schema] = [schema["properties"]]
    while queue:
        for name in re.findall(r"#/\$defs/(\w+)", json.dumps(queue.pop(0))):
            if name not in found and "properties" in schema["$defs"][name]:
                found.append(name)
                queue.append(schema["$defs"][name])
    return found


def _table(section: Schema) -> str:
    """Return the table of one section's keys."""
    required = section.get("required", ())
    lines = ["| key | allowed | default | meaning |", "|---|---|---|---|"]
    for key, value in section["properties"].items():
        default = "*required*" if key in required else _default(value)
        cells = (f"`{key}`", _allowed(value), default, value.get("description", ""))
        lines.append(
            "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
        )
    return "\n".join(lines)


def _default(value: Schema) -> str:
    """Return a default as it is written in YAML; sections have their own tables."""
    default = value.get("default")
    if default is None or isinstance(default, Mapping):
        return ""
    return f"`{json.dumps(default, ensure_ascii=False)}`"


def _allowed(value: Schema) -> str:
    """Return in words what a schema allows."""
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "anyOf" in value:
        return " or ".join(
            _allowed(choice)
            for choice in value["anyOf"]
            if choice.get("type") != "null"
        )
    if "enum" in value:
        return ", ".join(f"`{choice}`" for choice in value["enum"])
    if "const" in value:
        return f"`{value['const']}`"
    kind = value.get("type", "anything")
    if kind == "array":
        return _allowed_list(value)
    if kind == "object":
        values = value.get("additionalProperties")
        inner = (
            _allowed(values) if isinstance(values, Mapping) and values else "anything"
        )
        return f"names, each with {inner}"
    words = {"string": "text", "boolean": "`true`, `false`"}.get(kind, kind)
    return f"{words}{_range(value)}"


def _allowed_list(value: Schema) -> str:
    """Return in words what a list may hold."""
    if "prefixItems" in value:
        return "[" + ", ".join(map(_allowed, value["prefixItems"])) + "]"
    items = value.get("items", {})
    return f"list of {_allowed(items)}" if items else "list"


def _range(value: Schema) -> str:
    """Return the range of a number, ", 0 to 70"; "" without one."""
    low, above = value.get("minimum"), value.get("exclusiveMinimum")
    high = value.get("maximum")
    parts = []
    if above is not None:
        parts.append(f"above {above:g}" + (" and" if high is not None else ""))
    if low is not None:
        parts.append(f"{low:.10g}" if high is not None else f"at least {low:.10g}")
    if high is not None:
        parts.append(f"to {high:.10g}" if low is not None else f"at most {high:.10g}")
    return f" ({' '.join(parts)})" if parts else ""

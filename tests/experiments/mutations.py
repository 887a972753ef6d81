"""Mutations of texts, JSON and Parquet files, each made from a seed."""

import json
import random
import re
from pathlib import Path
from typing import Any

import duckdb

ODD_VALUES: tuple[Any, ...] = (
    None,
    True,
    0,
    -1,
    1,
    2**31,
    2**63,
    10**400,
    0.5,
    -0.0,
    1e-320,
    1e308,
    "",
    "x",
    "é\n\x00",
    "../..",
    "a" * 3000,
    "<script>",
    [],
    [[]],
    [1, "x", None],
    {},
    {"x": {"y": 1}},
    "2020-01-01",
)
# as text, where they cannot be made by a writer of JSON or YAML
ODD_TEXTS = (
    "NaN",
    "-Infinity",
    "1e999",
    "9" * 5000,
    '"\\ud800"',
    "[" * 3000,
    "[" * 60 + "]" * 60,
    '{"a":' * 500 + "1" + "}" * 500,
    "&a [*a]",
    "!!python/object:os.system x",
    "1:30",
    ".inf",
    "0x1F",
    "\t",
    "\ufeff",
    "\x00",
    "- ",
    ": ",
    "#",
)


def mutated_text(text: str, rng: random.Random) -> str:
    """A text with one to three small injuries."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        text = rng.choice(_TEXT_INJURIES)(text, rng)
    return text


def _swap_value(text: str, rng: random.Random) -> str:
    values = list(re.finditer(r"(?<=[:\[,] )[^\s,{}\[\]][^,}\]\n]*", text))
    if not values:
        return text + rng.choice(ODD_TEXTS)
    place = rng.choice(values)
    new = rng.choice([*ODD_TEXTS, *(json.dumps(v) for v in ODD_VALUES)])
    return text[: place.start()] + new + text[place.end() :]


def _swap_lines(text: str, rng: random.Random) -> str:
    lines = text.splitlines()
    one, other = (rng.randrange(max(len(lines), 1)) for _ in range(2))
    if lines:
        lines[one] = lines[other]
    return "\n".join(lines)


def _insert(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice((*ODD_TEXTS, "{", "]", '"', "\n", "  ")) + text[at:]


def _cut(text: str, rng: random.Random) -> str:
    start = rng.randrange(len(text) + 1)
    return text[:start] + text[start + rng.choice((1, 3, 40, 10**9)) :]


def _indent(text: str, rng: random.Random) -> str:
    lines = text.splitlines()
    if lines:
        at = rng.randrange(len(lines))
        lines[at] = rng.choice(("  ", "\t", "- ")) + lines[at]
    return "\n".join(lines)


_TEXT_INJURIES = (_swap_value, _swap_value, _swap_lines, _insert, _cut, _indent)


def mutated_json(text: str, rng: random.Random) -> str:
    """JSON with an odd value in a random place, or an injured text."""
    if rng.random() < 0.3:
        return mutated_text(text, rng)
    content = json.loads(text)
    for _ in range(rng.choice((1, 1, 2))):
        if isinstance(content, dict | list) and content:
            _injure(content, rng)
    written = json.dumps(content)
    if rng.random() < 0.2:
        written = _swap_value(written, rng)
    return written


def _injure(content: Any, rng: random.Random) -> None:
    """Change one place of a nested object, or lose it, or add one."""
    while True:
        keys = list(content) if isinstance(content, dict) else list(range(len(content)))
        key = rng.choice(keys)
        inner = content[key]
        if isinstance(inner, dict | list) and inner and rng.random() < 0.8:
            content = inner
            continue
        break
    what = rng.random()
    if what < 0.7:
        content[key] = rng.choice(ODD_VALUES)
    elif what < 0.85:
        del content[key]
    elif isinstance(content, dict):
        content[rng.choice(("run_id", "seed", "SEED", "", 'a"b', "x" * 400))] = inner
    else:
        content.append(rng.choice(ODD_VALUES))


def mutated_bytes(data: bytes, rng: random.Random) -> bytes:
    """Bytes with some flipped, cut out or put in."""
    found = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8))):
        at = rng.randrange(max(len(found), 1))
        what = rng.random()
        if what < 0.6 and found:
            found[at] = rng.randrange(256)
        elif what < 0.8:
            del found[at : at + rng.choice((1, 4, 100, 10**9))]
        else:
            found[at:at] = rng.randbytes(rng.choice((1, 4, 100)))
    return bytes(found)


_ODD_CELLS = (
    "NULL",
    "'x'",
    "''",
    "'[1]'",
    "'{}'",
    "'[]'",
    '\'{"a": "b"}\'',
    "'{\"a\": 1e999}'",
    "'[\"\\ud800\"]'",
    "repeat('[', 5000)",
    "repeat('x', 100000)",
    "0",
    "-1",
    "9223372036854775807",
    "1e300",
    "'NaN'::DOUBLE",
    "'Infinity'::DOUBLE",
    "1.5",
    "true",
    "[1, 2]",
    "{'a': 1}",
    "DATE '2020-01-01'",
)


def rewrite_parquet(file: Path, rng: random.Random) -> None:
    """Write a Parquet file again with one column, or one of its cells, changed."""
    source = f"read_parquet('{file}')"
    with duckdb.connect(config={"threads": 1}) as database:
        version = database.execute(
            f"SELECT decode(value) FROM parquet_kv_metadata('{file}')"
        ).fetchone()[0]
        names = [
            row[0] for row in database.execute(f"DESCRIBE FROM {source}").fetchall()
        ]
        count = database.execute(f"SELECT count(*) FROM {source}").fetchone()[0]
        name, cell = rng.choice(names), rng.choice(_ODD_CELLS)
        row = rng.randrange(max(count, 1))
        kept = f'CASE WHEN n = {row} THEN {cell} ELSE "{name}" END'
        change = rng.choice((kept, kept, f"TRY_CAST({kept} AS VARCHAR)", cell))
        rows = rng.choice(("", "", "", "LIMIT 0", f"OFFSET {row}", "TWICE"))
        table = f"(SELECT *, row_number() OVER () - 1 AS n FROM {source})"
        if rows == "TWICE":
            table, rows = f"(FROM {table} UNION ALL FROM {table})", ""
        query = (
            f'SELECT * EXCLUDE (n) REPLACE ({change} AS "{name}") FROM {table} {rows}'
        )
        database.execute("CREATE TABLE new AS " + query)
        database.execute(
            f"COPY new TO '{file}' (FORMAT parquet, "
            f"KV_METADATA {{rearview_schema: '{version}'}})"
        )

"""Results of a sweep as JUnit XML, which GitLab, Jenkins and others show as tests."""

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from experiments.comparison.gate import ConditionVerdict
from experiments.comparison.results import (
    FAILURE,
    LABEL,
    REASON,
    RUN_ID,
    WALL,
    Row,
    axis_columns,
)
from experiments.metrics import columns
from experiments.storage.atomic_folder import write_atomically

_NOT_IN_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_xml(
    name: str, rows: Sequence[Row], verdicts: Sequence[ConditionVerdict] = ()
) -> str:
    """Write the runs of a sweep, and what was decided about them, as test cases.

    Args:
        name: Of the sweep.
        rows: Its runs.
        verdicts: Of conditions. If there are any, they alone decide what fails;
            otherwise a run fails whose ego does not arrive, and one without an episode
            is an error.

    Returns:
        The file's text: a test suite for each scenario and planner.
    """
    root = ET.Element("testsuites", name=_clean(name))
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        key = (str(row[columns.SCENARIO]), str(row[LABEL]))
        groups.setdefault(key, []).append(row)
    for key, group in sorted(groups.items()):
        suite = ET.SubElement(root, "testsuite", name=_clean(", ".join(key)))
        for row in group:
            _add_run(suite, row, decides=not verdicts)
        for verdict in verdicts:
            if (verdict.scenario, verdict.planner) == key:
                _add_verdict(suite, verdict)
        _count(suite)
    _count(root)
    ET.indent(root)
    text: str = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'


def save_junit(file: Path, text: str) -> None:
    """Write the file atomically; raises ResultsError if the disk refuses."""
    write_atomically(file, text)


def _add_run(suite: ET.Element, row: Row, *, decides: bool) -> None:
    """Add a run as a test case."""
    axes = "".join(f", {key} = {row[key]}" for key in axis_columns(list(row)))
    case = ET.SubElement(
        suite,
        "testcase",
        classname=suite.get("name", ""),
        name=_clean(f"seed {row[columns.SEED]}{axes}"),
        time=f"{row[WALL] or 0.0:.3f}",
    )
    status, reason = str(row[columns.STATUS]), _clean(str(row[REASON] or ""))
    if decides and row[FAILURE] is not None:
        ET.SubElement(case, "error", type=_clean(str(row[FAILURE])), message=reason)
    elif decides and not row[columns.ARRIVED]:
        ET.SubElement(case, "failure", type=status, message=reason)
    ET.SubElement(case, "system-out").text = f"{status}: {reason}\nrun {row[RUN_ID]}"


def _add_verdict(suite: ET.Element, verdict: ConditionVerdict) -> None:
    """Add a condition as a test case, which fails if it is met."""
    case = ET.SubElement(
        suite,
        "testcase",
        classname=suite.get("name", ""),
        name=_clean(f"not {verdict.condition}"),
        time="0",
    )
    if verdict.met:
        line = _clean(str(verdict))
        ET.SubElement(case, "failure", type="fail-if", message=line)


def _count(element: ET.Element) -> None:
    """Set the numbers of test cases, failures and errors, and their time."""
    cases = list(element.iter("testcase"))
    element.set("tests", str(len(cases)))
    element.set("failures", str(len(list(element.iter("failure")))))
    element.set("errors", str(len(list(element.iter("error")))))
    element.set("time", f"{sum(float(case.get('time', 0)) for case in cases):.3f}")


def _clean(text: str) -> str:
    """Replace characters that XML cannot hold."""
    return _NOT_IN_XML.sub("?", text)

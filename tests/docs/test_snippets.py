"""The Python in the documents runs as written."""

import pytest

from tests.docs.documents import TEXTS, blocks, run_in

WITH_PYTHON = [name for name, text in TEXTS.items() if blocks(text, "python")]
# these drive and compare whole runs
DRIVING = [f"docs/{name}.md" for name in ("api/python", "tutorials/learning")]
DRIVING += ["docs/tutorials/pandas.md"]


@pytest.mark.parametrize(
    "document",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name in DRIVING else [])
        for name in WITH_PYTHON
    ],
)
def test_python_of_a_document_runs(document, tmp_path):
    code = "\n".join(blocks(TEXTS[document], "python"))
    (tmp_path / "snippet.py").write_text(code, encoding="utf-8")
    done = run_in(tmp_path, "snippet.py")
    assert done.returncode == 0, done.stderr


def test_readme_and_tutorial_show_the_same_planner():
    readme, tutorial = TEXTS["README.md"], TEXTS["docs/tutorials/own_planner.md"]
    assert blocks(readme, "python") == blocks(tutorial, "python")

"""Links and paths in the documents lead somewhere."""

import re

import pytest

from tests.docs.documents import ROOT, TEXTS, blocks

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("document", TEXTS)
def test_links_lead_to_files(document):
    for target in LINK.findall(TEXTS[document]):
        if "://" not in target:
            found = (ROOT / document).parent / target
            assert found.exists(), f"{document}: {target}"


def test_packages_of_the_tree_exist():
    text = TEXTS["docs/concepts.md"]
    tree = next(block for block in blocks(text, "text") if "planner/  " in block)
    folder = ROOT
    for line in tree.splitlines():
        name = line.split()[0]
        folder = folder if line.startswith(" ") else ROOT / name
        path = folder / name if line.startswith(" ") else folder
        assert path.is_dir(), name


@pytest.mark.parametrize("package", ["planner", "experiments"])
def test_modules_of_the_package_tables_exist(package):
    table = re.findall(r"^\| (`[^|]*`) \|", TEXTS[f"{package}/README.md"], re.MULTILINE)
    names = [name for cell in table for name in re.findall(r"`([\w/.]+)`", cell)]
    files = [name for name in names if name.endswith((".py", "/"))]
    assert len(files) > 10
    for name in files:
        assert (ROOT / package / name).exists(), name


@pytest.mark.parametrize("package", ["planner", "experiments"])
def test_every_subpackage_is_in_its_table(package):
    for init in (ROOT / package).glob("*/__init__.py"):
        assert f"`{init.parent.name}/`" in TEXTS[f"{package}/README.md"]


@pytest.mark.parametrize("document", TEXTS)
def test_paths_named_in_prose_exist(document):
    for path in re.findall(
        r"`((?:planner|experiments|sumo_nets|tests|docs)/[\w/.]+)`", TEXTS[document]
    ):
        assert (ROOT / path).exists(), f"{document}: {path}"

"""The documents: what they name is there, and their tables are those of the kept files."""

import re
import runpy
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
# Where code that a document names by its path may be.
FOLDERS = ("patch", "atlas", "planner", "sim", "tests", "examples", "docs")


def anchors(text: str) -> set[str]:
    """Anchors of the headings, as GitHub makes them."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        words = re.sub(r"[^\w\- ]", "", re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower())
        found.add(words.strip().replace(" ", "-"))
    return found


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_link_leads_somewhere(document):
    text = document.read_text()
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        name, _, anchor = target.partition("#")
        path = (document.parent / name).resolve() if name else document
        assert path.exists(), f"{target} is not there"
        if anchor:
            assert anchor in anchors(path.read_text()), f"{target}: there is no such heading"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_path_that_is_named_is_there(document):
    """A path begins with a folder of the project and ends with a file or with a slash."""
    folders = "|".join(FOLDERS)
    named = re.findall(rf"`[^`\n]*?\b((?:{folders})/[\w./-]*)", document.read_text())
    for name in named:
        assert (ROOT / name.rstrip(".")).exists(), f"{name} is not there"


def test_every_name_in_the_architecture_is_defined():
    """Names in code type are classes, functions, constants or fields, or files and folders."""
    text = (ROOT / "docs" / "architecture.md").read_text()
    named = {word.split(": ")[-1] for word in re.findall(r"`([\w./: ]+)`", text)}
    paths = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*")]
    known = {part for path in paths for part in path.relative_to(ROOT).parts}
    code = "".join(p.read_text() for p in paths if p.suffix == ".py")
    assert len(named) > 60
    for name in named - {"python examples/guard.py", "def NAME", "class NAME", "evaluation.json"}:
        is_file = name.endswith((".py", "/")) or "/" in name
        last = name.rstrip("/").split("/")[-1] if is_file else name.split(".")[-1]
        defined = rf"^ *(def|class) {last}\b|^ *{last}\b.*[=:]"
        known_file = last in known or (ROOT / name).exists()
        assert known_file or re.search(defined, code, re.MULTILINE), name


def test_tables_are_those_of_the_kept_files():
    measurements = runpy.run_path(str(ROOT / "examples" / "measurements.py"))
    for document in (ROOT / "docs").glob("*.md"):
        text = document.read_text()
        words = f"{document.name}: run python examples/measurements.py"
        assert measurements["filled"](text) == text, words


def test_the_page_of_the_benchmark_says_what_its_file_says():
    text = (ROOT / "docs" / "benchmark.md").read_text()
    study = tomllib.loads((ROOT / "examples" / "benchmark.toml").read_text())
    task, measured = text.split("## Measured")
    bullets = dict(re.findall(r"^- \*\*(\w+)\*\*: (.*?)(?=^- |^## )", task, re.M | re.S))
    planners = study["vary"]["planner"]
    assert {*re.findall(r"`(\w+)`", bullets["Planners"])} == {*planners}
    assert {*re.findall(r"^\| `(\w+)`", measured, re.M)} == {*planners, "learned"}
    assert f"{['one', 'two', 'three'][study['seeds'] - 1]} seeds" in bullets["Tolerances"]
    assert f"{study['options']['max_touches']} touches" in bullets["Tolerances"]
    for words in study["vary"]["tolerance"]:
        assert words.removesuffix(" diagonal") in bullets["Tolerances"]


def test_pictures_of_the_method_are_drawn_by_their_script():
    drawn = runpy.run_path(str(ROOT / "examples" / "method_pictures.py"))["PICTURES"]
    named = re.findall(r"\(method/(\w+)\.svg\)", (ROOT / "docs" / "method.md").read_text())
    assert named == [one.__name__ for one in drawn]

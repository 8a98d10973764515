"""The documentation as a site: it is built without a warning, and holds every public name."""

import importlib
import json
import os
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from IPython.core.interactiveshell import InteractiveShell

from touchatlas.sim.judge.truth import EvaluateOptions
from touchatlas.sim.run import conclusion
from touchatlas.sim.run.progress import Progress

ROOT = Path(__file__).parent.parent
STOREYS = ("patch", "atlas", "planner", "sim")
PAGES = ("start", "machine", "your-data", "cookbook")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("sphinx", reason="pip install -e '.[docs]' builds the site")
    folder = tmp_path_factory.mktemp("site")
    words = ["-W", "--keep-going", "-q", "-b", "html", "-d", folder / "kept"]
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *words, ROOT / "docs", folder / "html"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


def test_every_public_name_stands_in_the_reference(site):
    held = set(re.findall(r'id="([\w.]+)"', (site / "api.html").read_text()))
    last = {name.split(".")[-1] for name in held}
    for storey in ("touchatlas", *(f"touchatlas.{name}" for name in STOREYS)):
        missing = {*importlib.import_module(storey).__all__} - last - {"__version__"}
        assert not missing, f"{storey}: {missing}"


def test_links_between_pages_lead_to_pages_and_headings(site):
    pages = {path: path.read_text() for path in site.rglob("*.html")}
    anchors = {path: {"", *re.findall(r'id="([^"]+)"', text)} for path, text in pages.items()}
    for path, text in pages.items():
        main = text.split('<div class="article-container">')[-1].split("<footer>")[0]
        for target in re.findall(r'href="([^"]+)"', main):
            if target.startswith(("http:", "https:", "mailto:")):
                continue
            name, _, anchor = target.partition("#")
            other = (path.parent / name).resolve() if name else path
            assert other.exists(), f"{path.name}: {target}"
            assert other not in anchors or anchor in anchors[other], f"{path.name}: {target}"


def test_pages_load_nothing_from_a_network(site):
    for path in site.rglob("*.html"):
        assert not re.search(r'(?:src|rel="stylesheet"[^>]*href)="https?:', path.read_text())


@pytest.mark.parametrize("page", PAGES)
def test_code_of_a_page_runs_as_it_stands(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    judged_by_few(monkeypatch)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / f"docs/{page}.md").read_text(), re.DOTALL)
    assert blocks
    names: dict = {}
    for block in blocks:
        exec(block, names)


def judged_by_few(monkeypatch) -> None:
    """Runs draw nothing, and are judged by 2,000 points each way, a twentieth of the usual."""
    few = EvaluateOptions(samples=2000)
    for name in ("truth_of", "evaluate_surface"):
        monkeypatch.setattr(conclusion, name, partial(getattr(conclusion, name), options=few))
    drawn = lambda *_: b"no picture"  # noqa: E731
    monkeypatch.setattr(conclusion, "surface_picture", drawn)
    monkeypatch.setattr(conclusion, "replay_bytes", drawn)
    monkeypatch.setattr(Progress, "png_bytes", drawn)


def test_cells_of_the_tutorial_run_in_order(tmp_path, monkeypatch):
    """As a notebook runs them, and no cell is kept with what it printed."""
    monkeypatch.chdir(tmp_path)
    judged_by_few(monkeypatch)
    cells = json.loads((ROOT / "examples" / "tutorial.ipynb").read_text())["cells"]
    shell = InteractiveShell.instance(history_manager=None)
    for cell in (cell for cell in cells if cell["cell_type"] == "code"):
        assert cell["outputs"] == [] and cell["execution_count"] is None
        code = "".join(cell["source"]).replace("max_touches=None", "max_touches=4")
        shell.run_cell(code).raise_error()

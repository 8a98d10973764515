"""The house: imports point down, the truth stays out, examples in docstrings hold, style."""

import ast
import doctest
import importlib
import os
import pkgutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
STOREYS = ("patch", "atlas", "planner", "sim")


def run(*command, cwd=ROOT, **environment):
    done = subprocess.run(
        [sys.executable, "-m", *command],
        cwd=cwd,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONWARNINGS": "default", **environment},
    )
    assert done.returncode == 0, done.stdout + done.stderr


def modules():
    """Names of all modules, those in sub-folders too."""
    for storey in STOREYS:
        package = importlib.import_module(f"touchatlas.{storey}")
        for info in pkgutil.walk_packages(package.__path__, f"touchatlas.{storey}."):
            yield info.name


def test_every_file_is_a_module_and_every_folder_is_installed():
    """What no test would import, and no wheel would hold, is found by its path."""
    files = {p for storey in STOREYS for p in (ROOT / storey).rglob("*.py")}
    names = {"touchatlas." + ".".join(p.relative_to(ROOT).with_suffix("").parts) for p in files}
    names.add("touchatlas.__init__")
    packages = {name.removesuffix(".__init__") for name in names if name.endswith(".__init__")}
    assert {name for name in names if not name.endswith(".__init__")} | packages == {
        *modules(),
        *(f"touchatlas.{storey}" for storey in STOREYS),
        "touchatlas",
    }
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert set(settings["tool"]["setuptools"]["packages"]) == packages


PUBLIC = ("touchatlas", *(f"touchatlas.{storey}" for storey in (*STOREYS, "planner.drivers")))


@pytest.mark.parametrize("name", PUBLIC)
def test_public_names_are_listed_before_they_are_loaded(name):
    """``dir`` and the completion of names ask ``__dir__``."""
    package = importlib.import_module(name)
    assert {*package.__all__, "__doc__"} <= {*dir(package)}
    for public in package.__all__:
        found = getattr(package, public)
        assert public in ("__version__", getattr(found, "__name__", ""))


def test_the_package_itself_imports_nothing_heavy():
    """Names are imported when they are first used."""
    code = "import sys, touchatlas; assert not {'numpy', 'scipy', 'k3d'} & {*sys.modules}"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", list(modules()))
def test_docstring_examples_hold(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def imports_of(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
    return found


@pytest.mark.parametrize("storey", STOREYS)
def test_imports_point_down(storey):
    above = [f"touchatlas.{s}" for s in STOREYS[STOREYS.index(storey) + 1 :]]
    for path in (ROOT / storey).rglob("*.py"):
        for name in imports_of(path):
            assert not any(name.startswith(a) for a in above), f"{path.name} imports {name}"


def test_import_linter_agrees():
    """It finds nothing where the package was installed before its folders moved: install again."""
    done = subprocess.run(
        [Path(sys.executable).parent / "lint-imports"], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_truth_never_reaches_the_planner():
    """Below sim nothing can name an object: neither imported nor taken as an argument."""
    for storey in STOREYS[:3]:
        for path in (ROOT / storey).rglob("*.py"):
            text = path.read_text()
            assert "touchatlas.sim" not in text
            assert "truth" not in text.replace("no truth", "")


def test_ruff_finds_nothing():
    run("ruff", "check", ".")
    run("ruff", "format", "--check", ".")


ROBOT_LOOP = """
from touchatlas.atlas import Atlas, Blend, Touch, extract_surface
from touchatlas.planner import Planner, ProbePlan


def explore_with(robot: Callable[[ProbePlan], Touch]) -> Blend:
    atlas = Atlas(tolerance=0.1, scale=0.1)
    planner = Planner(start=[0, 0, 90], outward=[0, 0, 1])
    while (plan := planner.ask(atlas)) is not None:
        touch = robot(plan)
        planner.tell(touch, atlas.add(touch))
    return atlas.blend(extract_surface(atlas).vertices)
"""


# What mypy asks of one module with --strict; --warn-redundant-casts is for all modules or none.
STRICT = """
[[tool.mypy.overrides]]
module = "robot_loop"
check_untyped_defs = true
disallow_any_generics = true
disallow_incomplete_defs = true
disallow_subclassing_any = true
disallow_untyped_calls = true
disallow_untyped_decorators = true
disallow_untyped_defs = true
extra_checks = true
strict_equality = true
warn_return_any = true
warn_unused_ignores = true

[[tool.mypy.overrides]]
module = ["touchatlas.patch", "touchatlas.atlas", "touchatlas.planner", "touchatlas.sim"]
implicit_reexport = false

# No module of the four folders names these: other packages import them, and they take seconds.
[[tool.mypy.overrides]]
module = [
    "gymnasium.wrappers.*",
    "gymnasium.vector.*",
    "dask.array.*",
    "dask.dataframe.*",
    "IPython.*",
    "prompt_toolkit.*",
]
follow_imports = "skip"
"""


def test_types_hold_and_a_script_of_public_names_passes_strictly(tmp_path):
    """mypy does not follow an editable install: a tree of links stands for an ordinary one. It
    reads all types once, for the packages and for the script."""
    (tmp_path / "touchatlas").mkdir()
    for storey in STOREYS:
        (tmp_path / "touchatlas" / storey).symlink_to(ROOT / storey)
    (tmp_path / "touchatlas" / "__init__.py").symlink_to(ROOT / "__init__.py")
    script = "from collections.abc import Callable\n" + ROBOT_LOOP
    (tmp_path / "robot_loop.py").write_text(script)
    (tmp_path / "mypy.toml").write_text((ROOT / "pyproject.toml").read_text() + STRICT)
    packages = [word for storey in STOREYS for word in ("-p", f"touchatlas.{storey}")]
    setting = [
        "--cache-dir",
        str(ROOT / ".mypy_cache"),
        "--config-file",
        "mypy.toml",
        "--namespace-packages",
        "--explicit-package-bases",
        "--warn-redundant-casts",
    ]
    run("mypy", *setting, *packages, "-m", "robot_loop", cwd=tmp_path, MYPYPATH=str(tmp_path))

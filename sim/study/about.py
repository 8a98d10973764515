"""What a study was made with: versions, machine and commit, so that a reader can repeat it."""

import os
import platform
import re
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("touchatlas", "numpy", "scipy", "libigl", "trimesh")


def versions() -> dict[str, str]:
    """Versions that the rows of a study depend on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "none"
    return found


def commit() -> str:
    """The commit of the code, with a + where files differ from it; empty where it is installed."""
    root = Path(__file__).resolve().parents[2]
    git = ["git", "-C", str(root)]
    if not (root / ".git").exists():
        return ""
    try:
        found = [
            subprocess.run([*git, *words], capture_output=True, text=True, check=True).stdout
            for words in (("rev-parse", "--short=12", "HEAD"), ("status", "--porcelain", "-uno"))
        ]
    except (OSError, subprocess.CalledProcessError):
        return ""
    return found[0].strip() + ("+" if found[1].strip() else "")


def machine() -> dict[str, str]:
    """The class of this machine: processor, cores, memory and system."""
    processor = platform.processor() or platform.machine()
    try:
        text = Path("/proc/cpuinfo").read_text()
        processor = re.findall(r"^model name\s*: (.*)$", text, re.MULTILINE)[0]
    except (OSError, IndexError):
        pass
    found = {"processor": processor, "cores": str(os.cpu_count() or 1)}
    if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        found["memory"] = f"{memory / 1e9:.0f} GB"
    return found | {"system": f"{platform.system()} {platform.machine()}"}


def about() -> dict:
    """All of it."""
    return {"versions": versions(), "commit": commit(), "machine": machine()}

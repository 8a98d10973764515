"""touchatlas view: the command."""

import webbrowser
from pathlib import Path

from touchatlas.sim.folder.run_folder import check_explored, going_on, read_settings


def view(run: Path, /) -> int:
    """Open the replay of a run in a browser: its surface as it was known at each touch.

    Parameters
    ----------
    run
        The folder of a run.
    """
    check_explored(run, read_settings(run))
    if not (run / "replay.html").is_file():
        raise ValueError(
            f"{run} has no replay.html: it was stopped, or made by an earlier version; "
            f"{going_on(run)}, or begin again"
        )
    show_page(run)
    return 0


def show_page(run: Path) -> None:
    """Open the replay of a run in a browser, and print where it is."""
    page = (run / "replay.html").resolve()
    if page.is_file():
        webbrowser.open(page.as_uri())
        print(f"the replay is {page}")

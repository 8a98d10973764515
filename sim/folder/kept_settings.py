"""The settings that the touches of a run were made with: what may not change when it goes on."""

from typing import Any

from touchatlas.sim.folder.option_tables import flattened, options_of
from touchatlas.sim.folder.run_folder import REGIONS_OF
from touchatlas.sim.folder.run_options import RunOptions

# Keys of run.toml, and of probe.toml, that are no options of the run.
NO_OPTIONS = ("object", "digest", "versions", "tip", "qualified", REGIONS_OF)
# What a run may be gone on with: its budget, and other versions, which are said. The path of a mesh
# may change as well, as long as its digest does not.
_FREE = ("max_touches", "max_length", "unit")


def kept_settings(settings: dict) -> dict[str, Any]:
    """The settings of a run.toml on which touches and atlas depend, by their dotted names.

    Parameters
    ----------
    settings : dict
        As ``read_settings`` gives it.

    Examples
    --------
    >>> kept_settings({"object": "cube", "max_touches": 3, "atlas": {"facets": 0.1}})
    {'object': 'cube', 'atlas.facets': 0.1}
    """
    named = _FREE if settings.get("digest") is None else (*_FREE, "object")
    return {
        name: value
        for name, value in flattened(settings).items()
        if value is not None and name not in named and not name.startswith("versions.")
    }


def check_settings(folder, settings: dict, held: dict) -> None:
    """ValueError where a run.toml holds other settings than the touches were made with.

    Parameters
    ----------
    folder : path-like
        Of the run.
    settings : dict
        Its run.toml.
    held : dict
        What the journal says; an option that it lacks is of a later version, and had its default.
    """
    defaults = {o.name: o.value for o in options_of(RunOptions()) if o.value is not None}
    held, now = defaults | held, defaults | kept_settings(settings)
    # An option that is left out has its default; noise and tolerance have none.
    other = [name for name in {**held, **now} if held.get(name) != now.get(name)]
    if not other:
        return
    file = f"{folder}/run.toml"
    raise ValueError(
        f"{file} has {_words(now, other)}, but the touches of the journal were made with "
        f"{_words(held, other)}; put that back, or begin anew with touchatlas explore "
        f"{settings['object']} --options {file} --out ANOTHER"
    )


def _words(settings: dict, names: list[str]) -> str:
    """A few settings as they stand in a file."""
    words = [f"{n} = {settings[n]!r}" if n in settings else f"no {n}" for n in names[:3]]
    more = len(names) - 3
    return ", ".join(words) + (f" and {more} more" if more > 0 else "")

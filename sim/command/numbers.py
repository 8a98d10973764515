"""Numbers as a table that explains itself, or as JSON; and what they say in plain sentences."""

import json
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.table import Table

from touchatlas.patch.words import count_of
from touchatlas.planner import StopReason
from touchatlas.sim.command.outcome import say
from touchatlas.sim.judge.judgement import (
    TEN,
    largest_errors,
    missed_features,
    other_holes,
    truth_warnings,
    verdict,
    written,
)
from touchatlas.sim.judge.mismatches import differ_as_units
from touchatlas.sim.judge.number_meanings import LENGTH, NUMBERS

All = Annotated[
    bool,
    Parameter(name="--all", negative="", help="Print every number.", show_default=False),
]
Json = Annotated[
    bool,
    Parameter(
        name="--json",
        negative="",
        help="Print numbers as JSON on standard output.",
        show_default=False,
    ),
]


def print_numbers(numbers: dict, title: str, as_json: bool, every: bool = False) -> None:
    """Print the verdict and ten numbers, or ``every`` one, with their units and meanings, and say
    what must be known of them."""
    if as_json:
        print(json.dumps(numbers, indent=2))
    else:
        _print_table(numbers, title, every)
    for sentence in sentences(numbers):
        say(sentence)


def _print_table(numbers: dict, title: str, every: bool) -> None:
    """Print whether the tolerance is met, and numbers as a table."""
    console, unit = Console(), numbers.get("unit", LENGTH)
    missed = missed_features(numbers) if verdict(numbers) is None else []
    for words in (title, *missed, verdict(numbers), ending(numbers), allowed_places(numbers)):
        if words:
            console.print(words, markup=False, highlight=False)
    table = Table()
    table.add_column("quantity", no_wrap=True)
    # Long values fold, as places do: names, units and meanings need their width.
    table.add_column("value")
    table.add_column("unit", no_wrap=True)
    table.add_column("good")
    # In so many letters the meanings fit beside the numbers.
    if wide := console.width >= 130:
        table.add_column("what")
    for name, value in numbers.items():
        if not (every or name in TEN):
            continue
        about = NUMBERS[name]
        in_unit = unit if about.unit == LENGTH else about.unit
        table.add_row(
            name, _shown(name, value, numbers), in_unit, about.good, *([about.what] if wide else [])
        )
    console.print(table)
    if not every:
        console.print("--all prints every number.")
    if not wide:
        console.print("touchatlas evaluate --help says what each number is.")


def _shown(name: str, value, numbers: dict) -> str:
    """A value as it stands in the table; what is said in sentences is counted."""
    if name == "met" and value and (largest_errors(numbers) or other_holes(numbers)):
        return f"{value}, but not everywhere"
    if name in ("doubts", "faults", "warnings"):
        return f"{len(value)}, said in words" if value else "none"
    if name.endswith("_place") and value:
        return written(value)
    if isinstance(value, list):
        return _places(value) or "none"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def sentences(numbers: dict) -> list[str]:
    """What a user must know of a run or an evaluation, in words."""
    found = truth_warnings(numbers) if "components" in numbers else []
    if missed := numbers.get("touches_without_contact"):
        found.append(f"{missed} of {count_of(numbers['touches'], 'touch')} met nothing")
    return found + [_doubt(doubt) for doubt in numbers.get("doubts", ())]


def ending(numbers: dict) -> str | None:
    """Why an exploration ended, after which time of its machine; None of a surface that was not
    explored."""
    if not {"ended", "touches"} <= {*numbers}:
        return None
    touches, seconds = numbers["touches"], numbers.get("machine_seconds")
    words = f"Ended after {count_of(touches, 'touch')}"
    if touches and seconds:
        words += f" and {seconds:,.1f} s of the machine, {seconds / touches:,.1f} s a touch"
    return f"{words}: {numbers['ended']}."


def allowed_places(numbers: dict) -> str | None:
    """Why places are open although all is known; None where none are, or it is not known."""
    places = numbers.get("open_places")
    if not places or numbers.get("ended") != StopReason.KNOWN.value:
        return None
    count = count_of(len(places), "place is", "places are")
    return (
        f"{count} open or less sure than 95%: {_places(places)}. An exploration may leave such "
        "places, because it ends when nearly all of the surface is expected within the tolerance, "
        f"here {numbers['predicted_coverage']:.1%}."
    )


def _places(places) -> str:
    """The first three of some places, and how many more there are; evaluation.json holds all."""
    first = "; ".join(f"({written(place)})" for place in places[:3])
    return first + (f" and {len(places) - 3} more" if len(places) > 3 else "")


def _doubt(doubt: dict) -> str:
    """A doubt as one sentence with its first places."""
    places = "; ".join(written(place) for place in doubt["places"][:2])
    words = doubt["words"].rstrip(".")
    return f"{words} (near {places})" if places else words


def unit_hint(size: float, true_size: float) -> str | None:
    """A sentence where two bodies differ in size as units of length do."""
    if not differ_as_units(size, true_size):
        return None
    return (
        f"the surface is {size / true_size:.4g} times as large as the truth; see whether both are "
        "in the same unit"
    )

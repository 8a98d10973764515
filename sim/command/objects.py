"""touchatlas objects: the command."""

import json
from typing import Any

from rich.console import Console
from rich.table import Table

from touchatlas.sim.command.numbers import Json
from touchatlas.sim.world.objects import make_object, object_names


def objects(*, json_: Json = False) -> int:
    """List the built-in objects."""
    found = [make_object(name) for name in object_names()]
    rows: list[dict[str, Any]] = [
        {
            "name": obj.name,
            "description": getattr(obj, "description", "of another package"),
            "extent": [round(float(x), 2) for x in obj.bounds[1] - obj.bounds[0]],
            "noise": obj.noise_std,
            "tolerance": obj.tolerance,
            "euler_characteristic": obj.euler_characteristic,
        }
        for obj in found
    ]
    if json_:
        print(json.dumps(rows, indent=2))
        return 0
    table = Table("name", "extent (mm)", "noise (mm)", "tolerance (mm)", "what")
    table.columns[0].no_wrap = True
    for row in rows:
        extent = " x ".join(f"{x:g}" for x in row["extent"])
        table.add_row(
            row["name"], extent, f"{row['noise']:g}", f"{row['tolerance']:g}", row["description"]
        )
    Console().print(table)
    return 0

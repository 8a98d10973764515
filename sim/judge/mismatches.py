"""Why numbers may not mean what they seem to: other units, other objects, other versions."""


def differ_as_units(size: float, other: float) -> bool:
    """Whether two sizes differ as they do when one is in another unit of length.

    >>> differ_as_units(25.4, 1.0), differ_as_units(2.0, 1.0)
    (True, False)
    """
    larger = max(size / other, other / size)
    # Ratios of millimetre, centimetre, inch, foot and metre, up to 3 %.
    units = (10.0, 25.4, 100.0, 304.8, 1000.0, 12.0, 39.37)
    return any(abs(larger / unit - 1.0) < 0.03 for unit in units)


def mismatches_of(settings, numbers) -> list[str]:
    """Sentences on why runs do not fit together; none where they do.

    Parameters
    ----------
    settings : list of dict
        run.toml of each run.
    numbers : list of dict
        evaluation.json of each.
    """
    found = []
    if _differ(settings, "object"):
        found.append("the runs are of different objects, so more than options makes them differ")
    elif _differ(settings, "digest"):
        found.append(f"{settings[0]['object']} was changed between the runs")
    if _differ(settings, "tolerance"):
        found.append("the tolerances differ, and coverage is what lies within them")
    sizes = [one.get("diagonal") for one in numbers]
    sizes = [size for size in sizes if isinstance(size, float) and size > 0.0]
    if sizes and differ_as_units(max(sizes), min(sizes)):
        found.append(
            f"one object is {max(sizes) / min(sizes):.4g} times as large as another; see whether "
            "both are in the same unit"
        )
    tables = [one.get("versions") for one in settings]
    versions = [table if isinstance(table, dict) else {} for table in tables]
    if names := [name for name in versions[0] if _differ(versions, name)]:
        found.append(f"the runs were made with different versions of {', '.join(names)}")
    return found


def _differ(tables, key: str) -> bool:
    return any(table.get(key) != tables[0].get(key) for table in tables)

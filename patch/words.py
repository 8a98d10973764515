"""Numbers and nouns in sentences."""


def noun_of(number: int, one: str, many: str = "") -> str:
    """The noun that stands behind a number; its plural has an s, or es, where none is given.

    >>> noun_of(1, "touch"), noun_of(2, "touch"), noun_of(0, "point")
    ('touch', 'touches', 'points')
    """
    ending = "es" if one.endswith(("ch", "s", "x")) else "s"
    return one if number == 1 else many or one + ending


def count_of(number: int, one: str, many: str = "") -> str:
    """A number and a noun.

    >>> count_of(1, "run"), count_of(3, "patch"), count_of(2, "place is", "places are")
    ('1 run', '3 patches', '2 places are')
    """
    return f"{number} {noun_of(number, one, many)}"

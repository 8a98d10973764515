"""What the tests of recordings share."""

import pytest


@pytest.fixture
def file(tmp_path):
    """A function that writes lines to a file, and returns its path."""

    def write(*lines, name="c.csv", encoding="utf-8"):
        path = tmp_path / name
        path.write_text("\n".join(lines) + "\n", encoding=encoding)
        return path

    return write

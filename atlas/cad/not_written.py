"""Reasons why the faces of a body cannot be written as such."""


class NotWritten(Exception):
    """Faces that cannot be written, in words."""


class NoName(NotWritten):
    """A face whose law has no name in STEP."""

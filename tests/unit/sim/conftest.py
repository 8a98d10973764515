"""What the tests of the sim share."""

import signal

import pytest


@pytest.fixture(autouse=True)
def interruptible():
    """Ctrl-C works as at a terminal, even where the tests were started in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)

"""Interrupts that wait for what they would break."""

import signal
import sys
import time
import weakref
from importlib.machinery import ExtensionFileLoader

import pytest
from matplotlib.transforms import Affine2D

from touchatlas.sim.run.interrupt import held_interrupt, raise_interrupt

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers here")


class Importing(ExtensionFileLoader):
    """An extension module whose import is interrupted."""

    def __init__(self):
        super().__init__("nothing", "nothing")
        self.whole = False

    def exec_module(self, module):
        module()
        time.sleep(0.05)
        self.whole = True


@pytest.fixture
def handlers():
    numbers = (signal.SIGINT, signal.SIGALRM)
    before = [signal.signal(number, raise_interrupt) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


def interrupt():
    signal.raise_signal(signal.SIGINT)


def test_an_interrupt_is_raised_at_once(handlers):
    reached = False
    with pytest.raises(KeyboardInterrupt):
        interrupt()
        reached = True
    assert not reached


class Deleted:
    """An object that is interrupted while it is deleted."""

    whole = False

    def __del__(self):
        interrupt()
        Deleted.whole = True


def test_an_interrupt_waits_until_an_object_is_deleted(handlers):
    """Python prints what is raised there, and the interrupt is lost."""
    with pytest.raises(KeyboardInterrupt):
        Deleted()
        time.sleep(10.0)
    assert Deleted.whole


class Thing:
    """What a weak reference is to."""


def dictionary():
    kept, things = weakref.WeakValueDictionary(), [Thing()]
    kept["thing"] = things[0]
    return kept, things


def set_of_things():
    things = [Thing()]
    return weakref.WeakSet(things), things


def transform():
    """A transform of matplotlib knows those that are made of it by weak references."""
    below = Affine2D()
    return below._parents, [below + Affine2D()]


@pytest.mark.parametrize("make", [dictionary, set_of_things, transform])
def test_an_interrupt_waits_for_the_callback_of_a_weak_reference(handlers, make):
    """Its frame is that of the handler: the signal comes as the callback begins."""
    kept, things = make()
    assert len(kept) == 1

    def trace(frame, event, _):
        if event == "call" and frame.f_code.co_name in ("remove", "_remove", "<lambda>"):
            sys.settrace(None)
            raise_interrupt(signal.SIGINT, frame)

    before = sys.gettrace()
    with pytest.raises(KeyboardInterrupt):
        sys.settrace(trace)
        things.clear()
        sys.settrace(before)
        time.sleep(10.0)
    assert not len(kept)


def test_an_interrupt_waits_for_the_import_of_an_extension_module(handlers):
    module = Importing()
    with pytest.raises(KeyboardInterrupt):
        module.exec_module(interrupt)
        time.sleep(10.0)
    assert module.whole


@pytest.mark.parametrize("interrupts", [1, 2])
def test_a_second_interrupt_and_the_end_of_the_grace_wait_for_it_too(handlers, interrupts):
    """The grace ends 0.02 s after the first interrupt, in the 0.05 s of the import."""
    module = Importing()
    with pytest.raises(KeyboardInterrupt), held_interrupt(grace=0.02):
        module.exec_module(lambda: [interrupt() for _ in range(interrupts)])
        time.sleep(10.0)
    assert module.whole

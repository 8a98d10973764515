"""The CAD kernel, and gmsh, which reads its files with a build of its own."""

import pytest


@pytest.fixture
def kernel():
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")


@pytest.fixture
def gmsh(kernel):
    """gmsh, started; its wheel needs libraries of X that a bare system lacks."""
    module = pytest.importorskip("gmsh", reason="needs gmsh", exc_type=(ImportError, OSError))
    module.initialize(interruptible=False)
    module.option.setNumber("General.Terminal", 0)
    yield module
    module.finalize()

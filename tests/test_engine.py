"""The choice of engine."""

import pytest
import torch

from rasp_core import engine
from rasp_core.errors import InputError

CPU, GPU = torch.device("cpu"), torch.device("cuda")


def test_the_cpu_is_compiled_unless_told_otherwise_and_other_devices_never():
    assert engine.compiled(CPU)
    assert not engine.compiled(GPU)
    with engine.use("torch"):
        assert not engine.compiled(CPU)
        with engine.use("auto"):
            assert engine.compiled(CPU)
        assert not engine.compiled(CPU)
    assert engine.compiled(CPU)


def test_an_unknown_engine_is_refused():
    with pytest.raises(InputError, match="abacus"), engine.use("abacus"):
        pass

"""The choice of engine."""

import pytest
import torch

from rasp_core.kernels import dispatch
from rasp_core.util.errors import InputError

CPU, GPU = torch.device("cpu"), torch.device("cuda")


def test_the_cpu_is_compiled_unless_told_otherwise_and_other_devices_never():
    assert dispatch.compiled(CPU)
    assert not dispatch.compiled(GPU)
    with dispatch.use("torch"):
        assert not dispatch.compiled(CPU)
        with dispatch.use("auto"):
            assert dispatch.compiled(CPU)
        assert not dispatch.compiled(CPU)
    assert dispatch.compiled(CPU)


def test_an_unknown_engine_is_refused():
    with pytest.raises(InputError, match="abacus"), dispatch.use("abacus"):
        pass

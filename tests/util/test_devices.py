"""Names of devices."""

import pytest

from rasp_core.util.devices import resolve_device
from rasp_core.util.errors import InputError


def test_devices():
    assert resolve_device("cpu").type == "cpu"
    assert resolve_device("auto").type in ("cpu", "cuda")
    for name in ("abacus", "cuda:99"):
        with pytest.raises(InputError, match=name):
            resolve_device(name)

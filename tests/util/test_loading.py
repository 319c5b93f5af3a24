"""The garbage collector rests while torch is imported, and only then."""

import gc
import subprocess
import sys

import torch  # noqa: F401 - what is loaded already here

from rasp_core.util.loading import loading


def printed(code: str) -> list[str]:
    code = "import gc; from rasp_core.util.loading import loading\n" + code
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()


def test_the_collector_rests_within_and_leaves_alone_what_was_loaded():
    code = """
n = gc.get_freeze_count()
with loading(): print(gc.isenabled())
print(gc.isenabled(), gc.get_freeze_count() > n)
"""
    assert printed(code) == ["False", "True", "True"]


def test_the_collector_is_back_after_an_import_that_failed():
    code = "try:\n with loading(): import no_such_module\nexcept ImportError: print(gc.isenabled())"
    assert printed(code) == ["True"]


def test_one_that_was_off_stays_off():
    code = """
gc.disable()
n = gc.get_freeze_count()  # some interpreters freeze a few things themselves
with loading(): pass
print(gc.isenabled(), gc.get_freeze_count() == n)
"""
    assert printed(code) == ["False", "True"]


def test_nothing_happens_where_torch_is_loaded():
    before = gc.get_freeze_count()
    with loading():
        assert gc.isenabled()
    assert gc.get_freeze_count() == before

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
    code = "with loading(): print(gc.isenabled())\nprint(gc.isenabled(), gc.get_freeze_count() > 0)"
    assert printed(code) == ["False", "True", "True"]


def test_the_collector_is_back_after_an_import_that_failed():
    code = "try:\n with loading(): import no_such_module\nexcept ImportError: print(gc.isenabled())"
    assert printed(code) == ["True"]


def test_one_that_was_off_stays_off():
    assert printed("gc.disable()\nwith loading(): pass\nprint(gc.isenabled(), gc.get_freeze_count())") == ["False", "0"]


def test_nothing_happens_where_torch_is_loaded():
    before = gc.get_freeze_count()
    with loading():
        assert gc.isenabled()
    assert gc.get_freeze_count() == before

"""Heavy imports without the garbage collector.

It looks at everything that is loaded again and again while torch is imported, and several times over at exit. For a
single object that took longer than to pack it.
"""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def loading() -> Iterator[None]:
    """Import torch and what goes with it within the block. Does nothing where torch is loaded already."""
    if "torch" in sys.modules or not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()  # modules stay to the end: they are looked at no more
        gc.enable()
        atexit.register(gc.freeze)  # what is left at the end goes with the process

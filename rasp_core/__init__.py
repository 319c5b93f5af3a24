"""rasp_core: rigid objects arranged by gradient descent on their shadows and signed distances.

    import rasp_core as rasp

The door is `load`, `box`, `pack`, `assemble`, `sculpt`, `optimize`, `panel`, `record`; each is imported when it is
first used, so that this line is quick. The paper's method is in the files beside this one: `objective` (Eq. 1),
`losses` (Eq. 2 to 5), `density` (Eq. 6), `optimizer` (the loop). Everything else is in rooms.
"""

import importlib

import lazy_loader

from .util import caches

__version__ = "0.1.0"
_door, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_OLD_PLACES = {"errors": ".util.errors", "meshes": ".geometry.loading"}  # scripts from before the rooms name these

caches.let_numba_cache()


def __getattr__(name: str):
    return importlib.import_module(_OLD_PLACES[name], __name__) if name in _OLD_PLACES else _door(name)

# The door: what `import rasp_core as rasp` offers, and where it is. Read at run time too (lazy-loader).
from .api.assemble import assemble as assemble
from .api.boxes import pack_boxes as pack_boxes
from .api.inputs import box as box
from .api.inputs import load as load
from .api.optimize import optimize as optimize
from .api.pack import pack as pack
from .api.sculpt import sculpt as sculpt
from .geometry.items import Item as Item
from .util.errors import InputError as InputError
from .visualize.panel import panel as panel
from .visualize.recording import record as record

__version__: str

"""The real pools by name, as the paper's figure of densities has them: the objects, or draws of them."""

import data_fetch
import rasp_core as rasp
from rasp_core.packing.pool import draw
from rasp_core.reproduce.pools import resized

POOLS = {
    "Kitchen": lambda: rasp.load(data_fetch.fetch_kitchen()),
    "BlockOut": lambda: draw(rasp.load(data_fetch.fetch_blockout()), 100, 0),
    "General": lambda: draw(rasp.load(data_fetch.fetch_general()), 100, 0),
    "CAD": lambda: draw(resized(rasp.load(data_fetch.fetch_cad())), 300, 0),
}

"""rasp_core: rigid bodies arranged by gradient descent on their shadows and signed distances.

Import the module that you need (`from rasp_core import arrange`); nothing heavy is imported here.
"""

__version__ = "0.1.0"

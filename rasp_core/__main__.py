"""`python -m rasp_core` is the command `rasp`."""

import sys

from .cli.main import main

if __name__ == "__main__":
    sys.exit(main())

"""`python -m cairn.cli`: as the command `cairn`."""

import sys

from . import main

sys.exit(main())

"""`python -m plycloth` is the command `plycloth`."""

import sys

from plycloth.cli import main

sys.exit(main())

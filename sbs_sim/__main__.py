"""`python -m sbs_sim NAME`: the same as `sbs-sim NAME`."""

import sys

from sbs_sim.commands.main import main

sys.exit(main())

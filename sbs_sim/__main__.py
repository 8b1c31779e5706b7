"""`python -m sbs_sim NAME`: the same as `sbs-sim NAME`."""

import sys

from sbs_sim.commands.main import main

if __name__ == "__main__":
    sys.exit(main())

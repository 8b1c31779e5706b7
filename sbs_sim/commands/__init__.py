"""Executables that need no running node: they print tables and write files. None of them imports ROS."""

import os

# The matrices are small: threads of BLAS gain nothing, and fight for the cores where commands work side by side. Read
# once, when numpy is imported, so it must be here; a user's own value counts.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

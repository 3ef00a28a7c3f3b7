"""Shared by all tests."""

import os

# Tests run in several processes; threads of theirs would only fight for the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

"""The short form of `make slow`: some inputs of each target."""

import os
import subprocess
import sys
from pathlib import Path

INPUTS = 150

SEED = os.environ.get("FUZZ_SEED", "7")
"""Of the day in `make test`, which prints it; the number with which a fault was found makes the same inputs again."""


def test_no_input_ends_in_a_traceback_or_in_a_wrong_number():
    command = [sys.executable, str(Path(__file__).parent), str(INPUTS), SEED]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
    assert done.returncode == 0, done.stdout + done.stderr
    assert "; 0 faults" in done.stdout
    counted = int(done.stdout.splitlines()[-1].split(" inputs")[0])
    assert counted >= INPUTS

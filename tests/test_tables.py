"""The numbers in the documentation are those of the committed measurements."""

import subprocess
import sys
from pathlib import Path


def test_tables_are_up_to_date(root: Path):
    command = [sys.executable, "benchmarks/tables.py", "--check"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr

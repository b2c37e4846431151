"""Some of the tests of this folder with the rules that Windows has for files; `windows_rules` says how to run all."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
CHOSEN = ("test_atomic.py", "test_disk.py", "test_journal.py")
LEFT_OUT = ("disk_fails", "killed", "what_is_written", "any_bytes", "working_folder", "large_neighbour")
SKIPPED = " and ".join(f"not {name}" for name in LEFT_OUT)


@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="who has a file open is not known here")
def test_files_by_the_rules_of_windows() -> None:
    pytest_ = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.files.windows_rules"]
    ended = subprocess.run(
        [*pytest_, "-k", SKIPPED, *(str(HERE / name) for name in CHOSEN)],
        capture_output=True,
        text=True,
        check=False,
        cwd=HERE.parents[1],
        env={name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")},
    )
    assert ended.returncode == 0, ended.stdout[-3000:]

"""A mutant meets its tests in a process of its own."""

from __future__ import annotations

import subprocess
import sys

SCRIPT = """
from tests.mutation.mutants import mutants
from tests.mutation.run import ROOT, outcome

file, tests = "vrs_cli/kinematics/transform.py", ["tests/kinematics/test_transform.py::test_{}"]
text = (ROOT / file).read_text()
identity = next(number for number, line in enumerate(text.splitlines(), 1) if line.startswith("IDENTITY ="))
mutant = next(one for one in mutants(file, text) if (one.line, one.before, one.after) == (identity, "1.0", "2.0"))
print(outcome(None, tests)[0], outcome(mutant, tests)[0])
"""


def test_a_module_that_the_command_itself_has_loaded_is_mutated_too() -> None:
    script = SCRIPT.format("identity_has_a_vertical_tool")
    assert subprocess.check_output([sys.executable, "-c", script], text=True).split() == ["survived", "killed"]

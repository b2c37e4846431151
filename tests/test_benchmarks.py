"""The benchmarks: each can be found, and the programs that they run are right."""

from __future__ import annotations

from importlib import import_module

import pytest

from benchmarks import language, program
from benchmarks.__main__ import ALL
from vrs_cli.interfaces.inspection import inspect
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.diagnostics import Severity


@pytest.mark.parametrize("name", ALL)
def test_each_is_there(name: str) -> None:
    assert callable(import_module(f"benchmarks.{name}").main)


@pytest.mark.parametrize("text", [program.PROGRAM, language.PROGRAM], ids=["program", "language"])
def test_their_programs_have_no_faults(text: str) -> None:
    assert not any(one.severity is Severity.ERROR for one in inspect(text, load_robot("puma560")))

"""The commands of docs/CONTRIBUTING.md take what is said there, and tell in a line what they do not take."""

from __future__ import annotations

import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

from tests.by_hand import command

PAGE = (Path(__file__).parents[1] / "docs" / "CONTRIBUTING.md").read_text(encoding="utf-8")
COMMANDS = [row.split() for row in re.findall(r"^\| `python -m (tests\.[^`]+)`", PAGE, re.MULTILINE)]


@pytest.mark.parametrize("row", COMMANDS, ids=lambda row: row[0])
def test_an_argument_that_is_wrong_is_told(
    row: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    module, *given = row
    at = max(k for k, text in enumerate(given) if text.isdigit())
    for wrong, why in (("some", "some is not a"), ("-1", "-1 is less than"), ("nan", "nan is")):
        monkeypatch.setitem(sys.modules, "__main__", import_module(module))
        monkeypatch.setattr(sys, "argv", [module, *given[:at], wrong])
        with pytest.raises(SystemExit, match="2"):
            command(import_module(module).main)
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith(f"usage: python -m {module} ")
        assert why in err.splitlines()[-1]


def test_robots_ways_and_files_are_looked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for module, *given, why in (
        ("tests.laws.lines", "nobody", "3", "no robot is called 'nobody'"),
        ("tests.fuzz.long", "0.02", "choose from"),
        ("tests.laws.urdf_files", "/nowhere", "there is no /nowhere"),
    ):
        monkeypatch.setitem(sys.modules, "__main__", import_module(module))
        monkeypatch.setattr(sys, "argv", [module, *given])
        with pytest.raises(SystemExit, match="2"):
            command(import_module(module).main)
        assert why in capsys.readouterr().err.splitlines()[-1]

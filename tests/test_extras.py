"""What is said of a missing package is a command that installs it."""

from __future__ import annotations

import re
import shlex
import sys
import tomllib
from pathlib import Path

import pytest

from vrs_cli import extras
from vrs_cli.extras import how_to_install

CHECKOUT = Path(__file__).parents[1]


def test_the_command_is_for_the_python_that_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/my robots/bin/python")
    assert shlex.split(how_to_install("mcap"))[0] == "/my robots/bin/python"
    assert how_to_install("mcap").endswith(" -m pip install mcap")


def test_without_pip_there_is_uv(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda _: None)
    assert shlex.split(how_to_install("mcap")) == ["uv", "pip", "install", "--python", sys.executable, "mcap"]


def test_every_package_that_a_message_names_is_one_of_the_extras() -> None:
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = {requirement for extra in project["optional-dependencies"].values() for requirement in extra}
    known = {re.split(r"[^\w-]", requirement)[0] for requirement in wanted}
    sources = [path.read_text(encoding="utf-8") for path in (CHECKOUT / "vrs_cli").rglob("*.py")]
    named = {name for text in sources for name in re.findall(r'how_to_install\("([\w-]+)"\)', text)}
    assert {"matplotlib", "mcap", "pygls"} <= named <= known

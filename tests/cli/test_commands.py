"""The table of subcommands: its literals are those of the modules that it does not load."""

from __future__ import annotations

from importlib import import_module
from keyword import iskeyword

import pytest

from vrs_cli.cli.check import FORMATS
from vrs_cli.cli.command_line import SCRIPT_WAIT_S, Parser
from vrs_cli.cli.commands import SUBCOMMANDS, TASKS
from vrs_cli.cli.examples import EXAMPLES
from vrs_cli.cli.experiment import EXPERIMENTS
from vrs_cli.cli.recorded import formats
from vrs_cli.convert.writers import TARGETS
from vrs_cli.kinematics.model import PROFILES, ArmTask
from vrs_cli.net.messages import PORT
from vrs_cli.net.mirror import WINDOW


def choices(name: str, dest: str) -> tuple[str, ...]:
    (action,) = (one for one in Parser(name, "vrs").arguments() if one.dest == dest)
    return tuple(action.choices or ())


def test_choices_are_those_of_the_modules() -> None:
    assert tuple(task.value for task in ArmTask) == TASKS
    assert choices("lab steer", "profile") == tuple(PROFILES)
    assert choices("check", "format") == tuple(FORMATS)
    assert choices("lab experiment", "what") == tuple(EXPERIMENTS)


def test_defaults_and_helps_are_those_of_the_modules() -> None:
    assert Parser("serve", "vrs").parse([]).port == PORT
    assert f"(default {WINDOW:g})" in " ".join(Parser("view", "vrs").format_help(rare=True).split())
    assert f"--replay-units {SCRIPT_WAIT_S:g} s" in " ".join(Parser("run", "vrs").format_help(rare=True).split())
    assert all(f"  {one.name:5} {one.summary}" in EXAMPLES["export"] for one in formats().values())
    assert all(name in Parser("convert", "vrs").format_help() for name in TARGETS)


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_each_subcommand_has_its_function(name: str) -> None:
    word = name.split()[-1]
    module = import_module(f"vrs_cli.cli.{SUBCOMMANDS[name].module}")
    assert callable(getattr(module, f"{word}_" if iskeyword(word) else word))


@pytest.mark.parametrize(
    ("name", "words", "found"),
    [
        ("run", ["a.v2", "b.v2"], {"files": ["a.v2", "b.v2"], "realtime": None, "json": False, "cycles": 1}),
        ("run", ["--realtime", "a.v2"], {"files": ["a.v2"], "realtime": 1.0}),
        (
            "shell",
            ["--realtime", "0.5", "--serial", "1=pty", "--serial", "2=pty"],
            {"serial": [("1", "pty"), ("2", "pty")]},
        ),
        ("where", ["t.vrst", "--at", "1", "2", "--at", "3"], {"at": [1.0, 2.0, 3.0]}),
        ("serve", ["--class", "9b", "--cell", "c.toml"], {"class_folder": "9b", "cell": [("", "c.toml")]}),
        ("grade", ["pick"], {"exercise": "pick", "files": [], "json": None}),
    ],
)
def test_forms_say_how_many_values_there_are(name: str, words: list[str], found: dict[str, object]) -> None:
    values = vars(Parser(name, "vrs").parse(words))
    assert {key: values[key] for key in found} == found

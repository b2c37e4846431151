"""The table of monitor commands."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.interfaces.monitor.people import at, last
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.interfaces.station.operands import HANDLERS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import State
from vrs_cli.values import replies


def test_every_supported_command_has_a_handler_and_no_other_has() -> None:
    supported = {name for name, word in COMMANDS.items() if word.state is State.SUPPORTED}
    assert set(HANDLERS) == supported - {"DO", "EXPLAIN"}  # these are statements of their own


def test_a_session_alone_registers_all_of_them() -> None:
    lines = (
        "import vrs_cli.interfaces.session.session",
        "from vrs_cli.interfaces.station.operands import HANDLERS",
        "print(*HANDLERS)",
    )
    alone = subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True)
    assert set(alone.stdout.split()) == set(HANDLERS)


@pytest.mark.parametrize("name", [name for name, word in COMMANDS.items() if word.state is not State.SUPPORTED])
def test_other_commands_are_refused_by_name(name: str) -> None:
    terminal = RecordingTerminal()
    with pytest.raises(Exception, match=name.replace(".", r"\.")):
        at(terminal, name)
    assert terminal.replies == []


@pytest.mark.parametrize("word", ["EXIT", "QUIT"])
def test_leaving(word: str) -> None:
    assert last(at(RecordingTerminal(), word), replies.Farewell) == replies.Farewell()

"""The shell at a robot afar shows what it shows at one that is here."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.repl.afar import Line
from vrs_cli.repl.interactive import Shell
from vrs_cli.repl.place import Afar, Local, Place

ENTER, CTRL_C, CTRL_D, TAB, SAVE, QUIT, UP = "\r", "\x03", "\x04", "\t", "\x13", "\x11", "\x1b[A"


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.chdir(tmp_path)
    return iter(())


class Soon(Afar):
    """A line on which every answer comes at once: keys that are typed ahead come to the same in every run."""

    @property
    def afar(self) -> bool:
        return False


def afar(line: Line, told: Callable[[str], None] = lambda _text: None) -> Afar:
    return Soon(line, told)


def lines(*texts: str) -> str:
    return "".join(text + ENTER for text in texts)


def shown(place: Place, keys: str, capsys: pytest.CaptureFixture[str]) -> str:
    """All that a whole session shows; it must end by itself at the last key."""
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(keys + CTRL_D)
        assert Shell(place).run() == 0
    return capsys.readouterr().out


PROGRAM = (".PROGRAM p", "FOR i = 1 TO 3", 'PROMPT "How many? ", n', "TYPE n", "END", ".END")
ASKED = {
    "a program that asks": lines(*PROGRAM, "EXECUTE p", "1", "five", "5", "6", "DISABLE INTERACTIVE"),
    "Ctrl-C at its question": lines(*PROGRAM, "EXECUTE p", "1") + CTRL_C + lines("LISTR n", "DISABLE INTERACTIVE"),
    "changes of a location": lines("POINT a", "1,2,3,4,5,6", ",,9", "", "LISTL", "DISABLE INTERACTIVE"),
    "Ctrl-C at Change?": lines("POINT a", "1,2,3,4,5,6") + CTRL_C + lines("LISTL", "DISABLE INTERACTIVE"),
    "yes or no": lines("a = 1", "ZERO", "what", "N", "LISTR", "ZERO", "Y", "LISTR"),
    "a mistake is not sent": "MOVF a" + ENTER + CTRL_C + lines("a = 1", "LISTR", "DISABLE INTERACTIVE"),
    "completion": lines("pallet = 3") + "LISTR pal" + TAB + ENTER + lines("DISABLE INTERACTIVE"),
    "the line editor": lines(*PROGRAM, "EDIT p", "T", "D 2", "x = 1", "E", "LISTP p", "DISABLE INTERACTIVE"),
    "Ctrl-C in the editor": lines(*PROGRAM, "EDIT p", "x = 1") + CTRL_C + lines("Y", "LISTP p", "DISABLE INTERACTIVE"),
    "SEE": lines("SEE q") + "movee a" + ENTER + "ready" + SAVE + QUIT + lines("LISTP q", "DISABLE INTERACTIVE"),
    "SEE that is left": lines("SEE q") + "ready" + QUIT + QUIT + lines("DIRECTORY", "DISABLE INTERACTIVE"),
    "JOG": lines("JOG") + UP + UP + "]" + UP + "q" + lines("WHERE", "DISABLE INTERACTIVE"),
    "REPLAY": lines("DRIVE 1, 10", "SAVE t", "REPLAY t") + " q" + lines("DISABLE INTERACTIVE"),
    "PLOT": lines("DRIVE 1, 10", "PLOT J1", "TIMELINE", "HELP MOVE", "DISABLE INTERACTIVE"),
    "files": lines("a = 1", "STORE all", "a = 2", "LOAD all", "STORE all", "N", "STORE all", "Y", "LISTR"),
    "branches": lines("BRANCH try", "DRIVE 1, 5", "COMPARE try, main", "BRANCH main", "DISABLE INTERACTIVE"),
}


@pytest.mark.parametrize("keys", ASKED.values(), ids=ASKED.keys())
def test_it_shows_the_same(
    keys: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = []
    for place in (Local(), afar(Line(attended=True))):
        folder = tmp_path / str(len(said))
        folder.mkdir()
        monkeypatch.chdir(folder)
        said.append(shown(place, keys, capsys))
    assert said[0] == said[1]
    assert len(said[0].splitlines()) > 1

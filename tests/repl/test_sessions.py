"""Whole sessions, as they are typed into a pipe: `sessions/*.txt`.

A line after `> ` is typed, one after `< ` is read by the PROMPT of the program that it runs, `#` begins a comment; all
others are what the shell answers.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path

import pytest

from tests.repl.afar import local_front_end, remote_front_end
from vrs_cli.interfaces.dialogue import Terminal
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.repl.loop import PlainTerminal

SESSIONS = Path(__file__).parent / "sessions"


@dataclass
class Exchange:
    """What is typed, and what is answered."""

    typed: str
    read: list[str] = field(default_factory=list)
    answers: list[str] = field(default_factory=list)


class Unread:
    """The lines that were typed ahead; more may come when they have been read."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        if not self.lines:
            raise StopIteration
        return self.lines.pop(0)


def exchanges(path: Path) -> Iterator[Exchange]:
    present: Exchange | None = None
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("# "):
            continue
        if line.startswith("> "):
            if present:
                yield present
            present = Exchange(line[2:])
        elif present is not None:
            (present.read if line.startswith("< ") else present.answers).append(line)
    if present:
        yield present


@pytest.mark.parametrize("seated", [local_front_end, remote_front_end])
@pytest.mark.parametrize("path", sorted(SESSIONS.glob("*.txt")), ids=lambda path: path.stem)
def test_session(
    path: Path, seated: Callable[[Terminal], FrontEnd], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for file in (*SESSIONS.glob("*.v2"), *SESSIONS.glob("*.pc")):
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    unread, stream = Unread(), StringIO()
    front_end = seated(PlainTerminal(stream, unread))
    for exchange in exchanges(path):
        unread.lines += [line[2:] + "\n" for line in exchange.read]
        front_end.take(exchange.typed)
        answered = stream.getvalue().splitlines()
        assert answered == exchange.answers, exchange.typed
        stream.seek(0)
        stream.truncate()

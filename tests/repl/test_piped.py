"""Lines of a pipe, and what goes on while one is waited for."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from io import StringIO
from pathlib import Path

import pytest

from tests.live import PATIENCE
from vrs_cli.devices.sockets import Sockets
from vrs_cli.engine.clock import WallClock
from vrs_cli.repl.piped import AHEAD, PipedLines, lines_of_pipe
from vrs_cli.repl.shell import Local
from vrs_cli.repl.shell import on_pipe as run

TICKS = """\
.PROGRAM main
    EXECUTE 5 ticks()
    PROMPT "name? ", $name
    TYPE "hello ", $name
.END
.PROGRAM ticks
    FOR i = 1 TO 3
        WAIT.EVENT 0, 0.5
        TYPE "tick", i
    END
.END
"""
PORT = """\
.PROGRAM port
    ATTACH (lun, 4) "TCP"
    FOPEN (lun, 16) "/LOCAL_PORT 0"
    DO
        READ (lun, handle) $line
        IF IOSTAT(lun) == 1 THEN
            WRITE (lun, handle) "heard ", $line
        END
    UNTIL FALSE
.END
"""


class Pipe:
    """Both ends of a pipe."""

    def __init__(self, left: ExitStack) -> None:
        reads, self.writes = os.pipe()
        self.source = left.enter_context(os.fdopen(reads, encoding="utf-8", errors="replace"))

    def put(self, text: str) -> None:
        os.write(self.writes, text.encode())

    def close(self) -> None:
        os.close(self.writes)


class Answering(StringIO):
    """A sink that acts when a text comes, once."""

    def __init__(self, awaited: str, act: Iterator[None]) -> None:
        super().__init__()
        self._awaited, self._act = awaited, act

    def flush(self) -> None:
        if self._awaited in self.getvalue():
            next(self._act, None)


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    with ExitStack() as left:
        yield Pipe(left)


def realtime() -> WallClock:
    return WallClock(time.monotonic, time.sleep, 20.0)


@pytest.mark.parametrize(
    ("written", "lines"),
    [
        ([b""], []),
        ([b"a\nb"], ["a\n", "b"]),
        ([b"a\r\n", b"\r\nb\rc\n"], ["a\n", "\n", "b\n", "c\n"]),
        ([b"\xc3", b"\xa4\n"], ["\u00e4\n"]),
        ([b"\xc3"], ["\ufffd"]),
        ([b"x\n" * (3 * AHEAD)], ["x\n"] * (3 * AHEAD)),
    ],
)
def test_the_lines_are_those_of_the_stream(pipe: Pipe, written: list[bytes], lines: list[str]) -> None:
    for part in written:
        os.write(pipe.writes, part)
    pipe.close()
    found = PipedLines(pipe.source)
    assert list(found) == lines
    assert list(found) == [], "the end stays the end"


def test_what_is_no_text_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"a\n\xff\n")
    with (tmp_path / "x").open(encoding="utf-8") as stream, pytest.raises(UnicodeDecodeError):
        list(PipedLines(stream))


def test_a_text_in_memory_has_no_reader() -> None:
    assert lines_of_pipe(StringIO("WHERE\n")) is None
    assert lines_of_pipe(["WHERE\n"]) is None


def test_tasks_go_on_while_a_line_is_waited_for(pipe: Pipe, tmp_path: Path) -> None:
    (tmp_path / "ticks.v2").write_text(TICKS)

    def answer() -> Iterator[None]:
        pipe.put("TYPE 42\n")
        pipe.close()
        yield

    sink = Answering("tick 3", answer())
    pipe.put("EXECUTE 5 ticks()\n")
    assert run(Local(file=str(tmp_path / "ticks.v2"), clock=realtime()), pipe.source, sink) == 0
    assert sink.getvalue().splitlines()[-4:] == ["tick 1", "tick 2", "tick 3", " 42"]


def test_a_port_answers_while_a_line_is_waited_for(pipe: Pipe, tmp_path: Path) -> None:
    (tmp_path / "port.v2").write_text(PORT)
    heard: list[bytes] = []

    def dialogue() -> Iterator[None]:
        number = int(sink.getvalue().partition("TCP port ")[2].split()[0])
        with socket.create_connection(("127.0.0.1", number), PATIENCE) as peer:
            peer.sendall(b"you\n")
            peer.setblocking(False)
            while not heard:
                try:
                    heard.append(peer.recv(100))
                except BlockingIOError:
                    yield
        pipe.close()
        yield

    sink = Answering("is open at", dialogue())
    pipe.put("EXECUTE 5 port()\n")
    place = Local(file=str(tmp_path / "port.v2"), clock=realtime(), outside=Sockets())
    run(place, pipe.source, sink)
    assert heard == [b"heard you\r\n"]


def test_other_tasks_go_on_while_a_prompt_of_a_run_is_open(tmp_path: Path) -> None:
    (tmp_path / "ticks.v2").write_text(TICKS)
    words = [sys.executable, "-m", "vrs_cli", "run", "ticks.v2", "--realtime", "20"]
    with subprocess.Popen(words, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        while "tick 3" not in process.stdout.readline():
            assert process.poll() is None
        process.stdin.write("Ada\n")
        process.stdin.close()
        assert "hello Ada" in process.stdout.read()
    assert process.returncode == 0

"""`vrs connect` to a server that is another process: what a pipe is answered, and how it ends."""

from __future__ import annotations

import io
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.docs.examples import COPIED, PEOPLE, ROOT, blocks, typed_in
from tests.examples import in_full
from vrs_cli.cli.main import run
from vrs_cli.cli.remote import once
from vrs_cli.repl.shell import Local, on_pipe

PAGES = sorted((ROOT / "docs").glob("*.md"))
FILES = ("val2", "toml", "xml")


class Sitting(NamedTuple):
    """The lines of a session on a page of the docs, with the files of that page."""

    page: str
    number: int
    files: tuple[tuple[str, str], ...]
    lines: tuple[str, ...]

    @property
    def robot(self) -> str:
        return f"{self.page.removesuffix('.md').replace('-', '.')}.{self.number}"


def sittings(page: Path) -> Iterator[Sitting]:
    """In virtual time alone: a clock on the wall is never the same."""
    found = list(blocks(page.name, page.read_text(encoding="utf-8")))
    files = tuple((one.argument, one.text) for one in found if one.language in FILES and one.argument)
    sessions: list[list[str] | None] = [[]]
    for block in found:
        if block.language == "vrs" and block.argument not in PEOPLE:
            if block.argument:
                sessions.append(None if block.argument == "realtime" else [])
            if sessions[-1] is not None:
                sessions[-1] += typed_in(block)
    told = [one for one in sessions if one]
    return (Sitting(page.name, number, files, tuple(lines)) for number, lines in enumerate(told))


EVERY = 1 if in_full() else 4  # tests/docs/test_examples.py has them all, over a line in this process
SITTINGS = [one for page in PAGES for one in sittings(page)][::EVERY]


@contextmanager
def served(folder: Path, *robots: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A process, and its address."""
    named = [word for robot in robots for word in ("--robot", f"{robot}=puma560")]
    command = [sys.executable, "-m", "vrs_cli", "serve", "--port", "0", "--folder", str(folder), *named]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, cwd=folder
    )
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline().split()[2].rstrip(",")
    finally:
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    folder = tmp_path_factory.mktemp("robots")
    with served(folder, "one", *(sitting.robot for sitting in SITTINGS)) as (_, address):
        yield folder, address


def furnished(folder: Path, sitting: Sitting) -> Path:
    folder.mkdir(exist_ok=True)
    for part in COPIED:
        shutil.copytree(ROOT / part, folder / part)
    for name, text in sitting.files:
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def connected(url: str, lines: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{line}\n" for line in lines)))
    return run(["connect", url])


@pytest.mark.parametrize("sitting", SITTINGS, ids=lambda sitting: sitting.robot)
def test_each_session_of_the_docs_is_the_same_over_a_connection(
    sitting: Sitting,
    robots: tuple[Path, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    here, (folder, address) = io.StringIO(), robots
    with chdir(furnished(tmp_path / "here", sitting)):
        status = on_pipe(Local(), (f"{line}\n" for line in sitting.lines), here)
    furnished(folder / sitting.robot, sitting)
    assert connected(f"{address}/robots/{sitting.robot}", sitting.lines, monkeypatch) == status
    said = capsys.readouterr()
    assert said.out == here.getvalue()
    assert said.err == ""


def test_ten_megabytes_that_a_program_types_all_come(tmp_path: Path) -> None:
    typed = f"TYPE i{30 * ', $s'}"
    lines = (".PROGRAM chat", f'$s = "{100 * "x"}"', "FOR i = 1 TO 3500", typed, "END", ".END", "EXECUTE chat")
    here = io.StringIO()
    on_pipe(Local(), (f"{line}\n" for line in lines), here)
    assert len(here.getvalue()) > 10_000_000
    with served(tmp_path, "one") as (_, address):
        command = [sys.executable, "-m", "vrs_cli", "connect", address]
        far = subprocess.run(
            command,
            input="".join(f"{line}\n" for line in lines),
            capture_output=True,
            check=False,
            text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            cwd=tmp_path,
        )
    assert far.stderr == ""
    assert far.stdout == here.getvalue()


def test_the_server_may_go_and_what_was_on_its_way_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("vrs_cli.repl.front_end.COMING_BACK", 0.1)
    with served(tmp_path, "one") as (process, address):

        def lines() -> Iterator[str]:
            yield "LISTR 2\n"
            process.send_signal(signal.SIGTERM)
            process.wait()
            yield "LISTR 3\n"

        monkeypatch.setattr(sys, "stdin", lines())
        monkeypatch.setattr("vrs_cli.repl.shell.on_terminal", lambda: False)
        monkeypatch.setattr("vrs_cli.cli.remote.on_terminal", lambda: False)
        assert run(["connect", address]) == 1
    said = capsys.readouterr()
    assert said.out == "2                2\n"
    assert "vrs connect: the server ends; it is tried again\n" in said.err
    assert "there is no connection" in said.err


def test_where_no_robot_answers_there_is_one_message(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert connected("ws://127.0.0.1:9", ("WHERE",), monkeypatch) == 1
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert "vrs serve" in said.err
    assert connected("http://127.0.0.1", ("WHERE",), monkeypatch) == 2
    assert "is no address of a robot" in capsys.readouterr().err


def test_what_is_told_again_and_again_is_told_once() -> None:
    told: list[str] = []
    tell = once(told.append)
    for text in ("cut", "no answer", "no answer", "connected again", "no answer"):
        tell(text)
    assert told == ["cut", "no answer", "connected again", "no answer"]

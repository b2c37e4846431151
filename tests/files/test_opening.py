"""Pipes and devices where files are wanted: nothing hangs."""

from __future__ import annotations

import os
from pathlib import Path
from threading import Thread

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import VrsError
from vrs_cli.files import opening
from vrs_cli.files.opening import open_to_read, open_to_write
from vrs_cli.interfaces.session.session import Session

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    path = tmp_path / "pipe.v2"
    os.mkfifo(path)
    return path


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opening, "PIPE_WAIT_S", 0.0)


def test_what_somebody_writes_into_a_pipe_is_read_whole(pipe: Path) -> None:
    content = b"0123456789" * 20_000
    writer = Thread(target=pipe.write_bytes, args=(content,))
    writer.start()
    with open_to_read(pipe) as stream:
        assert stream.read(3) == b"012"
        assert b"012" + stream.read() == content
    writer.join()


def test_what_is_written_into_a_pipe_is_read(pipe: Path) -> None:
    read: list[bytes] = []
    reader = Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    with open_to_write(pipe) as stream:
        stream.write(b"positions")
    reader.join()
    assert read == [b"positions"]


@pytest.mark.usefixtures("impatient")
def test_a_pipe_without_another_end_is_refused(pipe: Path) -> None:
    with pytest.raises(OSError, match="nobody writes into this pipe"):
        open_to_read(pipe)
    with pytest.raises(OSError, match="nobody reads from this pipe"):
        open_to_write(pipe)


def test_a_device_that_never_ends_is_refused() -> None:
    with pytest.raises(OSError, match="it is a device"):
        open_to_read(Path("/dev/zero"))
    with open_to_read(Path(os.devnull)) as stream:
        assert stream.read() == b""


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    "line", ["LOAD pipe.v2", "LOADP pipe.v2", "COMMANDS pipe.v2", "FLIST pipe.v2", "FCOPY x.v2 = pipe.v2"]
)
def test_no_command_hangs(pipe: Path, monkeypatch: pytest.MonkeyPatch, line: str) -> None:
    monkeypatch.chdir(pipe.parent)
    session = Session(RecordingTerminal())
    with pytest.raises(VrsError, match="nobody writes into this pipe"):
        session.perform(line)


def test_a_folder_that_cannot_be_read_suggests_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pick.v2").write_text("")
    assert opening.neighbours(tmp_path / "pikc.v2") == ["pick.v2"]
    assert opening.neighbours(tmp_path / "gone" / "x") == []

    def refused(_path: object) -> list[str]:
        raise PermissionError(13, "Permission denied")

    session = Session(RecordingTerminal())
    monkeypatch.setattr(os, "listdir", refused)
    for line in ("LOAD {}", "FDELETE {}", "COMMANDS {}", "FLIST {}"):
        with pytest.raises(VrsError, match="Nonexistent file"):
            session.perform(line.format(tmp_path / "pikc.v2"))

"""A file has one writer, by whatever name it is reached, and a dead writer is none."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from vrs_cli.errors import FileOpened
from vrs_cli.files import atomic, disk
from vrs_cli.files.atomic import check_writable, claim, hold, write_atomically

HOLDER = """
import sys
from pathlib import Path
from vrs_cli.files.atomic import hold
held = hold(Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.readline()
held.release()
"""


@contextmanager
def held_elsewhere(path: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process holds the lock of a file."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", HOLDER, path], text=True, **pipes) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        try:
            yield process
        finally:
            process.kill()


WRITERS: dict[str, Callable[[Path], object]] = {
    "write": lambda path: write_atomically(path, "new"),
    "check": check_writable,
    "copy": lambda path: disk.copy(path.with_name("other"), path),
    "rename to": lambda path: disk.rename(path.with_name("other"), path),
    "rename": lambda path: disk.rename(path, path.with_name("third")),
    "delete": disk.delete,
}


def test_every_writer_keeps_away_from_a_file_that_another_process_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(atomic, "LOCK_WAIT_S", 0.02)
    path = tmp_path / "day.vrst"
    path.write_text("old")
    (tmp_path / "other").write_text("other")
    (tmp_path / "link").symlink_to(path)
    with held_elsewhere(path) as process:
        for act in WRITERS.values():
            for name in (path, tmp_path / "link"):
                with pytest.raises(FileOpened, match=f"{name.name} is being written by another vrs") as refused:
                    act(name)
                assert atomic.WINDOWS or f"(process {process.pid})" in refused.value.detail
        assert path.read_text() == "old"
    names = ["day.vrst", "link", "other"]
    assert sorted(entry.name for entry in tmp_path.iterdir() if entry.name[0] != ".") == names


@pytest.mark.parametrize("killed", [False, True])
def test_a_lock_is_free_when_its_owner_has_ended_however_that_was(tmp_path: Path, killed: bool) -> None:
    path = tmp_path / "day.vrst"
    with held_elsewhere(path) as process:
        if killed:
            process.kill()
        else:
            assert process.stdin is not None
            process.stdin.write("\n")
            process.stdin.close()
        process.wait()
        assert list(tmp_path.iterdir()) == [tmp_path / ".day.vrst.lock"] * killed
        hold(path).release()
        assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(atomic.WINDOWS, reason="a file that is open stays")
def test_a_lock_file_that_was_removed_meanwhile_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between its opening and its locking the owner before may have removed it: a lock on it would hold nothing."""
    path, opened, before = tmp_path / "day.vrst", list[int](), atomic._open_lock

    def removed(beside: Path) -> int | None:
        opened.append(before(beside) or 0)
        if len(opened) == 1:
            beside.unlink()
        return opened[-1]

    monkeypatch.setattr(atomic, "_open_lock", removed)
    with hold(path):
        assert len(opened) == 2
        with pytest.raises(FileOpened):
            hold(path)


def test_a_disk_without_locks_lets_everybody_write_and_clears_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, left = tmp_path / "day.vrst", tmp_path / ".day.vrst.abcdefgh.part"
    left.write_text("somebody may be writing this")

    def refuse(_handle: int) -> bool:
        raise OSError(next(iter(atomic.NO_LOCKS)), "no locks here")

    monkeypatch.setattr(atomic, "_lock_handle", refuse)
    with hold(path) as first, hold(path) as second:
        assert not first.firm
        assert not second.firm
        write_atomically(path, "new")
    assert path.read_text() == "new"
    assert sorted(tmp_path.iterdir()) == [left, path]


@pytest.mark.skipif(atomic.WINDOWS, reason="a lock shuts readers out")
def test_a_file_is_claimed_whatever_its_name(tmp_path: Path) -> None:
    path, other = tmp_path / "day.vrst", tmp_path / "hard"
    path.write_text("")
    other.hardlink_to(path)
    first, second = os.open(path, os.O_RDWR), os.open(other, os.O_RDWR)
    assert claim(first)
    assert not claim(second)
    os.close(first)
    assert claim(second)
    os.close(second)

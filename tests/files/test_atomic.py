"""What writers leave behind: nothing, or what the next one clears away."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.files.faults import Fault, Faults, faulty
from vrs_cli.errors import FileError, FileOpened
from vrs_cli.files.atomic import create_beside, write_atomically

KILLED = """
import os, signal, sys
from pathlib import Path
from vrs_cli.files.atomic import create_beside
beside = create_beside(Path(sys.argv[1]))
beside.stream.write(b"half of")
beside.stream.flush()
os.kill(os.getpid(), signal.SIGKILL)
"""


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_what_a_killed_writer_left_is_cleared_by_the_next_of_that_file(tmp_path: Path) -> None:
    for name in ("a.v2", "b.v2"):
        subprocess.run([sys.executable, "-c", KILLED, tmp_path / name], check=False)
    left = [name for name in names(tmp_path) if name.startswith(".b.v2.")]
    assert (len(left), len(names(tmp_path))) == (2, 4)  # the half of it and the lock, of each
    write_atomically(tmp_path / "a.v2", "whole")
    assert names(tmp_path) == [*left, "a.v2"]
    assert (tmp_path / "a.v2").read_text() == "whole"


def test_a_file_that_is_being_written_is_nobody_elses(tmp_path: Path) -> None:
    beside = create_beside(tmp_path / "a.v2")
    beside.stream.write(b"the slow one")
    with pytest.raises(FileOpened, match="is being written by this vrs"):
        write_atomically(tmp_path / "a.v2", "the fast one")
    beside.commit()
    beside.close()
    assert names(tmp_path) == ["a.v2"]
    assert (tmp_path / "a.v2").read_text() == "the slow one"


def test_a_file_that_has_taken_its_place_can_be_added_to(tmp_path: Path) -> None:
    beside = create_beside(tmp_path / "a.v2")
    beside.stream.write(b"first\n")
    beside.commit()
    assert (tmp_path / "a.v2").read_text() == "first\n"
    beside.stream.write(b"second\n")
    beside.close()
    assert (tmp_path / "a.v2").read_text() == "first\nsecond\n"


def test_on_macos_the_cache_of_the_drive_is_emptied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl, asked = pytest.importorskip("fcntl"), list[int]()
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(fcntl, "F_FULLFSYNC", 51, raising=False)
    monkeypatch.setattr(fcntl, "fcntl", lambda _handle, request: asked.append(request))
    write_atomically(tmp_path / "a.v2", "whole")
    assert asked == [51, 51]  # the file and its folder


def test_what_others_call_nearly_so_stays(tmp_path: Path) -> None:
    kept = [".a.v2.part", ".a.v2.abcdefghi.part", ".a.v2.ABCDEFGH.part", "a.v2.abcdefgh.part", ".axv2.abcdefgh.part"]
    for name in kept:
        (tmp_path / name).write_text("somebody's")
    (tmp_path / ".a.v2.abcdefgh.part").symlink_to(tmp_path / kept[0])
    (tmp_path / ".a.v2.ijklmnop.part").mkdir()
    before = names(tmp_path)
    write_atomically(tmp_path / "a.v2", "")
    assert names(tmp_path) == sorted([*before, "a.v2"])


@pytest.mark.parametrize("lasting", [1, float("inf")])
@pytest.mark.parametrize("fault", Fault)
def test_wherever_the_disk_fails_there_is_the_old_file_or_the_new_one(
    tmp_path: Path, fault: Fault, lasting: float
) -> None:
    path, old, new = tmp_path / "a.v2", "old\n" * 5000, "new\n" * 6000
    with faulty(Faults()) as healthy:
        write_atomically(path, old)
    failed = 0
    for first in range(1, len(healthy.calls) + 1):
        with faulty(Faults(fault, first, first + lasting - 1)):
            try:
                write_atomically(path, new)
            except FileError:
                failed += 1
                assert path.read_text() in (old, new)
            else:
                assert path.read_text() == new
        write_atomically(path, old)
        assert (path.read_text(), names(tmp_path)) == (old, ["a.v2"])
    assert failed > 2

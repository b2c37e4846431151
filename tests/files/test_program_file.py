from __future__ import annotations

import os
from pathlib import Path

import pytest

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.files.atomic import atomically, check_writable, write_atomically
from vrs_cli.files.opening import Folder
from vrs_cli.files.program_file import (
    MAX_PROGRAM_BYTES,
    find_program_file,
    is_sample,
    read_program_file,
    sample_programs,
)

TEXT = '.PROGRAM p\n  TYPE "é"\n.END\n'


@pytest.mark.parametrize(
    "data",
    [
        TEXT.encode(),
        TEXT.encode("utf-8-sig"),
        TEXT.encode("latin-1"),
        TEXT.encode("utf-16"),
        TEXT.replace("\n", "\r\n").encode(),
        TEXT.replace("\n", "\r").encode(),
        TEXT.replace("\n", "\r\n").encode("latin-1") + b"\x1a",
    ],
)
def test_a_text_of_any_system_is_read(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "p.v2"
    path.write_bytes(data)
    assert read_program_file(path) == TEXT


@pytest.mark.parametrize("name", ["pick.v2", "pick.V2"])
def test_the_extension_may_be_left_out(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(TEXT)
    (tmp_path / "pick.place.v2").write_text("")
    assert read_program_file(tmp_path / "pick") == TEXT
    assert read_program_file(tmp_path / "pick.place") == ""


def test_a_file_of_exactly_that_name_comes_first(tmp_path: Path) -> None:
    (tmp_path / "pick").write_text("exact")
    (tmp_path / "pick.v2").write_text("extended")
    assert read_program_file(tmp_path / "pick") == "exact"


@pytest.mark.parametrize("name", ["hello", "hello.v2", "HELLO"])
def test_a_sample_program_is_found_by_its_name(tmp_path: Path, name: str) -> None:
    folder = Folder(tmp_path, closed=True)
    found = find_program_file(tmp_path / name, folder)
    assert is_sample(found)
    assert found in sample_programs()
    assert ".PROGRAM hello" in read_program_file(found, folder)
    (tmp_path / "hello.v2").write_text(TEXT)
    (tmp_path / "HELLO").write_text(TEXT)
    assert Path(find_program_file(tmp_path / name, folder)).parent == tmp_path


@pytest.mark.parametrize("name", ["below/hello", "../hello", "hanoi.toml", "exercises"])
def test_a_sample_program_has_no_other_names(tmp_path: Path, name: str) -> None:
    with pytest.raises(NonexistentFile):
        find_program_file(tmp_path / name, Folder(tmp_path))
    with pytest.raises(NonexistentFile):
        find_program_file(tmp_path / "hello")


def test_what_is_no_program_is_refused(tmp_path: Path) -> None:
    (tmp_path / "junk.v2").write_bytes(b"\x7fELF\x00\x01\x02")
    (tmp_path / "long.v2").write_bytes(b"")
    os.truncate(tmp_path / "long.v2", MAX_PROGRAM_BYTES + 1)
    with pytest.raises(FileDamaged, match=r"long\.v2 is longer than 64 MB"):
        read_program_file(tmp_path / "long.v2")
    with pytest.raises(FileError, match="is a folder"):
        read_program_file(tmp_path)
    with pytest.raises(NonexistentFile, match=r"did you mean .*junk\.v2\?"):
        read_program_file(tmp_path / "junks.v2")
    with pytest.raises(NonexistentFile, match="there is no folder"):
        read_program_file(tmp_path / "missing" / "junk.v2")
    with pytest.raises(NonexistentFile):
        read_program_file(tmp_path / "junk.v2" / "below")


# --- writing -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["x" * 300, "x/" * 3000, "x\0y"], ids=["name", "path", "zero"])
def test_what_no_system_can_look_up_is_refused(name: str) -> None:
    with pytest.raises(FileError):
        read_program_file(name)


def test_writing_replaces_the_file_and_keeps_its_permissions(tmp_path: Path) -> None:
    path = tmp_path / "p.v2"
    path.write_text("old")
    path.chmod(0o640)
    write_atomically(path, TEXT)
    assert path.read_text(encoding="utf-8") == TEXT
    assert path.stat().st_mode & 0o777 == 0o640
    assert os.listdir(tmp_path) == ["p.v2"]


def test_a_new_file_gets_the_permissions_that_the_user_wants(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_atomically(tmp_path / "new", "")
    finally:
        os.umask(before)
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o640


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_atomically(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


def write_half(path: Path) -> None:
    with atomically(path) as stream:
        stream.write(b"half of it")
        raise KeyboardInterrupt


def test_an_interrupted_write_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "p.v2"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt):
        write_half(path)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["p.v2"]


@pytest.mark.parametrize(
    ("place", "hint"),
    [("file/p.v2", "is a file, not a folder"), ("none/p.v2", "there is no folder"), ("folder", "name a file in it")],
)
def test_an_unwritable_place_is_told_before_and_after(tmp_path: Path, place: str, hint: str) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    with pytest.raises(FileError, match=hint):
        check_writable(tmp_path / place)
    with pytest.raises(FileError, match=hint):
        write_atomically(tmp_path / place, TEXT)


def test_checking_leaves_no_trace(tmp_path: Path) -> None:
    check_writable(tmp_path / "p.v2")
    check_writable("/dev/null")
    assert os.listdir(tmp_path) == []


def test_a_device_is_written_directly() -> None:
    write_atomically("/dev/null", TEXT)
    with pytest.raises(FileError, match="no space left"):
        write_atomically("/dev/full", TEXT)
    with pytest.raises(FileError, match="/proc/vrs"):
        write_atomically("/proc/vrs", TEXT)

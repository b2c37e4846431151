"""The files of running programs: whole or not there, in their folder, and a status for every operation."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from vrs_cli.errors import (
    EndOfInput,
    FileError,
    FileExists,
    FileNotOpened,
    FileOpened,
    FileOutside,
    NonexistentFile,
    UnitNotAttached,
)
from vrs_cli.files import disk as folder_files
from vrs_cli.files.atomic import NewFile, create_beside
from vrs_cli.files.disk import Disk, working_folder
from vrs_cli.files.opening import Folder
from vrs_cli.language.run.effects import DISKS, SUCCESS, Access

MAIN, OTHER = 0, 2
UNIT = 5


@pytest.fixture
def disk(tmp_path: Path) -> Disk:
    disk = Disk(lambda _task: Folder(tmp_path))
    disk.attach(MAIN, UNIT)
    return disk


def opened(disk: Disk, name: str, access: Access) -> int:
    disk.open(MAIN, UNIT, name, access)
    return disk.unit(MAIN, UNIT).status


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# --- whole or not there ---


@pytest.mark.parametrize("access", [Access.WRITE, Access.APPEND])
def test_nothing_is_seen_of_a_file_before_it_is_closed(disk: Disk, tmp_path: Path, access: Access) -> None:
    opened(disk, "log.txt", access)
    disk.write(MAIN, UNIT, "one\n")
    assert not (tmp_path / "log.txt").exists()
    disk.close(MAIN, UNIT)
    assert (tmp_path / "log.txt").read_text() == "one\n"
    assert names(tmp_path) == ["log.txt"]


def test_what_was_there_stays_as_it_is_until_then(disk: Disk, tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("before\n")
    opened(disk, "log.txt", Access.APPEND)
    disk.write(MAIN, UNIT, "after\n")
    assert (tmp_path / "log.txt").read_text() == "before\n"
    disk.release(MAIN)
    assert (tmp_path / "log.txt").read_text() == "before\nafter\n"


def test_a_task_that_stops_has_what_it_wrote_and_may_go_on(disk: Disk, tmp_path: Path) -> None:
    opened(disk, "log.txt", Access.WRITE)
    disk.write(MAIN, UNIT, "one\n")
    disk.rest(MAIN)
    assert (tmp_path / "log.txt").read_text() == "one\n"
    disk.write(MAIN, UNIT, "two\n")
    disk.rest(MAIN)
    assert (tmp_path / "log.txt").read_text() == "one\ntwo\n"
    disk.write(MAIN, UNIT, "three\n")
    disk.close_all()
    assert (tmp_path / "log.txt").read_text() == "one\ntwo\nthree\n"
    assert names(tmp_path) == ["log.txt"]


def test_a_reader_is_not_disturbed_by_what_comes_later(disk: Disk, tmp_path: Path) -> None:
    (tmp_path / "data.txt").write_text("1\n2\n")
    opened(disk, "data.txt", Access.READ)
    assert disk.read(MAIN, UNIT) == "1"
    (tmp_path / "data.txt").write_text("9\n9\n9\n")
    assert [disk.read(MAIN, UNIT), disk.read(MAIN, UNIT)] == ["2", None]


# --- status ---


def test_the_end_of_a_file(disk: Disk, tmp_path: Path) -> None:
    (tmp_path / "data.txt").write_bytes(b"one\r\n\nthree")
    assert opened(disk, "data.txt", Access.READ) == SUCCESS
    assert [disk.read(MAIN, UNIT) for _ in range(5)] == ["one", "", "three", None, None]
    assert disk.unit(MAIN, UNIT).status == EndOfInput.code == -504
    assert disk.unit(MAIN, UNIT).length == 0


def test_status_of_what_cannot_be_opened(disk: Disk, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "there.txt").write_text("x")
    assert opened(disk, "none.txt", Access.READ) == NonexistentFile.code
    assert opened(disk, "there.txt", Access.WRITE) == FileExists.code
    assert opened(disk, "folder", Access.READ) == FileError.code
    assert opened(disk, "folder", Access.APPEND) == FileError.code
    assert opened(disk, "no folder/a.txt", Access.WRITE) == NonexistentFile.code
    assert opened(disk, "folder/a.txt", Access.WRITE) == SUCCESS
    assert opened(disk, "b.txt", Access.WRITE) == FileOpened.code
    assert names(tmp_path) == ["folder", "there.txt"]


def test_a_file_is_either_read_or_written(disk: Disk, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("x\n")
    opened(disk, "a.txt", Access.READ)
    disk.write(MAIN, UNIT, "no")
    assert disk.unit(MAIN, UNIT).status == FileError.code
    disk.close(MAIN, UNIT)
    assert disk.unit(MAIN, UNIT).status == SUCCESS
    disk.close(MAIN, UNIT)
    assert disk.unit(MAIN, UNIT).status == FileNotOpened.code
    opened(disk, "a.txt", Access.APPEND)
    assert disk.read(MAIN, UNIT) is None
    assert disk.character(MAIN, UNIT) == FileError.code


def test_many_may_read_a_file_or_one_may_write_it(disk: Disk, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("x\n")
    disk.attach(OTHER, UNIT)
    opened(disk, "a.txt", Access.READ)
    disk.open(OTHER, UNIT, "a.txt", Access.READ)
    assert disk.unit(OTHER, UNIT).status == SUCCESS
    disk.close(OTHER, UNIT)
    disk.open(OTHER, UNIT, "a.txt", Access.APPEND)
    assert disk.unit(OTHER, UNIT).status == FileOpened.code
    disk.close(MAIN, UNIT)
    opened(disk, "a.txt", Access.APPEND)
    disk.open(OTHER, UNIT, "a.txt", Access.READ)
    assert disk.unit(OTHER, UNIT).status == FileOpened.code


def test_an_operation_that_goes_well_clears_the_status(disk: Disk) -> None:
    assert opened(disk, "none.txt", Access.READ) == NonexistentFile.code
    assert opened(disk, "new.txt", Access.WRITE) == SUCCESS


# --- units ---


def test_a_unit_has_to_be_attached(disk: Disk) -> None:
    for act in (
        lambda: disk.open(MAIN, 6, "a.txt", Access.READ),
        lambda: disk.read(MAIN, 6),
        lambda: disk.write(MAIN, 6, "x"),
        lambda: disk.close(MAIN, 6),
        lambda: disk.delete(MAIN, 6, "a.txt"),
        lambda: disk.detach(MAIN, 6),
        lambda: disk.read(OTHER, UNIT),
    ):
        with pytest.raises(UnitNotAttached):
            act()


def test_units_are_given_out_in_order(disk: Disk) -> None:
    given = []
    for _ in DISKS[1:]:
        given.append(disk.free(MAIN))
        disk.attach(MAIN, given[-1])
    assert given == [6, 7, 8, 17, 18, 19]
    with pytest.raises(UnitNotAttached):
        disk.free(MAIN)
    assert disk.free(OTHER) == UNIT
    disk.release(MAIN)
    assert disk.free(MAIN) == UNIT


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is full")
def test_nothing_is_left_of_a_file_that_the_disk_has_no_room_for(
    disk: Disk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def without_room(target: Path, within: Folder) -> NewFile:
        beside = create_beside(target, within=within)
        beside.stream.close()
        beside.stream = Path("/dev/full").open("wb")  # noqa: SIM115 (beside closes it)
        return beside

    monkeypatch.setattr("vrs_cli.files.disk.create_beside", without_room)
    opened(disk, "log.txt", Access.WRITE)
    disk.write(MAIN, UNIT, "a line")
    disk.close(MAIN, UNIT)
    assert disk.unit(MAIN, UNIT).status == FileError.code
    assert names(tmp_path) == []


# --- the folder ---


@pytest.mark.parametrize(
    "name",
    [
        *("../a", "/etc/passwd", "a/../../b", "", "  ", ".", "C:\\a", "a:b", "a\\b", "x\0y", "x\ny"),
        *("nul", "con.txt", "data/Aux.v2", "a?", "a.", ".a.txt.lock", ".a.txt.abcdefgh.part"),
    ],
)
@pytest.mark.parametrize("access", Access)
def test_names_cannot_leave_the_folder(tmp_path: Path, name: str, access: Access) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    disk = Disk(lambda _task: Folder(inside))
    disk.attach(MAIN, UNIT)
    with pytest.raises(FileOutside):
        disk.open(MAIN, UNIT, name, access)
    with pytest.raises(FileOutside):
        disk.delete(MAIN, UNIT, name)
    assert names(tmp_path) == ["inside"]


def test_links_cannot_leave_the_folder(tmp_path: Path) -> None:
    inside, secret = tmp_path / "inside", tmp_path / "secret.txt"
    inside.mkdir()
    secret.write_text("secret")
    (inside / "link.txt").symlink_to(secret)
    (inside / "up").symlink_to(tmp_path)
    (inside / "own.txt").symlink_to(inside / "real.txt")
    disk = Disk(lambda _task: Folder(inside))
    disk.attach(MAIN, UNIT)
    for name in ("link.txt", "up/secret.txt", "up/new.txt"):
        for access in Access:
            with pytest.raises(FileOutside):
                disk.open(MAIN, UNIT, name, access)
        with pytest.raises(FileOutside):
            disk.delete(MAIN, UNIT, name)
    assert opened(disk, "own.txt", Access.WRITE) == SUCCESS
    disk.release(MAIN)
    assert (inside / "real.txt").exists()
    assert secret.read_text() == "secret"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with a path")
def test_a_pipe_is_no_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    disk = Disk(lambda _task: Folder(tmp_path))
    disk.attach(MAIN, UNIT)
    assert opened(disk, "pipe", Access.READ) == FileError.code


# --- laws ---

LINES = st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\n\r\ufeff"), max_size=20), max_size=8)


@given(LINES)
def test_what_is_written_is_read(tmp_path_factory: pytest.TempPathFactory, lines: list[str]) -> None:
    folder = Folder(tmp_path_factory.mktemp("disk"))
    disk = Disk(lambda _task: folder)
    disk.attach(MAIN, UNIT)
    opened(disk, "a.txt", Access.WRITE)
    for line in lines:
        disk.write(MAIN, UNIT, f"{line}\n")
    disk.close(MAIN, UNIT)
    opened(disk, "a.txt", Access.READ)
    assert [disk.read(MAIN, UNIT) for _ in lines] == lines
    assert disk.read(MAIN, UNIT) is None


@given(st.binary(max_size=60))
def test_any_bytes_can_be_read(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    folder = tmp_path_factory.mktemp("disk")
    (folder / "a.bin").write_bytes(content)
    disk = Disk(lambda _task: Folder(folder))
    disk.attach(MAIN, UNIT)
    opened(disk, "a.bin", Access.READ)
    while disk.character(MAIN, UNIT) >= 0:
        pass
    assert disk.character(MAIN, UNIT) == EndOfInput.code


def test_folders_come_first_and_hidden_files_not_at_all(tmp_path: Path) -> None:
    (tmp_path / "b.v2").write_text("12345")
    (tmp_path / "a.V2").write_text("")
    (tmp_path / ".secret").write_text("")
    (tmp_path / "sub").mkdir()
    assert [(row.name, row.size) for row in folder_files.entries(tmp_path)] == [("sub", None), ("a.V2", 0), ("b.v2", 5)]
    assert [row.name for row in folder_files.entries(tmp_path / "*.v2")] == ["a.V2", "b.v2"]


def test_what_is_not_there_is_named_with_what_is_near(tmp_path: Path) -> None:
    (tmp_path / "cell.v2").write_text("")
    with pytest.raises(NonexistentFile, match=r"did you mean cell\.v2"):
        folder_files.check_file(tmp_path / "cel.v2")
    with pytest.raises(NonexistentFile):
        folder_files.entries(tmp_path / "nowhere" / "*.v2")
    with pytest.raises(FileError, match="folder"):
        folder_files.check_file(tmp_path)


def test_a_target_has_the_extension_of_its_source_or_its_name_in_a_folder(tmp_path: Path) -> None:
    old = tmp_path / "cell.v2"
    old.write_text("x")
    (tmp_path / "sub").mkdir()
    assert folder_files.target(old, tmp_path / "new") == tmp_path / "new.v2"
    assert folder_files.target(old, tmp_path / "new.txt") == tmp_path / "new.txt"
    assert folder_files.target(old, tmp_path / "sub") == tmp_path / "sub" / "cell.v2"
    with pytest.raises(FileError, match="one file"):
        folder_files.target(old, old)


def test_copy_rename_delete(tmp_path: Path) -> None:
    old, copy, other = tmp_path / "a.v2", tmp_path / "b.v2", tmp_path / "c.v2"
    old.write_bytes(b"\xff\r\n")
    folder_files.copy(old, copy)
    assert copy.read_bytes() == b"\xff\r\n"
    folder_files.rename(copy, other)
    assert not copy.exists()
    folder_files.delete(other)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.v2"]
    with pytest.raises(FileError, match=r"c\.v2 cannot be deleted"):
        folder_files.delete(other)


NAMES = (
    "given.txt",
    "data/given.txt",
    "data/new.txt",
    "new.txt",
    "none/new.txt",
    "link.txt",
    "linked/x.txt",
    "../x.txt",
)
UNITS = (5, 6)
ACTS = st.one_of(
    st.tuples(st.sampled_from(Access), st.sampled_from(UNITS), st.sampled_from(NAMES)),
    st.tuples(st.just("delete"), st.sampled_from(UNITS), st.sampled_from(NAMES)),
    st.tuples(st.sampled_from(("read", "write", "close")), st.sampled_from(UNITS), st.just("")),
)


def contents(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in folder.rglob("*")
        if path.is_file() and not path.is_symlink()
    }


def made(here: Path) -> Path:
    """A folder, with a file outside that links lead to."""
    folder = here / "cell"
    (folder / "data").mkdir(parents=True)
    (here / "x.txt").write_text("secret\n")
    (folder / "given.txt").write_text("given\n")
    (folder / "data" / "given.txt").write_text("deep\n")
    (folder / "link.txt").symlink_to(here / "x.txt")
    (folder / "linked").symlink_to(here)
    return folder


def done(disk: Disk, acts: list[tuple[Access | str, int, str]]) -> list[object]:
    """What each act gives, and its status."""
    given = list[object]()
    for unit in UNITS:
        disk.attach(0, unit)
    for act, unit, name in acts:
        found: object = None
        try:
            match act:
                case Access():
                    disk.open(0, unit, name, act)
                case "delete":
                    disk.delete(0, unit, name)
                case "read":
                    found = disk.read(0, unit)
                case "write":
                    disk.write(0, unit, "written\n")
                case _:
                    disk.close(0, unit)
        except FileOutside:
            found = "outside"
        given.append((found, disk.unit(0, unit).status))
    disk.release(0)
    return given


@example([(Access.APPEND, 5, "given.txt"), ("write", 5, "")])
@example([("delete", 5, "data/given.txt"), (Access.WRITE, 6, "data/given.txt"), ("write", 6, "")])
@given(st.lists(ACTS, max_size=12))
def test_a_working_folder_is_as_a_copy_without_links(acts: list[tuple[Access | str, int, str]]) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = made(Path(place))
        before, copied = contents(Path(place)), Path(place, "copy")
        shutil.copytree(folder, copied, ignore=shutil.ignore_patterns("link*"))
        expected = done(Disk(lambda _task: Folder(copied, closed=True)), acts)
        wanted = contents(copied)
        shutil.rmtree(copied)
        kept = Path(place, "kept")
        with working_folder(folder, kept) as working:
            assert done(Disk(lambda _task: working), acts) == expected
            named = {name: text for name, text in wanted.items() if (kept / name).exists()}
            assert contents(kept) == named
            assert all(before.get(f"cell/{name}") == text for name, text in wanted.items() if name not in named)
        written = contents(kept)
        shutil.rmtree(kept)
        assert contents(Path(place)) == before
        assert all(before.get(f"cell/{name}") == wanted[name] for name in wanted.keys() - written.keys())
        with working_folder(folder) as working:
            assert done(Disk(lambda _task: working), acts) == expected
        assert not working.at.exists()
        assert contents(Path(place)) == before


def test_a_large_neighbour_costs_nothing_until_it_is_named(tmp_path: Path) -> None:
    folder = made(tmp_path)
    with (folder / "large.txt").open("wb") as large:
        large.truncate(10**12)
    with working_folder(folder) as working:
        working.inside("given.txt")
        with pytest.raises(FileError, match=r"large.txt has 1000000000000 bytes"):
            working.inside("large.txt")
        assert sorted(os.listdir(working.root)) == ["given.txt"]

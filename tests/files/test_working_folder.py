"""The working folder of one run: as a copy of the folder, of which only what is named is copied."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from vrs_cli.errors import FileError, FileOutside
from vrs_cli.files.disk import Disk
from vrs_cli.files.folder import working_folder
from vrs_cli.files.opening import Folder
from vrs_cli.language.run.effects import Access

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
        expected = done(Disk(Folder(copied, closed=True)), acts)
        wanted = contents(copied)
        shutil.rmtree(copied)
        kept = Path(place, "kept")
        with working_folder(folder, kept) as working:
            assert done(Disk(working), acts) == expected
            named = {name: text for name, text in wanted.items() if (kept / name).exists()}
            assert contents(kept) == named
            assert all(before.get(f"cell/{name}") == text for name, text in wanted.items() if name not in named)
        written = contents(kept)
        shutil.rmtree(kept)
        assert contents(Path(place)) == before
        assert all(before.get(f"cell/{name}") == wanted[name] for name in wanted.keys() - written.keys())
        with working_folder(folder) as working:
            assert done(Disk(working), acts) == expected
        assert not working.root.exists()
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

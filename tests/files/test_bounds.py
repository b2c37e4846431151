"""No name leads out of a closed folder, whatever stands in it, and whatever is put there meanwhile."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import FileError, FileOutside
from vrs_cli.files import atomic
from vrs_cli.files import opening as bounds
from vrs_cli.files.atomic import atomically, write_atomically
from vrs_cli.files.disk import copy, delete, entries, rename
from vrs_cli.files.journal import keep_journal, take
from vrs_cli.files.opening import Folder
from vrs_cli.files.program_file import read_program_file
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import Shape
from vrs_cli.values.replies import FileTable

SECRET = ".PROGRAM secret\n.END\n"
pinned = pytest.mark.skipif(not bounds.PINNED, reason="the system opens files by their whole path only")


@pytest.fixture
def box(tmp_path: Path) -> Folder:
    """A closed folder with one inside, and a secret beside it."""
    (tmp_path / "secret.v2").write_text(SECRET)
    (tmp_path / "box" / "data").mkdir(parents=True)
    (tmp_path / "box" / "own.v2").write_text(".PROGRAM own\n.END\n")
    return Folder(tmp_path / "box", closed=True)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# --- names ---

OUT = ("../secret.v2", "data/../../secret.v2", "data/../own.v2", "..", "/etc/hostname", "", " ", ".", "./.")
STRANGE = ("nul", "con.v2", "data/AUX.txt", "com1", "lpt9.x", "a:b", "C:\\x", "a\\b", "a?", "x\0y", "x\ny", "a.")
LONG = ("x" * 300, "é" * 200, "x/" * 3000 + "x", "." + "x" * 300)
HIDDEN = (".own.v2.lock", "data/.a.txt.abcdefgh.part")


@pytest.mark.parametrize("name", [*OUT, *STRANGE, *LONG, *HIDDEN], ids=lambda name: repr(name[:20]))
def test_no_name_leads_out(box: Folder, name: str) -> None:
    with pytest.raises(FileError) as refused:
        box.path(name)
    assert len(str(refused.value).splitlines()[0]) < 300 or name in LONG


def test_names_inside(box: Folder) -> None:
    assert box.path("own.v2") == box.root / "own.v2"
    assert box.path("./data//new.txt") == box.root / "data" / "new.txt"
    assert box.path("~/x") == box.root / "~" / "x"
    assert box.path("data/*.txt", pattern=True) == box.root / "data" / "*.txt"
    assert Folder(box.root).path("~nobody at all/x") == box.root / "~nobody at all" / "x"
    assert Folder(box.root).path("../secret.v2") == box.root / "../secret.v2"


@pytest.mark.parametrize("name", ["x" * 300, "x/" * 3000, "x\0y"])
def test_what_no_system_can_look_up_is_refused_everywhere(name: str) -> None:
    with pytest.raises(FileError):
        Folder().path(name)


# --- words ---

WORDS = (
    "LOAD {}",
    "LOADL {}",
    "STORE {}",
    "STOREP {}",
    "SAVE {}",
    "REPLAY {}",
    "FLIST {}",
    "FDIRECTORY {}",
    "LISTF {}",
)
WORDS += ("FDELETE {}", "COMMANDS {}", "FCOPY {} = own.v2", "FCOPY copy.v2 = {}", "FRENAME {} = own.v2")
WORDS += ("FRENAME moved.v2 = {}", "CD {}", "LOG {}")


@pytest.fixture
def session(box: Folder) -> Session:
    session = Session(RecordingTerminal(), folder=box)
    for line in ("DISABLE INTERACTIVE", "a = 1", "LOAD own.v2", "READY"):
        session.perform(line)
    return session


@pytest.mark.parametrize("word", WORDS)
def test_no_word_leads_out(session: Session, box: Folder, word: str) -> None:
    there = box.root.parent / "secret.v2"
    (box.root / "link.v2").symlink_to(there)
    (box.root / "up").symlink_to(box.root.parent)
    (box.root / "dangling.v2").symlink_to(box.root.parent / "made.v2")
    before = names(box.root)
    for name in ("../secret.v2", str(there), "link.v2", "up/secret.v2", "dangling.v2", "nul.v2", "x" * 300):
        with pytest.raises(FileError) as refused:
            session.perform(word.format(name))
        assert "SECRET" not in str(refused.value)
    assert (names(box.root.parent), names(box.root)) == (["box", "secret.v2"], before)
    assert there.read_text() == SECRET


def test_every_word_with_a_file_was_tried() -> None:
    tried = {word.split()[0] for word in WORDS} | {"LOADP", "STOREL", "STORER", "STORES"}  # handled as those tried
    named = {row.name for row in COMMANDS.values() if any(one.shape is Shape.FILE for one in row.arguments)}
    assert named == tried


@pytest.mark.parametrize("word", ["LOAD link", "REPLAY link", "COMMANDS link", "STORE link", "SAVE link"])
def test_an_ending_that_is_added_leads_nowhere_else(session: Session, box: Folder, word: str) -> None:
    for ending in ("v2", "V2", "vrst"):
        (box.root / f"link.{ending}").symlink_to(box.root.parent / "secret.v2")
    with pytest.raises(FileError, match="is a link"):
        session.perform(word)
    assert (box.root.parent / "secret.v2").read_text() == SECRET


def test_words_do_inside_what_they_do_elsewhere(session: Session, box: Folder) -> None:
    for line in (
        "STORE data/all",
        "SAVE run",
        "FCOPY two.v2 = own.v2",
        "FRENAME data/two.v2 = two.v2",
        "FDELETE own.v2",
    ):
        session.perform(line)
    for line in ("LOAD data/all", "FLIST data/two.v2", "REPLAY run", "FDIRECTORY data/*.v2", "FDIRECTORY"):
        session.perform(line)
    assert (names(box.root), names(box.root / "data")) == (["data", "run.vrst"], ["all.v2", "two.v2"])
    assert isinstance(session.terminal, RecordingTerminal)
    listed, _ = (reply for reply in session.terminal.replies if isinstance(reply, FileTable))
    assert [row.name for row in listed.rows] == ["all.v2", "two.v2"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with a path")
@pytest.mark.parametrize("word", WORDS)
def test_pipes_are_no_files(session: Session, box: Folder, word: str) -> None:
    os.mkfifo(box.root / "pipe.v2")
    with pytest.raises(FileError, match="is a device or a pipe"):
        session.perform(word.format("pipe.v2"))


# --- what is put in the place of a file while it is used ---


@pinned
def test_a_link_in_the_place_of_a_file_is_not_followed(box: Folder) -> None:
    path = box.path("own.v2")
    path.unlink()
    path.symlink_to(box.root.parent / "secret.v2")
    for act in (lambda: read_program_file(path, box), lambda: copy(path, box.path("b.v2"), box)):
        with pytest.raises(FileOutside, match="is a link"):
            act()
    with pytest.raises(FileOutside, match="is a link"):
        write_atomically(path, "x", box)
    assert (box.root.parent / "secret.v2").read_text() == SECRET


@pinned
def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(box: Folder) -> None:
    path = box.path("own.v2")
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(FileOutside, match="is a device or a pipe"):
        read_program_file(path, box)


def swap(box: Folder) -> None:
    """The folder `data` becomes a link to the folder outside, where a victim has the names that are used."""
    (box.root / "data").rename(box.root / "gone")
    (box.root / "data").symlink_to(box.root.parent)


ACTS: dict[str, Callable[[Folder, Path], object]] = {
    "read": lambda box, path: read_program_file(path, box),
    "delete": lambda box, path: delete(path, box),
    "rename": lambda box, path: rename(path, box.root / "moved.v2", box),
    "rename to": lambda box, path: rename(box.root / "own.v2", path, box),
    "copy": lambda box, path: copy(path, box.root / "copy.v2", box),
    "write": lambda box, path: write_atomically(path, "x", box),
    "list": lambda box, path: entries(path.parent, box),
}


@pinned
@pytest.mark.parametrize("act", ACTS)
def test_a_folder_that_becomes_a_link_leads_nowhere(box: Folder, act: str) -> None:
    (box.root / "data" / "secret.v2").write_text("inside")
    path = box.path("data/secret.v2")
    swap(box)
    with pytest.raises(FileError):
        ACTS[act](box, path)
    assert (box.root.parent / "secret.v2").read_text() == SECRET
    assert names(box.root.parent) == ["box", "secret.v2"]


@pinned
@pytest.mark.parametrize("moment", ["create", "replace", "commit"])
def test_nor_while_a_file_is_written(box: Folder, moment: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (box.root / "data" / "secret.v2").write_text("inside")
    path = box.path("data/secret.v2")
    if moment == "create":
        before_it(monkeypatch, atomic.os, "urandom", lambda: swap(box))  # for its name
    elif moment == "replace":
        before_it(monkeypatch, atomic, "_replace", lambda: swap(box))
    during: Callable[[], None] = {"commit": lambda: swap(box)}.get(moment, lambda: None)
    with pytest.raises(FileError), atomically(path, box) as stream:  # noqa: PT012 (the folder changes meanwhile)
        during()
        stream.write(b"x")
    assert (box.root.parent / "secret.v2").read_text() == SECRET
    assert names(box.root.parent) == ["box", "secret.v2"]


def before_it(monkeypatch: pytest.MonkeyPatch, owner: object, name: str, act: Callable[[], None]) -> None:
    """Something happens just before a function is called."""
    real = getattr(owner, name)

    def late(*arguments: Any, **options: Any) -> Any:
        act()
        return real(*arguments, **options)

    monkeypatch.setattr(owner, name, late)


@pinned
def test_a_race_is_lost_by_whoever_swaps_the_folder(box: Folder) -> None:
    """Files are written and read while somebody makes the folder a link and back again, as fast as he can."""
    path, over = box.root / "data" / "secret.v2", threading.Event()
    path.write_text("inside")

    def swap_and_back() -> None:
        while not over.is_set():
            with suppress(OSError):
                swap(box)
                (box.root / "data").unlink()
                (box.root / "gone").rename(box.root / "data")

    other = threading.Thread(target=swap_and_back)
    other.start()
    try:
        for _ in range(150):
            with suppress(FileError):
                write_atomically(path, "inside", box)
            with suppress(FileError):
                assert read_program_file(path, box) == "inside"
    finally:
        over.set()
        other.join()
    assert (box.root.parent / "secret.v2").read_text() == SECRET
    assert [name for name in names(box.root.parent) if not name.endswith(".lock")] == ["box", "secret.v2"]


# --- the journal ---


@pytest.mark.parametrize("word", ["STORE {}", "SAVE {}", "FDELETE {}", "FCOPY {} = own.v2", "FRENAME {} = own.v2"])
@pytest.mark.parametrize("closed", [True, False])
def test_no_word_touches_the_journal(box: Folder, word: str, closed: bool) -> None:
    session = Session(RecordingTerminal(), folder=Folder(box.root, closed=closed))
    journal = keep_journal(take(box.root / "day.vrst"), session.engine)
    session.perform("DISABLE INTERACTIVE")
    session.perform("a = 1")
    session.perform("DRIVE 1, 10")
    before = (box.root / "day.vrst").read_bytes()
    with pytest.raises(FileError, match="being written"):
        session.perform(word.format("day.vrst"))
    assert (box.root / "day.vrst").read_bytes() == before
    journal.close()
    assert journal.sound

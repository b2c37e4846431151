"""What is answered is in the file, whatever the disk and others do to it."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from tests.files.faults import Fault, Faults, faulty
from tests.files.identity import CHANGES
from tests.files.journals import Kept
from tests.files.trajectories import appended, initial, planned, puma, without_checksums
from vrs_cli.errors import FileError, FileOpened
from vrs_cli.files import atomic
from vrs_cli.files.journal import take
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory

stays = pytest.mark.skipif(atomic.WINDOWS, reason="a file that is open stays where it is")
FIVE = planned(5)[1]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "day.vrst"


def names(path: Path) -> list[str]:
    return sorted(entry.name for entry in path.parent.iterdir())


def saved(path: Path, count: int | None = None) -> Path:
    write_trajectory(path, puma(), [initial()], planned(6)[1][:count])
    return path


# --- one after another -------------------------------------------------------------------------------------------


def test_a_journal_holds_every_change_as_soon_as_it_is_recorded(path: Path) -> None:
    kept, changes = Kept.new(path), FIVE
    assert kept.written == ()
    for count, delta in enumerate(changes, 1):
        kept.happen(delta)
        assert kept.written == changes[:count]
    kept.journal.close()
    assert path.read_bytes() == saved(path.with_name("saved.vrst"), len(changes)).read_bytes()
    assert (names(path), kept.told) == (["day.vrst", "saved.vrst"], [])


def test_several_changes_at_once(path: Path) -> None:
    kept, changes = Kept.new(path), FIVE
    kept.happen(*changes[:3])
    kept.happen(*changes[3:])
    assert kept.written == changes


def test_a_batch_journal_is_whole_when_it_is_closed(path: Path) -> None:
    kept, changes = Kept.new(path, durable=False), appended(300)
    for delta in changes:
        kept.happen(delta)
    assert 0 < len(kept.written) < len(changes)
    kept.journal.close()
    assert kept.written == changes


def test_a_journal_that_goes_on_is_the_one_that_was_never_closed(path: Path) -> None:
    changes, whole = planned(6)[1], saved(path.with_name("whole.vrst"))
    saved(path, 3)
    for size in (5, len(changes)):
        kept = Kept.on(path)
        for delta in changes[len(kept.happened) : size]:
            kept.happen(delta)
        kept.journal.close()
    assert path.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize("tail", [b"", b'{"version":4,"moti', b"\x00\x00\x00"])
def test_a_torn_tail_is_cut_off_before_a_journal_goes_on(path: Path, tail: bytes) -> None:
    whole = saved(path).read_bytes()
    path.write_bytes(b"".join(whole.splitlines(keepends=True)[:-1]) + tail)
    kept = Kept.on(path)
    kept.happen(planned(6)[1][-1])
    assert path.read_bytes() == whole


def test_a_last_line_that_lacks_only_its_end_is_kept(path: Path) -> None:
    whole = saved(path).read_bytes()
    path.write_bytes(whole[:-1])
    Kept.on(path).journal.close()
    assert path.read_bytes() == whole


def test_a_file_without_checksums_goes_on_as_it_is(path: Path) -> None:
    changes = planned(6)[1]
    assert without_checksums(saved(path, len(changes) - 1)).read_bytes().count(b'"crc"') == 0
    kept = Kept.on(path)
    kept.happen(changes[-1])
    assert b'"crc"' not in path.read_bytes()
    assert kept.written == changes


# --- one writer --------------------------------------------------------------------------------------------------


def test_a_journal_has_one_writer_by_whatever_name(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(atomic, "LOCK_WAIT_S", 0.02)
    kept = Kept.on(saved(path))
    before = path.read_bytes()
    (link := path.with_name("link.vrst")).symlink_to(path)
    (hard := path.with_name("hard.vrst")).hardlink_to(path)
    for name, way in ((path, Kept.on), (path, Kept.new), (link, Kept.on), (link, Kept.new), (hard, Kept.on)):
        if name is hard and atomic.WINDOWS:
            continue  # a lock on the file itself would shut its readers out
        with pytest.raises(FileOpened, match=f"{name.name} is being written by"):
            way(name)
    assert path.read_bytes() == before
    kept.journal.close()
    Kept.on(path).journal.close()


def test_readers_need_no_lock(path: Path) -> None:
    kept = Kept.new(path)
    kept.happen(*planned(3)[1])
    before = names(path)
    assert read_trajectory(path).deltas == tuple(kept.happened)
    assert names(path) == before


def test_an_older_file_stays_when_a_new_one_cannot_be_begun(path: Path) -> None:
    before = saved(path).read_bytes()
    with faulty(Faults(Fault.FULL, first=4)), pytest.raises(FileError, match="no space left"):
        Kept.new(path)
    assert path.read_bytes() == before


# --- a disk that fails -------------------------------------------------------------------------------------------


def run(kept: Kept, faults: Faults) -> list[int]:
    """Five changes, the third of which happens anyway; the versions of those that were refused and given again."""
    refused: list[int] = []
    for number, delta in enumerate(FIVE):
        while True:
            told, happened = len(kept.told), list(kept.happened)
            try:
                kept.happen(delta, anyway=number == 2)
            except FileError:
                refused.append(delta.version)
                assert kept.happened == happened
                if len(refused) > 20:
                    faults.last = 0  # somebody makes room
                continue
            break
        if any("all the same" in one for one in kept.told[told:]):
            continue
        on_disk = kept.journal.path.with_name("disk.vrst")
        on_disk.write_bytes(faults.synced[kept.journal.path])
        assert read_trajectory(on_disk).deltas == tuple(kept.happened), "acknowledged, and not on the disk"
    return refused


@pytest.mark.parametrize("lasting", [1, float("inf")])
@pytest.mark.parametrize("fault", Fault)
def test_nothing_that_was_acknowledged_is_lost_wherever_the_disk_fails(
    tmp_path: Path, fault: Fault, lasting: float
) -> None:
    healthy = Faults()
    path = tmp_path / "healthy" / "day.vrst"
    path.parent.mkdir()
    with faulty(healthy):
        kept = Kept.new(path)
        begun = len(healthy.calls)
        assert run(kept, healthy) == []
    refused = told = 0
    for first in range(begun + 1, len(healthy.calls) + 1):
        path = tmp_path / str(first) / "day.vrst"
        path.parent.mkdir()
        faults = Faults(fault, first, first + lasting - 1)
        with faulty(faults):
            kept = Kept.new(path)
            refused += len(run(kept, faults))
            faults.last = 0
            kept.journal.close()
        told += len(kept.told)
        assert kept.written == FIVE
    assert refused > 0
    assert told > 0


def test_a_batch_journal_on_a_full_disk_holds_what_there_is_room_for(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    room, write = saved(path.with_name("three.vrst"), 3).stat().st_size + 100, os.write
    kept = Kept.new(path, durable=False)
    kept.happen(*FIVE)

    def limited(handle: int, data: bytes) -> int:
        left = room - os.fstat(handle).st_size
        if left <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(handle, bytes(data)[:left])

    monkeypatch.setattr(os, "write", limited)
    with pytest.raises(FileError, match="no space left"):
        kept.journal.close()
    assert kept.written == FIVE[:3]
    assert not kept.journal.sound


def test_several_changes_go_to_the_disk_together(path: Path) -> None:
    with faulty(Faults()) as disk:
        kept = Kept.new(path, together=True)
        begun = disk.calls.count("fsync")
        for delta in FIVE:
            kept.happen(delta)
        assert (kept.journal.unsettled, disk.calls.count("fsync")) == (True, begun)
        kept.journal.settle()
        kept.journal.settle()
        assert (kept.journal.unsettled, disk.calls.count("fsync")) == (False, begun + 1)
    assert kept.written == FIVE


def broken_disk(broken: Sequence[bool], monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that does not keep what is written, as long as `broken` is so."""
    keep = os.fsync

    def sync(handle: int) -> None:
        if any(broken):
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        keep(handle)

    monkeypatch.setattr(os, "fsync", sync)


def test_what_a_disk_has_not_kept_is_in_a_fresh_file(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A system may have forgotten what it could not keep, whatever the file says."""
    kept, broken = Kept.new(path, together=True), [True]
    kept.happen(*FIVE[:2])
    broken_disk(broken, monkeypatch)
    with pytest.raises(FileError, match="does not keep what is written"):
        kept.journal.settle()
    with pytest.raises(FileError, match="has not kept what was written"):
        kept.happen(FIVE[2])
    kept.happen(FIVE[2], anyway=True)  # it brakes all the same
    broken.clear()
    kept.happen(*FIVE[3:])
    kept.journal.settle()
    assert kept.journal.path.name == "day-2.vrst"
    assert kept.written == FIVE
    assert [text.partition(":")[0] for text in kept.told[-1:]] == [f"*File error* {path} has not kept what was written"]


def test_what_was_recorded_and_did_not_happen_is_taken_back(path: Path) -> None:
    """Ctrl-C may come between the two."""
    kept, changes = Kept.new(path), FIVE
    kept.happen(changes[0])
    for durable in (True, False):
        kept.journal._durable = durable
        kept.journal.record([changes[1]])
        kept.journal.record([changes[1]])
    kept.journal._durable = True
    kept.happen(changes[1])
    kept.happen(changes[2])
    assert kept.written == changes[:3]


def test_ctrl_c_in_the_middle_of_a_line_leaves_the_file_whole(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept, changes, write = Kept.new(path), planned(4)[1], os.write

    def interrupted(handle: int, data: bytes) -> int:
        write(handle, bytes(data)[:50])
        raise KeyboardInterrupt

    for delta in changes:
        monkeypatch.setattr(os, "write", interrupted)
        with pytest.raises(KeyboardInterrupt):
            kept.happen(delta)
        monkeypatch.undo()
        kept.happen(delta)
    assert kept.written == changes


# --- a file that others change -----------------------------------------------------------------------------------


def changed(change: Callable[[Path], object], path: Path) -> bool:
    """False where the system does not let anybody do that to an open file."""
    try:
        change(path)
    except PermissionError:
        assert atomic.WINDOWS
        return False
    return True


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("when", ["before a change", "while it is written", "before the end"])
def test_a_file_that_others_change_is_left_loudly_and_a_fresh_one_holds_everything(
    path: Path, change: Callable[[Path], object], when: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept, changes = Kept.new(path), FIVE
    kept.happen(changes[0])
    kept.happen(changes[1])
    if when == "while it is written":
        sync, done = os.fsync, list[bool]()

        def synced(handle: int) -> None:
            sync(handle)
            monkeypatch.undo()
            done.append(changed(change, path))

        monkeypatch.setattr(os, "fsync", synced)
    elif not changed(change, path):
        return
    if when != "before the end":
        kept.happen(changes[2])
        if when == "while it is written" and not done[0]:
            return
        assert len(kept.told) == 1
        kept.happen(*changes[3:])
    kept.journal.close()
    (told,) = kept.told
    fresh = path.with_name("day-2.vrst")
    assert f"{path} " in told
    assert told.endswith(f"all of it goes on in {fresh}")
    assert read_trajectory(fresh).deltas == tuple(kept.happened)
    assert (kept.journal.path, kept.journal.sound) == (fresh, False)
    assert not [name for name in names(path) if name.endswith(".lock")]


@stays
def test_every_fresh_file_may_be_lost_too(path: Path) -> None:
    kept, changes = Kept.new(path), FIVE
    for delta in changes:
        kept.happen(delta)
        kept.journal.path.unlink()
    kept.journal.close()
    assert (names(path), len(kept.told)) == (["day-2.vrst"], len(changes))
    assert kept.written == changes


def test_the_name_of_a_fresh_file_is_free(path: Path) -> None:
    kept, changes = Kept.new(path), FIVE
    path.with_name("day-2.vrst").symlink_to("nowhere")
    path.with_name("day-3.vrst").mkdir()
    os.truncate(path, 0)
    kept.happen(changes[0])
    assert kept.journal.path.name == "day-4.vrst"


@stays
def test_where_no_file_can_be_written_nothing_happens_but_what_stops_the_robot(path: Path) -> None:
    folder = path.parent / "there"
    folder.mkdir()
    kept, changes = Kept.new(folder / "day.vrst"), planned(5)[1]
    kept.happen(changes[0])
    shutil.rmtree(folder)
    for _ in range(2):
        with pytest.raises(FileError, match=r"day.vrst is gone, and .*day-2.vrst cannot be written: no such file"):
            kept.happen(changes[1])
    kept.happen(changes[1], anyway=True)
    assert (len(kept.told), kept.happened) == (1, list(changes[:2]))
    with pytest.raises(FileError):
        kept.happen(changes[2])
    folder.mkdir()
    kept.happen(changes[2])
    assert (kept.written, kept.journal.path.name) == (changes[:3], "day-2.vrst")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can become somebody else")
def test_a_file_that_can_no_longer_be_read_is_left(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may read every file: this asks as another user would be answered."""
    kept, changes, access = Kept.new(path), planned(5)[1], os.access
    monkeypatch.setattr(os, "access", lambda name, mode: bool(Path(name).stat().st_mode & 0o400) and access(name, mode))
    kept.happen(changes[0])
    path.chmod(0)
    kept.happen(changes[1])
    (told,) = kept.told
    assert "can no longer be read and written" in told
    assert kept.written == changes[:2]


def test_a_place_that_cannot_be_taken_leaves_no_lock(path: Path) -> None:
    with pytest.raises(FileError, match="no such file or directory"):
        take(path / "missing" / "day.vrst")
    path.write_bytes(b"x")
    with pytest.raises(FileError, match="no whole first line"):
        Kept.on(path)
    assert names(path) == ["day.vrst"]

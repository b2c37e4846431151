"""Races for one journal, with real processes: each is run in an empty folder, and nothing acknowledged may be lost."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from tests.files.contest import Vrs
from tests.files.trajectories import initial, puma
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory

DAY = "day.vrst"
BUSY = "is being written by another vrs"
PROGRAM = """.PROGRAM wave()
    FOR i = 1 TO 200
        DRIVE 6, 1
        DRIVE 6, -1
    END
.END
"""
WRITER = """.PROGRAM meddle()
    ATTACH (lun, 4) "DISK"
    FOPENA (lun) "day.vrst"
    TYPE "append ", IOSTAT(lun)
    FOPENA (lun) "link.vrst"
    TYPE "by a link ", IOSTAT(lun)
    FDELETE (lun) "day.vrst"
    TYPE "delete ", IOSTAT(lun)
.END
"""
OPENED = "-506"  # File already opened


def saved(folder: Path) -> Path:
    """A short trajectory under the name that everybody wants."""
    write_trajectory(folder / DAY, puma(), [initial(puma().poses["ready"])], ())
    return folder / DAY


def together(folder: Path, *names: str, first: Callable[[Path], object] = lambda _folder: None) -> Sequence[Vrs]:
    """Shells that want to record in files of these names, all at once, and work until the last of them leaves."""
    first(folder)
    with ExitStack() as stack:
        shells = [stack.enter_context(Vrs(number, folder, "--save", name)) for number, name in enumerate(names, 1)]
        for shell in shells:
            shell.go()
        for _ in range(3):
            for shell in shells:
                shell.drive()
        for shell in shells:
            shell.leave()
    assert sum(1 for shell in shells if shell.acknowledged) == 1, "one has it, the others are told"
    assert sum(BUSY in line for shell in shells for line in shell.said) == len(shells) - 1
    return shells


def _link(folder: Path) -> None:
    saved(folder)
    (folder / "link.vrst").symlink_to(DAY)


def _hard_link(folder: Path) -> None:
    os.link(saved(folder), folder / "hard.vrst")


def one_leaves_and_one_begins(folder: Path) -> Sequence[Vrs]:
    """The other reads what the first has written, or is told."""
    with Vrs(1, folder, "--save", DAY) as one, Vrs(2, folder, "--save", DAY) as other:
        one.go()
        one.drive(3)
        other.go()
        one.leave()
        other.drive(3)
        other.leave()
    return one, other


def the_reader_and_the_writer(folder: Path) -> Sequence[Vrs]:
    """The other has begun before the first writes and leaves: what it goes on with is what it has read since."""
    saved(folder)
    with Vrs(1, folder, "--save", DAY) as one, Vrs(2, folder, "--save", DAY) as other:
        other.go()
        one.go()
        one.drive(2)
        one.leave()
        other.drive(2)
        other.leave()
    return one, other


def the_lock_of_a_dead_one(folder: Path) -> Sequence[Vrs]:
    with Vrs(1, folder, "--save", DAY) as dead:
        dead.go()
        dead.drive(3)
        dead.kill()
    heirs = together(folder, DAY, DAY)
    return dead, *heirs


def a_run(folder: Path, *, first: bool) -> Sequence[Vrs]:
    """vrs run --save replaces what is there, but not what somebody is writing."""
    (folder / "wave.v2").write_text(PROGRAM)
    with Vrs(1, folder, "--save", DAY) as shell, Vrs(2, folder, "run", "wave.v2", "--save", DAY) as run:
        for one in (run, shell) if first else (shell, run):
            one.go()
        shell.drive(3)
        status = run.leave()
        shell.drive(3)
        shell.leave()
    assert (status == 0) == ("Program completed" in run.said)
    assert shell.acknowledged or status == 0
    return (shell,)


def two_runs(folder: Path) -> Sequence[Vrs]:
    (folder / "wave.v2").write_text(PROGRAM)
    with ExitStack() as stack:
        runs = [stack.enter_context(Vrs(one, folder, "run", "wave.v2", "--save", DAY)) for one in (1, 2)]
        for run in runs:
            run.go()
        done = [run.leave() == 0 for run in runs]
    assert any(done)
    assert len(read_trajectory(folder / DAY).deltas) == 400
    return ()


def meddled(folder: Path, *lines: str, told: str = BUSY, times: int = 2) -> Sequence[Vrs]:
    """Another session does something to the file that the first one writes, and is told so many times."""
    (folder / "meddle.v2").write_text(WRITER)
    (folder / "other.vrst").write_text("of no use")
    with Vrs(1, folder, "--save", DAY) as one, Vrs(2, folder, "shell") as other:
        one.go()
        one.drive()
        (folder / "link.vrst").symlink_to(DAY)
        other.go()
        other.answered("DISABLE INTERACTIVE")
        for line in lines:
            other.answered(line)
            one.drive()
        other.leave()
        one.leave()
    assert sum(told in said for said in other.said) == times, other.said
    assert one.journal == folder / DAY
    return (one,)


RACES: dict[str, Callable[[Path], Sequence[Vrs]]] = {
    "two begin one file": lambda folder: together(folder, DAY, DAY),
    "three begin one file": lambda folder: together(folder, DAY, DAY, DAY),
    "two go on with one file": lambda folder: together(folder, DAY, DAY, first=saved),
    "by a link and by name": lambda folder: together(folder, "link.vrst", DAY, first=_link),
    "by a hard link and by name": lambda folder: together(folder, "hard.vrst", DAY, first=_hard_link),
    "one leaves and one begins": one_leaves_and_one_begins,
    "the reader and the writer": the_reader_and_the_writer,
    "two for the lock of a dead one": the_lock_of_a_dead_one,
    "a run while a shell records": lambda folder: a_run(folder, first=False),
    "a shell while a run records": lambda folder: a_run(folder, first=True),
    "two runs": two_runs,
    "SAVE of another session": lambda folder: meddled(folder, "SAVE day", "SAVE link.vrst"),
    "STORE of another session": lambda folder: meddled(folder, "SET a = NULL", "STORE day.vrst", times=1),
    "FDELETE and FRENAME of it": lambda folder: meddled(folder, "FDELETE day.vrst", "FRENAME gone.vrst = day.vrst"),
    "FCOPY and FRENAME to it": lambda folder: meddled(
        folder, "FCOPY day.vrst = other.vrst", "FRENAME day.vrst = other.vrst"
    ),
    "a program of another session": lambda folder: meddled(
        folder, "LOAD meddle", "EXECUTE meddle", told=f" {OPENED}", times=3
    ),
}

"""A journal of given changes, as an engine would keep it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tests.files.trajectories import initial, puma
from vrs_cli.files.journal import Course, Journal, Taken, take, take_up
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.trajectory.timeline import TimelineDelta


class Kept:
    """`happened`: the changes so far; `told`: what a user was told meanwhile."""

    def __init__(self, it: Taken, *, durable: bool = True, together: bool = False) -> None:
        recording = it.recording
        self.happened: list[TimelineDelta] = [] if recording is None else list(recording.deltas)
        self.told: list[str] = []
        try:
            self.journal = Journal(it, self._course, self.told.append, durable=durable, together=together)
        except BaseException:
            it.close()
            raise

    @classmethod
    def new(cls, path: Path, *, durable: bool = True, together: bool = False) -> Kept:
        return cls(take(path), durable=durable, together=together)

    @classmethod
    def on(cls, path: Path) -> Kept:
        return cls(take_up(path))

    def _course(self) -> Course:
        return Course(puma(), [initial()], self.happened, MeasuredRecord(6).view)

    def happen(self, *deltas: TimelineDelta, anyway: bool = False) -> None:
        """Written down, then done. Raises FileError, and nothing is done."""
        self.journal.record(deltas, happens=anyway)
        self.happened += deltas

    @property
    def written(self) -> Sequence[TimelineDelta]:
        """What somebody reads in the file now."""
        return read_trajectory(self.journal.path).deltas

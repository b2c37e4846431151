"""How much of a book leaves memory at once."""

from __future__ import annotations

from collections.abc import Sequence

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.window import ROW, MemoryWindow, WindowSize
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.row import Row
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import Move
from vrs_cli.values.motion import JointTarget


class Store:
    """Keeps rows, and counts what it keeps after each change."""

    def __init__(self) -> None:
        self.segments, self.checkpoints = [0], 0

    def keep_row(self, row: Row) -> Store:
        self.segments[-1] += len(row)
        return self

    def keep_checkpoint(self, timeline: Timeline, commands: int, number: int) -> bool:
        assert all(part.row.kept is not None for _, part in timeline.parts())
        assert commands == number == timeline.version
        self.checkpoints += 1
        return True

    def read(self) -> Row:
        raise AssertionError("nobody looks at old times")

    def read_deltas(self, first: int, last: int) -> Sequence[TimelineDelta]:
        raise AssertionError(f"nobody asks for changes {first} to {last}")


def test_little_leaves_memory_after_one_change_and_as_much_as_comes() -> None:
    engine, store = Engine(load_robot("puma560")), Store()
    engine.book.keep_short(MemoryWindow(store, WindowSize(changes=200, segments=300, checkpoint=400)))
    goals = [JointTarget((angle, *engine.position().joints[1:])) for angle in (0.3, -0.3)]
    for number in range(900):  # each cuts the one before it off where that slows down
        engine.perform(Move(goals[number % 2], False), program=True)
        store.segments.append(0)
    assert max(store.segments) <= 2 * ROW + 10
    in_memory = sum(len(part.row) for _, part in engine.timeline.parts() if not part.row.away)
    assert in_memory <= 300 + 2 * ROW
    assert len(engine.timeline) > 1500
    assert (store.checkpoints, len(engine.book.history.done)) == (2, 200)

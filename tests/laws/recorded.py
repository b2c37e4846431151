"""Sessions as they were recorded: `python -m tests.laws.recorded` plays them and writes them down anew.

Each line of `recorded_sessions.txt` has what one random command of `tests.laws.sessions` made: the number of segments
and the end of the timeline [s], then the joints [rad, m] at three instants of the changed part; or the words of a
refusal, or of WHY. Who changes a motion law or a constant of the planner on purpose records anew, and reads the
difference.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tests.by_hand import command
from tests.laws.sessions import Session
from tests.recording import numbers, write_record
from vrs_cli.engine.breaches import breaches
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import IllegalValue, MotionError, UsageError
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, position
from vrs_cli.values.commands import JointTarget, PoseTarget

RECORDED = Path(__file__).with_name("recorded_sessions.txt")
URDF = Path(__file__).parent.parent / "kinematics" / "urdf"
CLOSED = ("cobra600", "irb120", "planar3", "puma260", "puma560", "ur5e", "xarm6")
SEARCHED = ("crooked.urdf", "gantry.urdf", "panda", "so100")
SESSIONS = tuple((robot, seed) for robot in (*CLOSED, *SEARCHED) for seed in range(4 if robot in CLOSED else 2))
COMMANDS, FEW = 16, 6
INSTANTS = (0.2, 0.5, 0.9)  # parts of the changed stretch


class Unchecked(Session):
    """A session that checks no law, which takes most of the time."""

    def _check(self, *_: object) -> None:
        """The record has what it made."""


def lines(robot: str, seed: int) -> Iterator[str]:
    """What became of each command of a session."""
    session = Unchecked(seed, load_robot(URDF / robot if robot.endswith(".urdf") else robot))
    engine = session.engine
    for _ in range(COMMANDS if robot in CLOSED else FEW):
        chance, before = session.random.random(), len(engine.book.deltas)
        try:
            if chance < 0.15:
                yield _why(engine, session.joints_target() if chance < 0.03 else session.pose_target(chance < 0.12))
                continue
            if chance < 0.22 and len(engine.timeline) > 3:
                engine.undo()
                if chance < 0.18:
                    engine.redo()
            else:
                engine.perform(session.request(), program=session.random.random() < 0.5)
        except (MotionError, IllegalValue, UsageError) as error:
            yield f"refused: {error} {numbers(error.place or ())}"
            continue
        yield _state(engine) if len(engine.book.deltas) > before else "no motion"
    yield from (breach.what for breach in breaches(engine.arm, engine.timeline))  # there is none


def _state(engine: Engine) -> str:
    cut, end = min(engine.book.deltas[-1].cut, engine.end), engine.end
    rows = [numbers(engine.position(cut + part * (end - cut)).joints) for part in INSTANTS]
    return f"{len(engine.timeline)} segments, {numbers([end])} s | {' | '.join(rows)}"


def _why(engine: Engine, target: JointTarget | PoseTarget) -> str:
    reach = engine.explain(target)
    options = [
        f"{one.configuration}: {numbers((*(one.joints or ()), one.too_far or 0.0))}; {len(one.overruns)}"
        for one in reach.options
    ]
    line = reach.line
    asked = numbers((line.length, line.duration or 0.0, line.at or 0.0, *line.stops))
    ways = [" ".join(way.words) + _place(way.via) for way in line.ways_out]
    parts = (*options, f"chosen {reach.chosen}", reach.reason, asked, line.trouble, *ways)
    return "why: " + " | ".join(part.replace("\n", " ") for part in parts)


def _place(pose: Transform | None) -> str:
    return "" if pose is None else numbers(position(pose))


def main() -> None:
    write_record(RECORDED, {f"{robot} {seed}": lines(robot, seed) for robot, seed in SESSIONS})


if __name__ == "__main__":
    command(main)

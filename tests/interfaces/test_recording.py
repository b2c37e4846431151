"""A drag becomes a program: few motions, which lead the tool along the same way."""

from __future__ import annotations

from math import dist, radians
from random import Random

import pytest

from tests.examples import some
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import UsageError
from vrs_cli.interfaces.dialogue import at_once
from vrs_cli.interfaces.dragging import Dragging
from vrs_cli.interfaces.recording import Tolerance, recorded_program
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, angle_between, at_position, position
from vrs_cli.values.acts import Define
from vrs_cli.values.commands import JointTarget, Move

MILLIMETRES = Tolerance(0.002, radians(1.0))
BEGIN = tuple(map(radians, (30.0, -130.0, 40.0, 10.0, 60.0, 20.0)))


def dragged(engine: Engine, seed: int, seconds: float) -> None:
    """About a place, as a hand does, with a rest in between."""
    source, dragging = Random(seed), Dragging(engine)
    wish, way, until = engine.position().T_world_tool, (0.0, 0.0, 0.0), engine.now + seconds
    for k in range(10**6):
        if k % 25 == 0:
            way = tuple(source.choice((0.0, 0.003, -0.003)) for _ in range(3))  # type: ignore[assignment]
        wish = at_position(wish, *(a + b for a, b in zip(position(wish), way, strict=True)))
        dragging.to(wish)
        engine.clock.advance(engine.now + 0.02)
        if engine.now > until:
            break
    engine.clock.advance(engine.end)


def tools(engine: Engine, begin: float, end: float) -> list[Transform]:
    count = int((end - begin) / 0.008) + 1
    return [engine.position(begin + (end - begin) * k / count).T_world_tool for k in range(count + 1)]


@pytest.mark.parametrize("seed", range(some(8) // 2))
@pytest.mark.parametrize("name", ["puma560", "ur5e"])
def test_the_program_leads_the_tool_along_the_way_within_the_tolerance(name: str, seed: int) -> None:
    session = Session(RecordingTerminal(), load_robot(name))
    engine = session.engine
    engine.perform(Move(JointTarget(BEGIN), straight=False))
    begin = engine.now
    dragged(engine, seed, 4.0)
    end = engine.now
    text = recorded_program(engine.arm, engine.timeline, begin, end, "way", MILLIMETRES)
    assert at_once(act_on(session, Define(text))).names == ("way",)
    session.perform("EXECUTE way")
    motions = [record for record in engine.book.records() if record.text.startswith("MOVE #PPOINT")]
    arrived = motions[1].executed if len(motions) > 1 else engine.end
    first, again = tools(engine, begin, end), tools(engine, arrived, engine.end)
    assert len(motions) < 90
    for a, b in ((first, again), (again, first)):
        for pose in a[::7]:
            near = min(b, key=lambda other: dist(position(pose), position(other)) + 0.1 * angle_between(pose, other))
            assert dist(position(pose), position(near)) < MILLIMETRES.away + 0.002
            assert angle_between(pose, near) < MILLIMETRES.turned + radians(0.5)


def test_a_coarser_tolerance_makes_fewer_motions() -> None:
    engine = Engine(load_robot("puma560"), start=BEGIN)
    dragged(engine, 3, 5.0)
    fine, coarse = (
        recorded_program(engine.arm, engine.timeline, 0.0, engine.end, "way", Tolerance(away, radians(5.0)))
        for away in (0.001, 0.02)
    )
    assert coarse.count("MOVE") < fine.count("MOVE")
    assert coarse.startswith(".PROGRAM way\nPARAMETER ROUNDING = ")


def test_where_the_arm_stood_there_is_no_program() -> None:
    engine = Engine(load_robot("puma560"))
    with pytest.raises(UsageError, match="stood"):
        recorded_program(engine.arm, engine.timeline, 0.0, 5.0, "way", MILLIMETRES)

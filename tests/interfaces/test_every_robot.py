"""The same small session with every kind of robot: motions, edits of the timeline, files, programs, pictures."""

from __future__ import annotations

import io
from math import radians
from pathlib import Path
from random import Random

import numpy as np
import pytest

from tests.interfaces.terminals import RecordingTerminal
from tests.robots import KINDS
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at, positions_at
from vrs_cli.errors import IllegalJoint, IllegalValue, LocationOutOfRange, NotAvailable, VrsError
from vrs_cli.files.exports import EXPORTERS, export
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import ArmTask, RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import distance
from vrs_cli.render.text import plain_text
from vrs_cli.repl.player import JogPanel
from vrs_cli.values.replies import LocationTable, Plot, Whereabouts
from vrs_cli.values.results import RunOutcome

URDF = Path(__file__).parent.parent / "kinematics" / "urdf"
ROBOTS = [*KINDS, *(str(URDF / f"{name}.urdf") for name in ("crooked", "gantry"))]
PROGRAM = """\
.PROGRAM there.and.back()
    MOVE #middle
    MOVE start
    BREAK
    HERE again
    TYPE /F8.3, DISTANCE(start, again), " ", INRANGE(start)
    DRIVE 1, 3, 50
    DRIVE 2, -3, 50
    BREAK
    TYPE #PHERE
.END
"""


@pytest.fixture(params=ROBOTS, ids=lambda name: Path(name).stem)
def session(request: pytest.FixtureRequest) -> Session:
    model = load_robot(request.param)
    session = Session(RecordingTerminal(), model, start=nowhere_special(model))
    session.perform(f"POINT #middle = {ppoint(model, beside(model, 0.02))}")
    return session


def nowhere_special(model: RobotModel) -> tuple[float, ...]:
    """Well inside all ranges, and far from every singularity."""
    arm, random = arm_for(model), Random(4)
    while True:
        ends = zip(model.lower, model.upper, strict=True)
        q = tuple(low + (high - low) * random.uniform(0.3, 0.7) for low, high in ends)
        if min(arm.singularity(q)) > 0.3:
            return q


def beside(model: RobotModel, part: float) -> tuple[float, ...]:
    """A little off there, by a part of each range."""
    rows = zip(nowhere_special(model), model.lower, model.upper, strict=True)
    return tuple(x + part * (high - low) * (-1) ** i for i, (x, low, high) in enumerate(rows))


def ppoint(model: RobotModel, q: tuple[float, ...]) -> str:
    return f"#PPOINT({', '.join(f'{x:.6f}' for x in model.units.to_display(q))})"


def told(session: Session, text: str) -> str:
    """What a line answers."""
    terminal = session.terminal
    assert isinstance(terminal, RecordingTerminal)
    before = len(terminal.replies)
    session.perform(text)
    return "".join(plain_text(reply) for reply in terminal.replies[before:])


def a_line(session: Session) -> str:
    """A straight line of 5 mm: along the tool, or in the plane of an arm that has one."""
    planar = session.engine.model.task in (ArmTask.POINT, ArmTask.PLANE)
    return "MOVES SHIFT(DEST BY -4, 3)" if planar else "DEPARTS 5"


def joints(engine: Engine) -> tuple[float, ...]:
    return engine.position().joints


def test_precision_points_have_as_many_values_as_the_robot_has_joints(session: Session) -> None:
    model = session.engine.model
    q = beside(model, 0.02)
    session.perform("MOVE #middle")
    assert joints(session.engine) == pytest.approx(q, abs=1e-7)
    assert told(session, "LISTL #middle").split()[-model.joint_count :] == [
        f"{x:.3f}" for x in model.units.to_display(q)
    ]
    with pytest.raises(IllegalValue, match=rf"the robot has {model.joint_count} joints"):
        session.perform(f"MOVE #PPOINT({', '.join(['0'] * (model.joint_count + 1))})")


def test_a_precision_point_of_another_robot_is_refused_by_all_that_take_one(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    count = session.engine.model.joint_count
    numbers = "".join(f" {k}.0" for k in range(count + 1))
    (tmp_path / "other.lc").write_text(f".LOCATIONS\n#other{numbers}\n.END\n")
    session.perform("LOAD other.lc")
    for line in ("MOVE #other", "MOVES #other", "MOVE #other AT 3", "WHY #other", "TYPE INRANGE(#other)"):
        with pytest.raises(IllegalValue, match=rf"of {count + 1} joints \(this robot has {count}\)"):
            session.perform(line)
    assert told(session, "LISTL #other").split()[-1] == f"{count}.000"


def test_where_shows_every_joint_in_its_unit(session: Session) -> None:
    model = session.engine.model
    lines = told(session, "WHERE").splitlines()
    assert lines[2].split() == [f"JT{i}" for i in range(1, model.joint_count + 1)]
    assert [float(x) for x in lines[3].split()] == pytest.approx(
        model.units.to_display(joints(session.engine)), abs=6e-4
    )


def test_a_taught_place_is_reached_again_and_a_line_leaves_it(session: Session) -> None:
    engine = session.engine
    start = joints(engine)
    session.perform("HERE start")
    session.perform("MOVE #middle")
    session.perform("MOVE start")
    there, here = engine.arm.forward(start), engine.arm.forward(joints(engine))
    assert (here.px, here.py, here.pz) == pytest.approx((there.px, there.py, there.pz), abs=1e-7)
    session.perform(a_line(session))
    tip = engine.position(engine.end).T_world_tool
    assert distance(tip, there) == pytest.approx(0.005, abs=1e-7)


def test_the_timeline_is_edited_undone_and_read(session: Session) -> None:
    engine = session.engine
    session.perform("MOVE #middle AT 1")
    before = engine.timeline
    session.perform(f"MOVE {ppoint(engine.model, beside(engine.model, -0.03))} AT 1.05")
    assert engine.timeline != before
    assert "JT1" in told(session, "WHERE FROM 1 TO 1.3 STEP 0.1")
    session.perform("UNDO")
    assert engine.timeline == before
    plot = [reply for reply in replies_of(session, "PLOT") if isinstance(reply, Plot)]
    assert len(plot[0].curves) == engine.model.joint_count
    assert ("mm" in plot[0].unit) is ("mm" in {engine.model.units.unit(i) for i in range(1, 8)})


def replies_of(session: Session, text: str) -> list[object]:
    terminal = session.terminal
    assert isinstance(terminal, RecordingTerminal)
    before = len(terminal.replies)
    session.perform(text)
    return list(terminal.replies[before:])


def test_a_program_runs(session: Session) -> None:
    session.perform("HERE start")
    assert session.load_text(PROGRAM) == ()
    start = joints(session.engine)
    result = session.execute("there.and.back")
    assert (result.outcome, result.fault) == (RunOutcome.COMPLETED, None)
    assert result.typed[0].split() == ["0.000", "0.000"]
    if len(session.engine.arm.ways) > 1:
        units = session.engine.model.units
        moved = units.one_shown(1, start[0]) + 3, units.one_shown(2, start[1]) - 3
        assert [float(x) for x in result.typed[1].split()[:2]] == pytest.approx(moved, abs=1e-4)


def test_joints_that_are_not_there_and_ranges_that_are_left(session: Session) -> None:
    count = session.engine.model.joint_count
    with pytest.raises(IllegalJoint, match=f"joints are 1 to {count}"):
        session.perform(f"DRIVE {count + 1}, 1, 50")
    unit = session.engine.model.units.unit(count)
    with pytest.raises(VrsError, match=rf"Joint {count} out of range\* would be .* {unit}, its range is .* {unit}"):
        session.perform(f"DRIVE {count}, 5000, 50")


def test_ready_and_nest(session: Session) -> None:
    for name in ("NEST", "READY"):
        session.perform(name)
        assert joints(session.engine) == pytest.approx(session.engine.model.poses[name.lower()], abs=1e-12)


def test_words_that_the_arm_has_not_are_refused(session: Session) -> None:
    words = {flag.name for flag in session.engine.arm.words}
    for word in ("RIGHTY", "LEFTY", "ABOVE", "BELOW", "FLIP", "NOFLIP"):
        if word in words:
            session.perform(word)
        else:
            with pytest.raises(NotAvailable, match=f"{word}: .* has no such configuration"):
                session.perform(word)


def test_locations_survive_a_file(session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    session.perform("HERE #taught")
    taught = session.environment.reference("#taught").value()
    session.perform("STOREL places")
    other = Session(RecordingTerminal(), session.engine.model)
    other.perform("LOAD places.lc")
    assert other.environment.reference("#taught").value() == pytest.approx(taught, abs=1e-8)


def test_the_trajectory_is_saved_read_and_exported(session: Session, tmp_path: Path) -> None:
    engine = session.engine
    session.perform("HERE start")
    session.perform("MOVE #middle")
    session.perform(a_line(session))
    path = tmp_path / "t.vrst"
    write_trajectory(path, engine.model, engine.book.initial, engine.book.deltas)
    recording = read_trajectory(path)
    assert recording.model == engine.model
    assert recording.timeline == engine.timeline
    times = np.linspace(-0.1, engine.end + 0.1, 50)
    over = positions_at(engine.arm, engine.timeline, times)
    for t, q, v in zip(times.tolist(), over.joints, over.velocity, strict=True):
        at = engine.position(t)
        assert q == pytest.approx(at.joints, abs=1e-8)
        assert v == pytest.approx(at.velocity, abs=1e-6)
    mid = engine.end * 0.9
    assert position_at(engine.arm, recording.timeline, mid) == engine.position(mid)
    stream = io.BytesIO()
    export(EXPORTERS["csv"], "-", stream, engine.arm, engine.timeline, 20.0)
    header, first, *_ = stream.getvalue().decode().splitlines()
    count = engine.model.joint_count
    assert header.split(",")[1 : count + 1] == [f"jt{i}" for i in range(1, count + 1)]
    start = engine.model.units.to_display(engine.position(0.0).joints)
    assert [float(x) for x in first.split(",")[1 : count + 1]] == pytest.approx(start, abs=1e-8)


def test_branches_are_compared_in_the_units_of_the_joints() -> None:
    session = Session(RecordingTerminal(), load_robot("cobra600"))
    session.perform("BRANCH other")
    session.perform("DRIVE 3, 60, 100")
    said = told(session, "COMPARE")
    assert "joint 3 60.000 mm" in said
    assert "Joint travel           0.000       0.000" in said


def test_inrange_has_bits_for_joints_beyond_the_sixth() -> None:
    session = Session(RecordingTerminal(), load_robot(URDF / "seven.urdf"))
    for joint, bit in ((1, 1), (6, 32), (7, 256)):
        numbers = ", ".join("300" if i == joint else "0" for i in range(1, 8))
        session.perform(f"x = INRANGE(#PPOINT({numbers}))")
        assert session.environment.reference("x").value() == bit


def test_a_sliding_joint_is_in_millimetres_and_a_turning_one_in_degrees() -> None:
    session = Session(RecordingTerminal(), load_robot("cobra600"))
    before = joints(session.engine)
    session.perform("DRIVE 3, 20, 100")
    session.perform("DRIVE 4, 20, 100")
    after = joints(session.engine)
    assert (after[2] - before[2], after[3] - before[3]) == pytest.approx((0.020, radians(20)))
    table = [reply for reply in replies_of(session, "HERE #p") if isinstance(reply, LocationTable)]
    assert "70.000" in plain_text(table[0])
    where = [reply for reply in replies_of(session, "WHERE") if isinstance(reply, Whereabouts)]
    assert plain_text(where[0]).splitlines()[-1].split() == ["-45.000", "90.000", "70.000", "65.000"]


def test_jog_takes_each_joint_in_its_unit(session: Session) -> None:
    engine = session.engine
    for joint in range(1, engine.model.joint_count + 1):
        before = joints(engine)
        session.perform(f"JOG {joint}, 0.5")
        moved = [b - a for a, b in zip(before, joints(engine), strict=True)]
        assert engine.model.units.one_shown(joint, moved[joint - 1]) == pytest.approx(0.5)


def test_jog_says_where_a_joint_stops(session: Session) -> None:
    model = session.engine.model
    for joint in range(1, model.joint_count + 1):
        said = told(session, f"JOG {joint}, 1000")
        assert (
            said.rstrip()
            == f"Joint {joint} stops at the end of its range, {model.joint_text(joint, model.upper[joint - 1], 1)}"
        )


def test_the_jog_panel_shows_each_joint_in_its_unit(session: Session) -> None:
    units = session.engine.model.units
    panel = JogPanel(Jogger(session))
    for joint in range(1, session.engine.model.joint_count + 1):
        panel.choose(joint - 1)
        assert f"step 2 {units.unit(joint)}" in panel.text()
    assert plain_text(Whereabouts(session.engine.position(), units=units)) in panel.text()


def test_why_tells_each_joint_in_its_unit(session: Session) -> None:
    model, count = session.engine.model, session.engine.model.joint_count
    said = told(session, "WHY #middle").splitlines()
    assert said[1].split()[-count:] == [f"{x:.3f}" for x in model.units.to_display(beside(model, 0.02))]
    beyond = (*model.lower[:-1], model.upper[-1] + model.units.one_read(count, 5.0))
    session.perform(f"POINT #beyond = {ppoint(model, beyond)}")
    assert f"JT{count} +5.0 {model.units.unit(count)}" in told(session, "WHY #beyond")


def test_compare_tells_how_far_joints_slide(session: Session) -> None:
    units, count = session.engine.model.units, session.engine.model.joint_count
    session.perform("BRANCH other")
    for joint in range(1, count + 1):
        session.perform(f"JOG {joint}, 0.5")
    rows = [line.split() for line in told(session, "COMPARE main").splitlines() if line.startswith("Joint travel")]
    for unit in ("deg", "mm"):
        there = [float(row[2]) + float(row[3]) for row in rows if row[-1] == unit]
        slid = sum(units.unit(joint) == unit for joint in range(1, count + 1))
        assert there == ([pytest.approx(0.5 * slid)] if slid or unit == "deg" else [])


def test_why_names_no_configuration_where_there_is_none(session: Session) -> None:
    words, said = {flag.name for flag in session.engine.arm.words}, told(session, "WHY HERE")
    keeps = session.engine.arm.lines_keep_words
    assert ("arm and elbow stay" in said) is (keeps and {"RIGHTY", "ABOVE"} <= words)
    assert ("the nearest of all solutions" in said) is (not keeps)
    assert "MOVE: ;" not in said
    if not words:
        assert "MOVE: the nearest joints that were found\n" in said
        assert "\n-      " in said


@pytest.mark.parametrize("name", ["cobra600", "planar2", "planar3"])
def test_a_forbidden_place_is_told_alike_by_move_moves_and_why(name: str) -> None:
    session = Session(RecordingTerminal(), load_robot(name))
    session.perform("HERE there")
    session.perform("SET tilted = there:RX(20)")
    for line in ("MOVE tilted", "MOVES tilted", "APPROS tilted, 0"):
        with pytest.raises(LocationOutOfRange, match=r"keeps its tool vertical, .* by 20.00 deg \(give O .* instead"):
            session.perform(line)
    said = told(session, "WHY tilted").splitlines()
    assert [line.partition(":")[0] for line in said if "vertical" in line] == ["MOVE, MOVES"]

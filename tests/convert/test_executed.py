"""Test that the text of `vrs convert`, read by our own readers and carried out on our timeline, leads where the run
led.
"""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from tests.convert.playing import Done, done_in, farthest, most_turned, outputs_of, play
from tests.convert.readers import READERS, Input, Joints, Line, Operation, Output, Wait, corners
from tests.examples import examples, quick
from tests.interfaces.terminals import RecordingTerminal
from tests.programs.test_samples import SAMPLES, peers_of, robot_for
from vrs_cli import Robot
from vrs_cli.convert.steps import executed_run
from vrs_cli.convert.writers import TARGETS, Written, confdata
from vrs_cli.engine.position import places_at
from vrs_cli.errors import UsageError
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.robot_file import load_robot

NEAR = 1e-5  # [m]: a hundredth of a millimetre
BLENDS = 1e-4  # [m]
MAKERS = ("urscript", "rapid", "krl")
SLOW = ("hanoi", "palletize")  # samples of many motions
CASES = quick(SAMPLES, lambda _number, path: path.stem not in SLOW)


def session_of(text: str, folder: Path, robot: str | None = None, inputs: Any = None) -> Session:
    """Return a session in which the first program of a text has been executed, or has stopped with an error."""
    model = robot_for(text) if robot is None else load_robot(robot)
    session = Session(RecordingTerminal(), model, folder=Folder(folder), outside=peers_of(text))
    if inputs is not None:
        session.driver.inputs = inputs
    session.load_text(text)
    session.execute(next(iter(session.environment.programs.values())).name)
    return session


def written(session: Session, target: str) -> Written:
    run = executed_run(session.engine.arm, session.engine.timeline)
    return TARGETS[target](run, "sample", "sample.v2").write()


def played(session: Session, operations: list[Operation]) -> Done:
    robot = Robot(session.engine.model)
    return play(operations, robot)


def check_makers(session: Session, target: str) -> list[Operation]:
    """Compare the places and outputs of one target with the run; the first motion leads to the start of the run."""
    operations = READERS[target](written(session, target).text)
    expected, found = done_in(session.engine.arm, session.engine.timeline), played(session, operations)
    places = found.places if target == "python" else found.places[1:]
    assert farthest(places, expected.places) < NEAR
    assert most_turned(places, expected.places) < NEAR
    assert found.outputs == expected.outputs
    return operations


def check_python(session: Session) -> Robot:
    """Execute the Python program: it ends at the same place with the same outputs, and without rounded corners leaves
    the same timeline.
    """
    if not any(move.cut for move in executed_run(session.engine.arm, session.engine.timeline).moves):
        check_makers(session, "python")
    namespace = dict[str, Any]()
    text = written(session, "python").text
    exec(compile(text, "sample.py", "exec"), namespace)
    robot, arm, timeline = namespace["robot"], session.engine.arm, session.engine.timeline
    assert outputs_of(robot.timeline) == outputs_of(timeline)
    ends = [places_at(arm, one, np.array([one.end])).T_world_tool for one in (robot.timeline, timeline)]
    assert np.abs(ends[0] - ends[1]).max() < NEAR
    if not any(move.rounded for move in executed_run(arm, timeline).moves):
        assert abs(robot.timeline.last - timeline.last) < 1e-6
        times = (np.arange(400) + 0.37) * timeline.last / 400
        places = [places_at(arm, one, times).T_world_tool for one in (robot.timeline, timeline)]
        assert np.abs(places[0] - places[1]).max() < NEAR
    return robot


@pytest.mark.parametrize("target", MAKERS)
@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_samples_lead_to_the_same_places(path: Path, target: str, tmp_path: Path) -> None:
    session = session_of(path.read_text(), tmp_path)
    axes = TARGETS[target].axes
    kind = {2: "RR", 4: "RRPR", 6: "RRRRRR"}[session.engine.model.joint_count]
    if kind in axes:
        check_makers(session, target)
    else:
        with pytest.raises(UsageError, match="python takes every robot"):
            TARGETS[target].check(session.engine.model)


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_samples_in_python_leave_the_same_timeline(path: Path, tmp_path: Path) -> None:
    check_python(session_of(path.read_text(), tmp_path))


# --- one thing at a time ------------------------------------------------------------------------------------------


PLACES = """
.LOCATIONS
a  300 450 -200 90 90 0
b  0 550 -250 90 90 0
c  -200 500 -200 90 90 30
grip 0 0 95 90 -90 0
.END
"""


def program(*lines: str) -> str:
    return "\n".join([".PROGRAM main()", *lines, ".END"]) + PLACES


@pytest.mark.parametrize("target", MAKERS)
def test_a_corner_is_a_blend(target: str, tmp_path: Path) -> None:
    """500 mm/s and 0.3 s to stop: the corner of the straight lines begins 75 mm before it; not after a BREAK."""
    session = session_of((SAMPLES[0].parent / "corner.v2").read_text(), tmp_path)
    blends = corners(check_makers(session, target))
    assert blends[1:] == pytest.approx([0.0, 0.075, 0.0, 0.0, 0.0, 0.0], abs=BLENDS)


@pytest.mark.parametrize("target", TARGETS)
def test_a_run_without_a_motion_is_written(target: str, tmp_path: Path) -> None:
    session = session_of(program('TYPE "hello"', "SIGNAL 3"), tmp_path)
    operations = READERS[target](written(session, target).text)
    assert [one for one in operations if isinstance(one, Output)] == [Output(3, True)]


def test_speeds_are_those_of_the_run(tmp_path: Path) -> None:
    text = program("MOVE a", "BREAK", "SPEED 50 MMPS", "MOVES b", "BREAK", "SPEED 20", "DRIVE 1, 60, 20")
    session = session_of(text, tmp_path)
    _, _, line, drive = (one for one in check_makers(session, "urscript") if isinstance(one, Joints | Line))
    assert line.speed[1] == pytest.approx(0.05, rel=1e-3)
    assert drive.speed == pytest.approx([np.radians(273.0), np.radians(82.0 * 0.2)], rel=1e-3)
    *_, line, drive = (one for one in check_makers(session, "krl") if isinstance(one, Joints | Line))
    assert (line.speed[0], drive.speed[0]) == (pytest.approx(0.05, rel=1e-3), 20.0)
    *_, line, _ = (one for one in check_makers(session, "rapid") if isinstance(one, Joints | Line))
    assert line.speed[0] == pytest.approx(50.0, rel=1e-3)


@pytest.mark.parametrize("target", MAKERS)
def test_tool_and_base(target: str, tmp_path: Path) -> None:
    check_makers(
        session_of(program("TOOL grip", "MOVE a", "MOVES b", "BASE 10, 20, 30, 40", "MOVE a", "MOVES c"), tmp_path),
        target,
    )
    check_python(
        session_of(program("TOOL grip", "MOVE a", "MOVES b", "BASE 10, 20, 30, 40", "MOVE a", "MOVES c"), tmp_path)
    )


@pytest.mark.parametrize("target", MAKERS)
def test_what_time_stamps_do_is_a_comment_and_a_note(target: str, tmp_path: Path) -> None:
    session = session_of(program("MOVE a AT 0", "MOVE b AT 0.5", "MOVE c AT 5"), tmp_path)
    check_makers(session, target)
    notes = [note for note in written(session, target).notes if note.startswith("MOVE")]
    assert notes == [
        "MOVE a AT 0 begins at 0.000 s: written without the time",
        "MOVE a AT 0 is cut short at 0.500 s: written up to there, with a stop",
        "MOVE b AT 0.5 begins at 0.500 s: written without the time",
        "MOVE c AT 5 begins at 5.000 s: written without the time",
    ]
    assert all(f"NOT SAID: {note}" in written(session, target).text for note in notes)
    check_python(session)


@pytest.mark.parametrize("target", MAKERS)
def test_outputs_stay_between_their_motions(target: str, tmp_path: Path) -> None:
    """An output after MOVE goes on when the motion begins: it is written before it."""
    session = session_of(
        program("MOVE a", "SIGNAL 1", "MOVES b", "SIGNAL -1, 2", "BREAK", "SIGNAL 3", "OPENI", "MOVE c"), tmp_path
    )
    kinds = [
        (one.number, one.on) if isinstance(one, Output) else "move"
        for one in check_makers(session, target)
        if isinstance(one, Output | Joints | Line)
    ]
    assert kinds == ["move", (1, True), "move", (1, False), (2, True), "move", (3, True), (None, True), "move"]
    check_python(session)


def test_an_output_in_the_middle_of_a_motion(tmp_path: Path) -> None:
    """KRL has a TRIGGER with a delay for it; the others write it before or after the motion, with a note."""
    session = session_of(program("MOVE a", "SIGNAL 1 AT 0.2", "SIGNAL 2 AT 1.4"), tmp_path)
    assert session.engine.end == pytest.approx(1.614, abs=1e-3)
    assert [one.delay for one in check_makers(session, "krl") if isinstance(one, Output)] == [0.2, 0.0]
    for target, count in (("urscript", 2), ("rapid", 2), ("krl", 1)):
        check_makers(session, target)
        told = [
            note for note in written(session, target).notes if note.startswith("signal") and "of the motion" in note
        ]
        assert len(told) == count
    check_python(session)


@pytest.mark.parametrize("target", MAKERS)
def test_a_wait_for_an_input_waits_for_it(target: str, tmp_path: Path) -> None:
    lines = (
        "MOVE a",
        "BREAK",
        "WAIT SIG(1001)",
        "SIGNAL 1",
        "MOVE b",
        "BREAK",
        "DELAY 0.5",
        "IF SIG(-1002) THEN",
        "SIGNAL 2",
        "END",
    )
    session = session_of(program(*lines), tmp_path, inputs=parse_signals("3.0, 1001, on"))
    operations = check_makers(session, target)
    assert [(one.number, one.on) for one in operations if isinstance(one, Input)] == [(1001, True), (1002, False)]
    assert [one.seconds for one in operations if isinstance(one, Wait)] == [pytest.approx(0.5)]
    check_python(session)


def test_what_urscript_has_no_output_for(tmp_path: Path) -> None:
    session = session_of(program("SIGNAL 16, 17", "MOVE a"), tmp_path)
    assert "URScript has no output 17" in written(session, "urscript").notes
    assert [
        one.number for one in READERS["urscript"](written(session, "urscript").text) if isinstance(one, Output)
    ] == [16]


def test_a_program_that_stops_is_written_up_to_there(tmp_path: Path) -> None:
    session = session_of(program("MOVE a", "MOVES b", "MOVE TRANS(5000)", "MOVE c"), tmp_path)
    for target in MAKERS:
        assert len(check_makers(session, target)) >= 3


@pytest.mark.parametrize("robot", ["iiwa14", "panda"])
def test_a_seventh_joint_is_an_external_axis(robot: str, tmp_path: Path) -> None:
    session = session_of(".PROGRAM main()\nDRIVE 2, 30, 50\nDRIVE 7, 30, 50\nDEPARTS -50\n.END\n", tmp_path, robot)
    for target in ("rapid", "krl"):
        first, *_, last = (
            one for one in READERS[target](written(session, target).text) if isinstance(one, Joints | Line)
        )
        assert isinstance(first, Joints)
        assert isinstance(last, Line)
        assert (len(first.joints), len(last.more)) == (7, 1)
    with pytest.raises(UsageError, match="RRRRRRR"):
        TARGETS["urscript"].check(session.engine.model)
    check_python(session)


def test_confdata_are_quarter_turns_and_the_place_of_the_wrist() -> None:
    """For an IRB 120: a wrist in front of axis 1 and of the lower arm with a positive axis 5 is number 0."""
    arm = Session(RecordingTerminal(), load_robot("irb120")).engine.arm
    rng, found = random.Random(5), set[int]()
    for _ in range(300):
        q = [rng.uniform(a, b) for a, b in zip(arm.model.lower, arm.model.upper, strict=True)]
        frames = arm.frames(tuple(q))
        cf1, cf4, cf6, cfx = confdata(arm, tuple(q))
        assert [cf1, cf4, cf6] == [int(np.floor(np.degrees(q[k]) / 90.0)) for k in (0, 3, 5)]
        found.add(cfx)
        wrist, shoulder, elbow = (np.array([frames[k].px, frames[k].py, frames[k].pz]) for k in (5, 1, 2))
        ahead = np.array([np.cos(q[0]), np.sin(q[0]), 0.0])
        behind = wrist @ ahead < 0.0
        upper, lower = elbow - shoulder, wrist - elbow
        folded = np.cross(upper, lower) @ np.cross(ahead, [0.0, 0.0, 1.0]) > 0.0
        assert cfx == 4 * behind + 2 * folded + (q[4] < 0.0)
    assert found == set(range(8))


# --- random programs ------------------------------------------------------------------------------------------------

POINTS = st.tuples(st.integers(-250, 250), st.integers(400, 600), st.integers(-300, -100), st.integers(-40, 40))
LINES = st.one_of(
    POINTS.map(lambda p: "MOVE TRANS({}, {}, {}, 90, 90, {})".format(*p)),
    POINTS.map(lambda p: "MOVES TRANS({}, {}, {}, 90, 90, {})".format(*p)),
    POINTS.map(lambda p: "APPRO TRANS({}, {}, {}, 90, 90, {}), 40".format(*p)),
    st.integers(10, 100).map(lambda d: f"DEPARTS {d}"),
    st.integers(-20, 20).map(lambda d: f"DRIVE 1, {d}, 80"),
    st.integers(-16, 16).map(lambda n: f"SIGNAL {n or 1}"),
    st.tuples(st.integers(1, 16), st.floats(0, 8)).map(lambda p: f"SIGNAL {p[0]} AT {p[1]:.3f}"),
    st.integers(10, 100).map(lambda v: f"SPEED {v} ALWAYS"),
    st.integers(50, 400).map(lambda v: f"SPEED {v} MMPS ALWAYS"),
    st.integers(-45, 45).map(lambda t: f"BASE {t}, {-t}, 0, {t / 3:.3f}"),
    st.sampled_from(
        [
            "BREAK",
            "OPENI",
            "CLOSEI",
            "OPEN",
            "CLOSE",
            "DELAY 0.3",
            "TOOL grip",
            "TOOL",
            "CPOFF",
            "ACCEL 60",
            "DURATION 2",
        ]
    ),
    st.tuples(POINTS, st.floats(0, 9)).map(
        lambda p: "MOVE TRANS({}, {}, {}, 90, 90, {}) AT {:.3f}".format(*p[0], p[1])
    ),
)


@settings(examples(100), phases=(Phase.explicit, Phase.generate))
@given(st.lists(LINES, max_size=14))
def test_random_programs(tmp_path_factory: pytest.TempPathFactory, lines: list[str]) -> None:
    session = session_of(program("MOVE b", *lines), tmp_path_factory.getbasetemp())
    for target in MAKERS:
        check_makers(session, target)
    check_python(session)

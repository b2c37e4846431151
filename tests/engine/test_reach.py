"""Tests of WHY: every configuration against the arm itself, the choice of MOVE, and the ways out of a straight line."""

from __future__ import annotations

from math import dist, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.laws.reach_laws import check_reach
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.reach import _across
from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationOutOfRange, MotionError
from vrs_cli.kinematics.joints import ALL, Arm, Profile, Wrist, joints_outside
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    at_position,
    compose,
    distance,
    dot,
    from_oat,
    length,
    position,
    rotation_z,
    to_oat,
    translation,
)
from vrs_cli.values.commands import (
    JointTarget,
    Mode,
    Move,
    PoseTarget,
    SetAcceleration,
    SetBase,
    SetConfiguration,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SpeedUnit,
)
from vrs_cli.values.results import Position

MODEL = load_robot("puma560")
ABOVE = PoseTarget(from_oat(0.0, 0.45, -0.15, radians(90), radians(90), 0.0))
poses = st.tuples(
    st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(-0.6, 0.8), *[st.floats(-180.0, 180.0)] * 3
).map(lambda p: from_oat(*p[:3], *map(radians, p[3:])))


@pytest.mark.parametrize("way", [(0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.1, -0.2, 0.3), (0.0, 0.0, -0.5)])
def test_via_points_are_looked_for_to_all_sides(way: Vector) -> None:
    found = _across(way)
    assert [length(one) for one in found] == pytest.approx([1.0] * len(found))
    assert [dot(one, way) for one in found] == pytest.approx([0.0] * len(found))
    assert sum(map(abs, map(sum, zip(*found, strict=True)))) == pytest.approx(0.0), "as far to one side as to the other"
    assert len(set(found)) == (4 if length(way) else 6)


def located(x: float, y: float, z: float, o: float = 90.0, a: float = 90.0, t: float = 0.0) -> PoseTarget:
    return PoseTarget(from_oat(x, y, z, *map(radians, (o, a, t))))


def refusal(engine: Engine, move: Move) -> MotionError | None:
    """Return the message with which a motion would be refused; the timeline stays as it was."""
    try:
        engine.perform(move)
    except MotionError as error:
        return error
    engine.undo()
    return None


@given(poses)
@examples(60)
def test_what_is_said_is_what_move_and_moves_do(pose: Transform) -> None:
    engine = Engine(MODEL)
    engine.perform(Move(ABOVE, straight=False))
    target = PoseTarget(pose)
    reach = engine.explain(target)
    assert [option.configuration for option in reach.options] == list(ALL)
    for option in reach.options:
        if option.joints is None:
            continue
        assert distance(engine.arm.forward(option.joints), pose) < 1e-9
        outside = joints_outside(option.joints, MODEL.lower, MODEL.upper)
        assert tuple(over.joint for over in option.overruns) == outside
        for over in option.overruns:
            assert over.limit + over.by == pytest.approx(option.joints[over.joint - 1])
    moved = refusal(engine, Move(target, straight=False))
    assert (reach.chosen is None) == (moved is not None)
    if moved is not None:
        assert reach.reason == str(moved)
    lined = refusal(engine, Move(target, straight=True))
    assert (reach.line.duration is None) == (lined is not None)
    if lined is not None:
        assert reach.line.trouble == str(lined)


@given(poses)
@examples(25)
def test_the_ways_out_are_ways_out(pose: Transform) -> None:
    engine = Engine(MODEL)
    engine.perform(Move(ABOVE, straight=False))
    begin = engine.position().T_world_tool
    target = PoseTarget(pose)
    for out in engine.explain(target).line.ways_out:
        other = Engine(MODEL, start=engine.position().joints)
        if out.via is not None:
            other.perform(Move(PoseTarget(out.via), straight=True))
            other.perform(Move(target, straight=True))
        elif out.words:
            for word in out.words:
                other.perform(SetConfiguration(_flag(word)))
            other.perform(Move(PoseTarget(begin), straight=False))
            other.perform(Move(target, straight=True))
        else:
            other.perform(Move(target, straight=False))
        assert distance(other.position().T_world_tool, pose) < 1e-6


def _flag(word: str) -> Arm | Wrist:
    for configuration in ALL:
        for flag in (configuration.arm, configuration.elbow, configuration.wrist):
            if flag.name == word:
                return flag  # type: ignore[return-value]
    raise AssertionError(word)


def test_too_far_by_what_the_location_would_have_to_come_nearer() -> None:
    engine = Engine(MODEL)
    target = located(1.2, 0.15, -0.1)
    far = engine.explain(target).options[0].too_far
    assert far is not None
    x, y, z = position(target.T_world_tool)
    wrist = (x, y, z + MODEL.links[5].d)  # the tool points down
    nearer = 1.0 - (far + 1e-4) / dist((0.0, 0.0, 0.0), wrist)
    assert engine.explain(located(x * nearer, y * nearer, wrist[2] * nearer - MODEL.links[5].d)).options[0].joints


def test_too_close_is_negative() -> None:
    far = Engine(MODEL).explain(located(0.1, 0.05, -0.1)).options[0].too_far
    assert far is not None
    assert far < 0.0


def test_where_the_line_stops_is_the_edge_of_what_is_possible() -> None:
    engine = Engine(MODEL)
    engine.perform(Move(ABOVE, straight=False))
    begin, target = position(engine.position().T_world_tool), located(0.0, 1.2, -0.15)
    check = engine.explain(target).line
    assert check.at is not None
    assert check.length == pytest.approx(0.75)

    def until(way: float) -> Move:
        return Move(PoseTarget(target.T_world_tool._replace(py=begin[1] + way)), straight=True)

    assert refusal(engine, until(check.at - 2e-4)) is None
    assert isinstance(refusal(engine, until(check.at + 1e-4)), LocationOutOfRange)


def test_a_possible_line_says_how_long_it_takes() -> None:
    engine = Engine(MODEL)
    engine.perform(Move(ABOVE, straight=False))
    target = located(0.1, 0.45, -0.15)
    for profile in Profile.__members__:
        engine.perform(SetParameter("PROFILE", profile))
        expected = engine.explain(target).line.duration
        begin = engine.end
        engine.perform(Move(target, straight=True))
        assert expected == pytest.approx(engine.end - begin)
        engine.undo()


def test_a_precision_point_says_which_joint_is_out_of_range_and_by_how_much() -> None:
    engine = Engine(MODEL)
    reach = engine.explain(JointTarget(tuple(map(radians, (0, -90, 90, 0, 120, -300)))))
    assert reach.options == ()
    assert reach.goal is not None
    assert [(over.joint, round(over.by, 9)) for over in reach.goal.overruns] == [
        (5, round(radians(20.0), 9)),
        (6, round(radians(-34.0), 9)),
    ]
    assert reach.chosen is None
    assert "Joint 5" in reach.reason


def test_asked_words_are_the_reason() -> None:
    engine = Engine(MODEL)
    engine.perform(SetConfiguration(Arm.LEFTY))
    reach = engine.explain(located(0.5, 0.15, -0.1))
    assert reach.chosen is not None
    assert reach.chosen.arm is Arm.LEFTY
    assert "LEFTY asked" in reach.reason


def test_nothing_moves() -> None:
    engine = Engine(MODEL)
    before: tuple[object, Position] = engine.timeline, engine.position()
    engine.explain(located(0.5, 0.15, -0.1))
    assert (engine.timeline, engine.position()) == before
    assert engine.settings.configuration.arm is None


def test_a_precision_point_of_another_robot_is_refused() -> None:
    with pytest.raises(IllegalValue, match="2 joints"):
        Engine(MODEL).explain(JointTarget((0.0, 0.0)))


def said_of(engine: Engine, target: PoseTarget | JointTarget) -> tuple[str, str]:
    """Return what WHY says, after comparing it with the refusals of MOVE and MOVES."""
    reach = engine.explain(target)
    expected = [refusal(engine, Move(target, straight)) for straight in (False, True)]
    told = (reach.reason if reach.chosen is None else "", reach.line.trouble)
    assert told == tuple(str(error or "") for error in expected)
    return told


@pytest.mark.parametrize(
    ("robot", "pose", "what"),
    [
        ("cobra600", located(0.4, 0.0, 0.3, 90.0, 78.0), "keeps its tool vertical, pointing down"),
        ("planar2", PoseTarget(translation(0.3, 0.1, 0.05)), "moves in the plane Z = 0.0 mm"),
        ("planar3", PoseTarget(translation(0.3, 0.1, 0.05)), "moves in the plane Z = 0.0 mm"),
    ],
)
def test_what_the_task_of_a_robot_forbids_is_said_of_the_line_too(robot: str, pose: PoseTarget, what: str) -> None:
    engine = Engine(load_robot(robot))
    for told in said_of(engine, pose):
        assert what in told
    line = engine.explain(pose).line
    assert line.at is None
    assert line.ways_out == ()


def test_a_line_takes_as_long_as_duration_says() -> None:
    engine = Engine(MODEL)
    engine.perform(Move(ABOVE, straight=False))
    engine.perform(SetDuration(7.0))
    assert engine.explain(located(0.1, 0.45, -0.15)).line.duration == pytest.approx(7.0)


def test_a_line_that_would_have_to_change_the_configuration_is_no_line() -> None:
    engine = Engine(MODEL)
    engine.perform(Move(ABOVE, straight=False))
    engine.perform(SetConfiguration(Arm.LEFTY))
    target = located(0.1, 0.45, -0.15)
    moved, lined = said_of(engine, target)
    assert (moved, "LEFTY asked" in lined) == ("", True)
    assert [(out.words, out.via) for out in engine.explain(target).line.ways_out] == [((), None)]


def test_no_joint_turns_more_than_half_a_turn_under_nooverlap() -> None:
    engine = Engine(MODEL, start=tuple(map(radians, (0, -90, 90, 0, 0, -200))))
    engine.perform(SetMode(Mode.OVERLAP, on=False, always=True))
    moved, _ = said_of(engine, JointTarget(tuple(map(radians, (0, -90, 90, 0, 0, 200)))))
    assert "NOOVERLAP" in moved


def test_a_precision_point_out_of_range_is_no_end_of_a_line() -> None:
    engine = Engine(MODEL)
    _, lined = said_of(engine, JointTarget(tuple(map(radians, (0, -100, 90, 0, 0, 280)))))
    assert "Joint 6" in lined


def test_another_configuration_is_one_that_the_words_lead_to() -> None:
    """Joint 4 of the Cobra can turn twice about: LEFTY leaves it on a turn on which this line is out of its range."""
    model = load_robot("cobra600")
    engine = Engine(model, start=(-0.10733325644156255, 1.8460871174049578, 0.16170544981077445, -2.765194059537814))
    far = PoseTarget(from_oat(-0.0206, -0.5815, 0.2435, *map(radians, (90.0, 90.0, 140.355))))
    assert engine.explain(far).line.duration is None
    assert not [out for out in engine.explain(far).line.ways_out if out.words]
    engine.perform(SetConfiguration(Arm.LEFTY))
    engine.perform(Move(PoseTarget(engine.position().T_world_tool), straight=False))
    assert isinstance(refusal(engine, Move(far, straight=True)), JointOutOfRange)


def test_no_via_point_is_named_while_another_configuration_is_asked() -> None:
    """A line to a precision point may be tried all the same; one to a transformation is refused."""
    engine = Engine(MODEL)
    engine.perform(Move(ABOVE, straight=False))
    target = JointTarget(engine.joints_for(located(-0.3, -0.3, -0.2).T_world_tool))
    assert any(out.via for out in engine.explain(target).line.ways_out)
    engine.perform(SetConfiguration(Arm.LEFTY))
    line = engine.explain(target).line
    assert line.duration is None
    assert not any(out.via for out in line.ways_out)


def test_a_way_out_counts_with_the_settings_that_will_be_in_force() -> None:
    """The speed is for the next motion: the MOVE to another configuration, or the line to a via point."""
    start = (2.3039547, -0.8973254, 3.4888060, -1.6066079, -0.1671192, -1.8110975)
    engine = Engine(MODEL, start=start)
    engine.perform(SetParameter("STRETCH", 3.0163))
    engine.perform(SetMonitorSpeed(72.457))
    engine.perform(SetAcceleration(22.197))
    engine.perform(SetSpeed(38.5018, always=True))
    engine.perform(SetSpeed(20.5728, unit=SpeedUnit.MMPS))
    engine.perform(SetBase(compose(translation(0.0, 0.0, -0.0052854), rotation_z(0.31162))))
    x, y, z = -0.206166, 0.117211, 0.331110
    n, o, a = (-0.253079, 0.319936, 0.913012), (0.024362, 0.945543, -0.324583), (-0.967139, -0.059902, -0.247092)
    pose = Transform(n[0], o[0], a[0], x, n[1], o[1], a[1], y, n[2], o[2], a[2], z)
    reach = check_reach(engine, PoseTarget(from_oat(x, y, z, *to_oat(pose))))
    assert reach.line.trouble, reach


def test_a_line_that_stops_on_its_way_is_told() -> None:
    engine = Engine(MODEL, start=MODEL.poses["nest"])
    here = engine.position().T_world_tool
    line = engine.explain(PoseTarget(here._replace(px=here.px + 0.2))).line
    assert line.duration is not None
    assert line.stops == pytest.approx([-here.px], abs=1e-9)


def test_the_via_point_is_the_nearest_beside_the_middle_that_leads_there() -> None:
    """Here it is 0.2 m aside: no point 0.05 or 0.1 m from the line leads there, above, below or to a side."""
    engine = Engine(MODEL)
    engine.perform(Move(ABOVE, straight=False))
    begin, target = engine.position(), located(-0.5, -0.477, -0.222, -17.0, 80.0, 17.0)
    (via,) = [out.via for out in engine.explain(target).line.ways_out if out.via is not None]
    middle = [0.5 * (a + b) for a, b in zip(position(begin.T_world_tool), position(target.T_world_tool), strict=True)]
    aside = [a - b for a, b in zip(position(via), middle, strict=True)]
    assert dist(aside, (0.0, 0.0, 0.0)) == pytest.approx(0.2)
    for part, leads in ((0.25, False), (0.5, False), (1.0, True)):
        beside = PoseTarget(at_position(via, *(m + part * a for m, a in zip(middle, aside, strict=True))))
        assert lines_lead(Engine(MODEL, start=begin.joints), beside, target) == leads


def lines_lead(engine: Engine, *targets: PoseTarget) -> bool:
    """Return whether straight lines lead from target to target."""
    try:
        for target in targets:
            engine.perform(Move(target, straight=True))
    except MotionError:
        return False
    return True

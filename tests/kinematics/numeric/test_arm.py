"""Arms without a closed form, from URDF files: too many joints, too few, crooked ones."""

from __future__ import annotations

from math import cos, hypot, pi, sin
from pathlib import Path
from random import Random

import numpy as np
import pytest
from msgspec import structs

from vrs_cli.engine.engine import Engine
from vrs_cli.errors import IllegalJoint, JointOutOfRange, LocationOutOfRange, LocationTooFar, NotAvailable
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.compiled import solve, squares, volume
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import NONE, Joints, Walk
from vrs_cli.kinematics.model import ArmTask
from vrs_cli.kinematics.numeric import search
from vrs_cli.kinematics.numeric.arm import NumericArm
from vrs_cli.kinematics.numeric.search import turn_between
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, compose, rotate, rotation_about, rotation_x, translation
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import CartesianPath, Guide
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, SetSwivel, Stamp, Swivel, ToolOffsetTarget
from vrs_cli.wire.records import Form, Motions, RecordError, segment_records, segments_of

URDF = Path(__file__).parents[1] / "urdf"
FIVE = structs.replace(load_robot(URDF / "five.urdf"), task=ArmTask.POSE)  # which no five joints can have everywhere


def arm_of(name: str) -> RobotArm:
    return arm_for(load_robot(URDF / f"{name}.urdf"))


@pytest.fixture(params=["seven", "crooked", "five", "gantry"])
def arm(request: pytest.FixtureRequest) -> RobotArm:
    return arm_of(request.param)


def random_joints(arm: RobotArm, count: int) -> list[tuple[float, ...]]:
    """Well inside the ranges, where no arm of these is near a singularity of its own making."""
    parts = np.random.default_rng(3).uniform(0.15, 0.85, (count, arm.model.joint_count))
    lower, upper = np.array(arm.model.lower), np.array(arm.model.upper)
    return [tuple(row) for row in (lower + parts * (upper - lower)).tolist()]


def test_joints_that_are_near_are_found(arm: RobotArm) -> None:
    for q in random_joints(arm, 40):
        T = arm.forward(q)
        near = tuple(x + 0.02 for x in q)
        found = arm.branch_joints(T, arm.ways[0], near)
        assert found is not None
        assert arm.forward(found) == pytest.approx(T, abs=1e-9)
        if arm.model.joint_count <= 6 and min(arm.singularity(q)) > 0.05:
            assert found == pytest.approx(q, abs=1e-6)


def test_select_reaches_every_pose_from_afar_and_always_the_same_way(arm: RobotArm) -> None:
    start = random_joints(arm, 1)[0]
    for q in random_joints(arm, 15)[1:]:
        found = arm.select(arm.forward(q), start)
        assert arm.limits_ok(found)
        assert arm.forward(found) == pytest.approx(arm.forward(q), abs=1e-9)
        assert arm.select(arm.forward(q), start) == found


def test_arrays_are_solved_within_the_limits(arm: RobotArm) -> None:
    q = np.array(random_joints(arm, 200))
    T = arm.batch.forward(q)
    found, inside = arm.batch.inverse(T)
    assert found.shape == (200, 1, arm.model.joint_count)
    assert inside.mean() > 0.97
    reached = found[inside[:, 0], 0]
    assert np.abs(arm.batch.forward(reached) - T[inside[:, 0]]).max() < 1e-9
    near = arm.batch.inverse_branch(T, arm.ways[0], q + 0.02)
    found_near = ~np.isnan(near[:, 0])
    assert found_near.mean() > 0.98
    assert np.abs(arm.batch.forward(near[found_near]) - T[found_near]).max() < 1e-9


def test_arrays_near_a_singular_pose_are_exact_to_rounding() -> None:
    """What a search leaves would be many times as much of a joint: readings 1 ms apart would differ by it."""
    arm, random = arm_for(load_robot("xarm6")), Random(1)
    q = np.array([(0.3, -0.4, -1.2, 0.7, random.uniform(1.8e-3, 2e-3), 0.2) for _ in range(50)])
    near = q + np.array([[random.uniform(-1e-2, 1e-2) for _ in range(6)] for _ in range(50)])
    found = arm.batch.inverse_branch(arm.batch.forward(q), NONE, near)
    assert np.abs(arm.batch.forward(found) - arm.batch.forward(q)).max() < 1e-14


def test_a_line_of_seven_joints_uses_all_of_them_as_its_guide_says() -> None:
    arm = arm_of("seven")
    q = arm.model.units.read((10.0, 30.0, 20.0, -70.0, 15.0, 60.0, 5.0))
    engine = Engine(arm.model, start=q)
    engine.perform(Move(ToolOffsetTarget(translation(0.03, 0.02, -0.1)), straight=True))
    after = engine.position(engine.end).joints
    assert min(abs(b - a) for a, b in zip(q, after, strict=True)) > 1e-4
    for segment in list(engine.timeline)[1:]:
        path = segment.path
        assert isinstance(path, CartesianPath)
        (guide,) = path.guides
        assert hypot(*guide.weights) == pytest.approx(1.0)
        for part in (0.0, 0.37, 1.0):
            s = part * segment.duration
            there = engine.position(segment.start + s).joints
            assert sum(w * x for w, x in zip(guide.weights, there, strict=True)) == pytest.approx(
                value(guide.value, s), abs=1e-9
            )


def test_a_line_there_and_back_ends_where_it_began() -> None:
    arm = arm_of("seven")
    q = arm.model.units.read((10.0, 30.0, 20.0, -70.0, 15.0, 60.0, 5.0))
    engine = Engine(arm.model, start=q)
    for way in (translation(0.03, 0.02, -0.1), translation(-0.03, -0.02, 0.1)):
        engine.perform(Move(ToolOffsetTarget(way), straight=True, stamp=Stamp(engine.end)))
    assert engine.position(engine.end).joints == pytest.approx(q, abs=2e-3)


def test_a_line_goes_on_out_of_any_motion_of_seven_joints() -> None:
    arm = arm_of("seven")
    start = arm.model.units.read((10.0, 30.0, 0.0, -70.0, 15.0, 60.0, 5.0))
    goal = arm.model.units.read((20.0, 35.0, 40.0, -60.0, 10.0, 50.0, 0.0))
    engine = Engine(arm.model, start=start)
    engine.perform(Move(JointTarget(goal), straight=False, speed=0.3))
    before, pose = engine.position(0.3), engine.position(1.0).T_world_tool
    engine.perform(Move(PoseTarget(compose(pose, translation(0.0, 0.0, -0.02))), straight=True, stamp=Stamp(0.3)))
    first = next(segment for segment in engine.timeline if isinstance(segment.path, CartesianPath))
    assert first.start == pytest.approx(0.3, abs=1e-8)
    assert abs(before.velocity[2]) > 0.3
    assert engine.position(0.3).velocity == pytest.approx(before.velocity, abs=1e-9)


def seven() -> Engine:
    model = arm_of("seven").model
    return Engine(model, start=model.units.read((10.0, 30.0, 20.0, -70.0, 15.0, 60.0, 5.0)))


@pytest.mark.parametrize("value", [0.1, -0.4, None])
def test_swivel_says_where_a_joint_ends_on_a_line(value: float | None) -> None:
    engine = seven()
    before = engine.position()
    engine.perform(SetSwivel(Swivel(3, value)))
    engine.perform(Move(ToolOffsetTarget(translation(0.03, 0.02, -0.1)), straight=True))
    end = before.joints[2] if value is None else value
    assert engine.position(engine.end).joints[2] == pytest.approx(end, abs=1e-9)
    half = 0.5 * (engine.timeline[1].start + engine.end)
    assert engine.position(half).joints[2] == pytest.approx(0.5 * (before.joints[2] + end), abs=1e-6)
    assert engine.settings.swivel.present.swivel is None


def test_swivel_alone_turns_the_elbow_about_a_tool_that_stands() -> None:
    engine = seven()
    before = engine.position()
    engine.perform(SetSwivel(Swivel(3, -0.2)))
    engine.perform(Move(PoseTarget(before.T_world_tool), straight=True))
    assert engine.end > 0.2
    for part in (0.3, 0.7, 1.0):
        assert engine.position(part * engine.end).T_world_tool == pytest.approx(before.T_world_tool, abs=1e-9)
    assert engine.position(engine.end).joints[2] == pytest.approx(-0.2, abs=1e-9)


def test_a_closed_path_repeats_where_swivel_says_so() -> None:
    engine = seven()
    engine.perform(SetSwivel(Swivel(3), always=True))
    begin = engine.position().joints
    for way in ((0.05, 0.0, 0.0), (0.0, 0.06, 0.0), (-0.05, 0.0, 0.05), (0.0, -0.06, -0.05)):
        there = translation(*way)
        engine.perform(Move(ToolOffsetTarget(there), straight=True, stamp=Stamp(engine.end)))
    assert engine.position(engine.end).joints == pytest.approx(begin, abs=1e-8)


@pytest.mark.parametrize(
    ("name", "swivel", "error", "message"),
    [
        ("crooked", Swivel(3), NotAvailable, "crooked has no joint too many"),
        ("seven", Swivel(8), IllegalJoint, "this robot has joints 1 to 7"),
        ("seven", Swivel(3, 4.0), JointOutOfRange, "its range is -170.00 to 170.00 deg"),
    ],
)
def test_a_swivel_that_cannot_be_is_refused(name: str, swivel: Swivel, error: type[Exception], message: str) -> None:
    engine = Engine(arm_of(name).model)
    with pytest.raises(error, match=message):
        engine.perform(SetSwivel(swivel))


def test_five_joints_follow_a_line_that_they_can() -> None:
    model = FIVE
    down = model.units.read((0.0, 20.0, 100.0, 60.0, 0.0))  # the sum of 180 deg points the flange down
    engine = Engine(model, start=down)
    goal = engine.arm.forward(model.units.read((40.0, 30.0, 80.0, 70.0, 40.0)))
    engine.perform(Move(PoseTarget(goal), straight=True))
    for part in (0.3, 0.6, 1.0):
        assert engine.position(engine.end * part).T_world_tool.az == pytest.approx(-1.0, abs=1e-9)
    assert engine.position(engine.end).T_world_tool == pytest.approx(goal, abs=1e-9)
    sideways = engine.arm.forward(down)._replace(nx=0.0, ny=1.0, nz=0.0, sx=0.0, sy=0.0, sz=1.0, ax=1.0, ay=0.0, az=0.0)
    with pytest.raises(LocationOutOfRange, match=r"5 joints cannot turn .* give the arm the task 'steady'"):
        engine.perform(Move(PoseTarget(sideways._replace(py=0.2)), straight=False))


def test_every_pose_of_a_line_is_found_from_joints_near_by() -> None:
    """Also if a step is tiny while the error is still larger than the precision, because links are levers."""
    arm = arm_for(load_robot("panda"))
    source = np.random.default_rng(1)
    goal = np.array(arm.middle) + source.uniform(-0.3, 0.3, (20_000, 7))
    near = goal + source.uniform(-1.0, 1.0, goal.shape) * 10.0 ** source.uniform(-5.5, -4.5, (len(goal), 1))
    poses = arm.batch.forward(goal)
    found = arm.batch.solve_guided(poses, near, np.eye(7)[6:], goal[:, 6:])
    assert np.abs(arm.batch.forward(found) - poses).max() < 1e-11


def test_a_search_that_leads_nowhere_ends_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Next to what five joints can do: a line that leaves it is looked at there many times."""
    arm = arm_for(FIVE)
    q = arm.model.units.read((10.0, -30.0, 60.0, 40.0, 20.0))
    taken, step = [], search.step_within
    monkeypatch.setattr(search, "step_within", lambda *given: taken.append(given) or step(*given))
    for turn in (0.02, 0.2):
        assert arm.branch_joints(compose(arm.forward(q), rotation_x(turn)), arm.ways[0], q) is None
    assert len(taken) < 60


def test_what_cannot_be_reached_is_said() -> None:
    arm = arm_of("crooked")
    far = arm.forward(arm.model.poses["ready"])._replace(px=3.0)
    with pytest.raises(LocationTooFar, match=r"all links in one line are 922.0 mm; the search from here comes as near"):
        arm.select(far, arm.model.poses["ready"])
    short = arm_for(FIVE)
    with pytest.raises(LocationTooFar, match=r"nearer\)"):
        short.select(translation(0.0, 0.0, 0.7), short.model.poses["ready"])
    gantry = arm_of("gantry")
    beyond = gantry.forward(gantry.model.poses["ready"])._replace(px=5.0)
    with pytest.raises(JointOutOfRange, match=r"Joint 1 out of range\* would be 5000.00 mm, .* 0.00 to 1200.00 mm"):
        gantry.select(beyond, gantry.model.poses["ready"])


def test_small_systems() -> None:
    rows = ((0.0, 2.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 3.0))
    x = solve(rows, (4.0, 5.0, 7.0))
    assert x is not None
    assert [sum(a * b for a, b in zip(row, x, strict=True)) for row in rows] == pytest.approx([4.0, 5.0, 7.0])
    assert volume(rows) == pytest.approx(abs(np.linalg.det(rows)))
    assert volume(rows[:2]) == pytest.approx(np.sqrt(5.0))
    assert solve(((1.0, 0.0), (2.0, 0.0)), (3.0, 6.0)) == (3.0, 0.0)  # what nothing decides is 0
    assert solve(((1.0, 0.0), (2.0, 0.0)), (3.0, 5.0)) is None
    assert volume(((1.0, 2.0), (2.0, 4.0))) == 0.0
    assert solve(((1.0, 0.0), (0.0, 3e-10)), (1.0, 6e-10)) == pytest.approx((1.0, 2.0))  # small, but no rounding
    assert solve(((1.0, 0.0), (0.0, 3e-11)), (1.0, 6e-11)) == (1.0, 0.0)


def test_one_elimination_serves_two_that_are_wanted() -> None:
    random, compared = Random(11), 0
    for _ in range(50):
        rows = [[random.choice((0.0, 0.01, 1.0)) * random.uniform(-1.0, 1.0) for _ in range(7)] for _ in range(7)]
        wanted, also = ([random.uniform(-1.0, 1.0) for _ in range(7)] for _ in range(2))
        found, first, second = squares(rows, wanted, also), squares(rows, wanted), squares(rows, also)
        if first and second and max(map(abs, (*first[0], *second[0]))) < 1e3:
            assert found is not None
            assert np.allclose(found, (*first, *second), rtol=0.0, atol=1e-8)
            compared += 1
    assert compared > 20
    assert squares([[0.0, 1.0], [0.0, 1.0]], (1.0, 1.0), (0.0, 0.0)) is None


def test_joints_and_rates_at_once_are_those_found_one_by_one() -> None:
    arm, random = arm_for(load_robot("panda")), Random(12)
    compared = 0
    for _ in range(50):
        q = tuple(
            random.uniform(0.8 * low + 0.2 * high, 0.2 * low + 0.8 * high)
            for low, high in zip(arm.model.lower, arm.model.upper, strict=True)
        )
        weights = tuple(random.uniform(-1.0, 1.0) for _ in q)
        near = tuple(x + random.uniform(-0.03, 0.03) for x in q)
        demands = ((weights, sum(w * x for w, x in zip(weights, q, strict=True))),)
        twist = (0.1, -0.2, 0.05, 0.3, 0.0, -0.1)
        found = arm.guided_state(arm.forward(q), near, demands, twist, [0.2])
        joints = arm.guided_joints(arm.forward(q), near, demands)
        if found is None or joints is None or min(arm.singularity(q)) < 0.1:
            continue
        compared += 1
        assert np.allclose(found[0], joints, rtol=0.0, atol=1e-8)
        rates = arm.joint_velocity(joints, twist, demands=((weights, 0.2),))
        assert np.allclose(found[1], rates, rtol=1e-4, atol=1e-4)
    assert compared > 20


def test_the_shortest_turn_brings_one_direction_to_another() -> None:
    random = Random(1)
    for _ in range(100):
        a, b = ((sin(u) * cos(w), sin(u) * sin(w), cos(u)) for u, w in (_angles(random), _angles(random)))
        turn = turn_between(a, b)
        assert rotate(rotation_about(turn, hypot(*turn)), a) == pytest.approx(b, abs=1e-12)
        assert hypot(*turn) <= pi


def _angles(random: Random) -> tuple[float, float]:
    return random.uniform(0.0, pi), random.uniform(-pi, pi)


def test_guides_and_swivel_are_written_and_read_to_the_bit_and_a_line_without_guides_holds_a_joint() -> None:
    engine = seven()
    engine.perform(SetSwivel(Swivel(3, 0.1)))
    engine.perform(Move(ToolOffsetTarget(translation(0.03, 0.02, -0.1)), straight=True))
    form, segments = Form.of(engine.arm), tuple(engine.timeline)[1:]
    records = segment_records(segments, Motions(), None)
    assert segments_of(records, Motions(), None, form) == segments
    (old, *_) = [structs.replace(one, line=structs.replace(one.line, guides=())) for one in records if one.line]
    ((path,),) = [[one.path] for one in segments_of([old], Motions(), None, form)]
    assert isinstance(path, CartesianPath)
    assert path.guides == (Guide((0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0), (path.seeds[0][2],)),)
    wrong = structs.replace(records[0], line=structs.replace(records[0].line, guides=records[0].line.guides * 2))
    with pytest.raises(RecordError, match="2 guides of a line of a robot that needs 1"):
        segments_of([wrong], Motions(), None, form)


MODEL = load_robot("iiwa14")
MIDDLE = tuple((low + high) / 2 for low, high in zip(MODEL.lower, MODEL.upper, strict=True))
NEAR_AN_END = (MODEL.lower[0] + 0.01 * (MODEL.upper[0] - MODEL.lower[0]), *MIDDLE[1:])


def margins(monkeypatch: pytest.MonkeyPatch, begin: Joints, walked: dict[float, tuple[float, bool]]) -> list[float]:
    """The margins of the walks in their order; each part of the gradient gives a margin, and whether it arrives."""

    def walk(_arm: object, _begin: Joints, _poses: object, _asked: object, part: float) -> Walk:
        margin, arrives = walked[part]
        return Walk(begin, (), margin, arrives)

    monkeypatch.setattr(NumericArm, "_walk", walk)
    return [one.margin for one in NumericArm(MODEL).walks(begin, (IDENTITY,), ())]


def test_walks_far_from_the_ends_of_ranges_come_first_and_the_others_after_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walked = {0.0: (0.01, True), 0.5: (0.02, True), 1.0: (0.05, True), 2.0: (0.04, True), 4.0: (0.03, True)}
    assert margins(monkeypatch, MIDDLE, walked) == [0.05, 0.04, 0.03, 0.02, 0.01]


def test_walks_that_do_not_arrive_or_leave_a_range_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    walked = {0.0: (-0.01, True), 0.5: (0.02, False), 1.0: (0.4, False), 2.0: (-0.03, True), 4.0: (0.0, True)}
    assert margins(monkeypatch, MIDDLE, walked) == [0.0, -0.01]


def test_a_walk_that_keeps_as_far_as_it_begins_is_far_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    walked = {0.0: (0.005, True), 0.5: (0.01, True), 1.0: (0.02, True), 2.0: (0.009, True), 4.0: (0.4, False)}
    assert margins(monkeypatch, NEAR_AN_END, walked) == [0.01, 0.02, 0.009, 0.005]

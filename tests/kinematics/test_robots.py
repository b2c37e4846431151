"""Every robot that is built in: its file, its zeros, and that the closed forms are its own."""

from __future__ import annotations

import tomllib
from math import degrees
from pathlib import Path
from random import Random

import numpy as np
import pytest
from msgspec import structs

from tests.examples import some
from tests.kinematics.pointing import CLOSED, FIVE, SEVEN
from tests.robots import KINDS, kind_of
from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationOutOfRange, LocationTooClose, LocationTooFar
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL, SIDES, Arm, Configuration, Elbow, Wrist
from vrs_cli.kinematics.model import ArmTask, RobotModel
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import ROBOTS, load_robot, robot_names
from vrs_cli.kinematics.transform import (
    Transform,
    angle_between,
    compose,
    dot,
    from_oat,
    inverse,
    rotation_z,
    to_oat,
    translation,
)

NAMES = robot_names()
N = 4000


def arm_of(name: str) -> RobotArm:
    return arm_for(load_robot(name))


def shown(T: Transform) -> list[float]:
    """X, Y, Z, O, A, T in mm and deg."""
    return [*(1000.0 * x for x in (T.px, T.py, T.pz)), *map(degrees, to_oat(T))]


@pytest.fixture(params=NAMES)
def arm(request: pytest.FixtureRequest) -> RobotArm:
    return arm_of(request.param)


def searched(arm: RobotArm) -> bool:
    """Whether its solutions are found by searches, which take a thousand times as long as formulas."""
    return "search" in arm.method or "least squares" in arm.method


def random_joints(arm: RobotArm, count: int = N) -> np.ndarray:
    return np.random.default_rng(7).uniform(arm.model.lower, arm.model.upper, (count, arm.model.joint_count))


def test_the_robots_that_are_promised() -> None:
    six = {"irb120", "kr10", "lrmate200id", "puma260", "puma560", "ur5e", "xarm6"}
    assert set(NAMES) == six | {"cobra600", "iiwa14", "panda", "planar2", "planar3", "so100"}


def test_the_kinds_that_laws_are_tried_on_are_all_that_there_are() -> None:
    assert set(map(kind_of, KINDS)) == set(map(kind_of, NAMES))


@pytest.mark.parametrize("name", NAMES)
def test_every_file_says_where_its_figures_come_from(name: str) -> None:
    text = Path(ROBOTS, f"{name}.toml").read_text(encoding="utf-8")
    assert tomllib.loads(text)["name"] == name
    comments = " ".join(line for line in text.splitlines() if line.startswith("#"))
    assert "ours" in comments.lower()
    assert "Links" in comments or "All figures are ours" in comments


@pytest.mark.parametrize(
    ("name", "joints", "pose"),
    [
        ("cobra600", (0, 0, 0, 0), (600, 0, 387, 90, 90, 180)),  # both arms along X, the flange down
        ("cobra600", (90, 0, 100, 0), (0, 600, 287, 90, 90, 90)),
        ("irb120", (0, 0, 0, 0, 0, 0), (374, 0, 630, 90, 0, 0)),  # ABB's zero: 302 + 72 out, 290 + 270 + 70 up
        ("irb120", (0, 90, 0, 0, 0, 0), (340, 0, 290 - 374, 90, 90, 0)),
        ("planar2", (0, 90), (300, 200, 0, 90, -90, 90)),
        ("planar3", (90, -90, 0), (300, 300, 0, 90, -90, 0)),
        ("puma260", (0, -90, 90, 0, 0, 0), (0, 127, 469.9, 90, -90, 0)),
        ("puma260", (0, 0, 90, 0, 0, 0), (469.9, 127, 0, 90, 0, 0)),
        ("ur5e", (0, 0, 0, 0, 0, 0), (-817.2, -232.9, 62.8, 0, 0, 90)),  # the maker's zero
        ("ur5e", (0, -90, 0, -90, 0, 0), (0, -232.9, 1079.4, 0, 0, -90)),  # straight up: 162.5 + 425 + 392.2 + 99.7
    ],
)
def test_where_the_flange_is(name: str, joints: tuple[float, ...], pose: tuple[float, ...]) -> None:
    model = load_robot(name)
    T = arm_for(model).forward(model.units.read(joints))
    assert shown(T)[:3] == pytest.approx(pose[:3], abs=1e-6)
    expected = from_oat(0.0, 0.0, 0.0, *np.radians(pose[3:]))
    assert angle_between(T, expected) == pytest.approx(0.0, abs=1e-7)


def test_plain_data_gives_every_bit_back(arm: RobotArm) -> None:
    again = from_dict(to_dict(arm.model))
    assert again == arm.model
    assert arm_for(again) is arm


def test_frames_end_at_the_flange(arm: RobotArm) -> None:
    q = arm.model.poses["ready"]
    frames = arm.frames(q)
    assert len(frames) == len(q) + 1
    assert frames[-1] == pytest.approx(arm.forward(q), abs=1e-12)


def test_joints_come_back_in_their_own_configuration(arm: RobotArm) -> None:
    for row in random_joints(arm, some(80) if searched(arm) else 300).tolist():
        q = tuple(row)
        T = arm.forward(q)
        assert arm.inverse_branch(T, arm.configuration(q), q) == pytest.approx(q, abs=1e-9)
        for solution in arm.inverse_all(T):
            if solution.joints is not None:
                assert arm.configuration(solution.joints) is solution.configuration


def test_every_branch_leads_back(arm: RobotArm) -> None:
    T = arm.batch.forward(random_joints(arm, some(2000) if searched(arm) else N))
    found, inside = arm.batch.inverse(T)
    found_all = "damped least squares" not in arm.method
    assert inside.any(axis=1).mean() >= (1.0 if found_all else 0.999)
    reached = ~np.isnan(found[..., 0])
    back = arm.batch.forward(found[reached])
    expected = np.broadcast_to(T[:, None], (*found.shape[:2], 3, 4))[reached]
    assert np.abs(back - expected)[..., 3].max() < 1e-9
    if arm.model.task is ArmTask.STEADY:
        turned = np.abs(back - expected).max(axis=(1, 2)) < 1e-9
        assert turned.mean() >= 0.99, "the others are turned as near as one way goes"
    elif arm.model.task is not ArmTask.POINT:
        assert np.abs(back - expected).max() < 1e-9


def test_the_jacobian_is_the_derivative(arm: RobotArm) -> None:
    h = 1e-6
    q = random_joints(arm)
    J = arm.batch.jacobian(q, translation(0.02, -0.03, 0.1))
    tip = np.array([[0.02, -0.03, 0.1, 1.0]])
    for i in range(q.shape[1]):
        step = np.zeros(q.shape[1])
        step[i] = h
        before, after = arm.batch.forward(q - step), arm.batch.forward(q + step)
        slope = (after - before) / (2 * h)
        spin = np.einsum("nij,nkj->nik", slope[..., :3], arm.batch.forward(q)[..., :3])
        assert np.abs(J[:, :3, i] - np.einsum("nij,kj->ni", slope, tip)).max() < 1e-8
        assert np.abs(J[:, 3:, i] - np.stack((spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]), 1)).max() < 1e-8


def test_velocities_there_and_back(arm: RobotArm) -> None:
    q = random_joints(arm, 200)
    rates = np.random.default_rng(1).uniform(-1, 1, q.shape)
    tool = translation(0.0, 0.0, 0.1)
    for row, qd in zip(map(tuple, q.tolist()), rates, strict=True):
        if min(arm.singularity(row)) > 1e-3:
            twist = arm.twist(row, tuple(qd), tool)
            found = arm.joint_velocity(row, twist, tool)
            assert arm.twist(row, found, tool) == pytest.approx(twist, abs=1e-7)
            assert len(qd) > 6 or found == pytest.approx(qd, abs=1e-7)


@pytest.mark.parametrize("name", ["irb120", "puma260", "puma560", "ur5e"])
@pytest.mark.parametrize("bend", [1e-9, 0.0, -1e-9])
def test_a_straight_wrist_is_flip_and_noflip(name: str, bend: float) -> None:
    """Next to a singular wrist a configuration has a twin, in which the same joints are when it is singular; none
    elsewhere.
    """
    arm = arm_of(name)
    q = (0.3, -0.9, 0.8, 0.4, bend, 0.2)
    (twin,) = arm.twins(q)
    have = arm.configuration(q)
    assert (twin.arm, twin.elbow) == (have.arm, have.elbow)
    assert twin.wrist is not have.wrist
    if not bend:
        assert arm.branch_joints(arm.forward(q), twin, q) == pytest.approx(q, abs=1e-6)
    assert arm.twins((*q[:4], 0.5, q[5])) == ()


@pytest.mark.parametrize("model", [FIVE, SEVEN, CLOSED], ids=lambda model: model.name)
def test_rates_of_a_tool_that_points_are_right_in_what_counts(model: RobotModel) -> None:
    """Its place, and where it points; the turn about that may be any."""
    arm, twist = arm_for(model), (0.1, -0.2, 0.05, 0.3, -0.4, 0.5)
    for row in random_joints(arm, 50):
        q = tuple(row)
        if min(arm.singularity(q)) < 0.05:
            continue
        have, T = arm.twist(q, arm.joint_velocity(q, twist)), arm.forward(q)
        assert have[:3] == pytest.approx(twist[:3], abs=1e-9)
        for axis in ((T.nx, T.ny, T.nz), (T.sx, T.sy, T.sz)):
            assert dot(have[3:], axis) == pytest.approx(dot(twist[3:], axis), abs=1e-9)


@pytest.mark.parametrize("joint", [1, 4, 5])
def test_an_arm_with_another_length_is_no_ur(joint: int) -> None:
    ur = load_robot("ur5e")
    links = [structs.replace(link, a=link.a + (0.05 if i == joint else 0.0)) for i, link in enumerate(ur.links, 1)]
    arm, q = arm_for(structs.replace(ur, links=tuple(links))), (0.3, -1.2, -1.0, -0.7, 1.1, 0.2)
    assert arm.method != arm_of("ur5e").method
    assert arm.forward(arm.select(arm.forward(q), q)) == pytest.approx(tuple(arm.forward(q)), abs=1e-9)


def test_a_ur_without_offset_keeps_joint_1_above_its_axis() -> None:
    ur = load_robot("ur5e")
    arm = arm_for(structs.replace(ur, links=(*ur.links[:3], structs.replace(ur.links[3], d=0.0), *ur.links[4:])))
    near = (0.7, -1.3, -1.0, -0.5, 0.4, 0.2)
    above = arm.forward(near)
    wrist = translation(*(-ur.links[5].d * x for x in (above.ax, above.ay, above.az)))
    on_axis = compose(wrist, above)
    T = compose(translation(-on_axis.px, -on_axis.py, 0.0), above)
    found = arm.branch_joints(T, arm.configuration(near), near)
    assert found is not None
    assert found[0] == pytest.approx(near[0], abs=1e-9)
    assert arm.forward(found) == pytest.approx(tuple(T), abs=1e-9)


# --- configurations ------------------------------------------------------------------------------------------------


def test_which_words_an_arm_has() -> None:
    assert arm_of("ur5e").ways == arm_of("irb120").ways == ALL
    assert arm_of("cobra600").ways == arm_of("planar2").ways == SIDES
    assert arm_of("cobra600").words == (Arm.RIGHTY, Arm.LEFTY)
    assert arm_of("ur5e").words == (*Arm, *Elbow, *Wrist)
    assert str(arm_of("planar3").configuration((0.0, -1.0, 0.0))) == "LEFTY"


def test_a_right_arm_has_its_elbow_on_the_right() -> None:
    arm = arm_of("cobra600")
    q = arm.model.units.read((-45.0, 90.0, 0.0, 0.0))  # elbow at (230, -230), hand at (424, -35): to its left
    assert arm.configuration(q).arm is Arm.RIGHTY
    lefty = arm.select(arm.forward(q), q, Configuration.of(arm=Arm.LEFTY))
    assert arm.configuration(lefty).arm is Arm.LEFTY
    assert lefty[1] == pytest.approx(-q[1])
    assert arm.forward(lefty) == pytest.approx(arm.forward(q), abs=1e-12)


def test_the_elbow_of_a_ur_is_above_where_it_looks_so() -> None:
    arm = arm_of("ur5e")
    q = arm.model.units.read((0.0, -90.0, -90.0, -90.0, 90.0, 0.0))  # upper arm straight up, forearm level
    assert arm.configuration(q).elbow is Elbow.ABOVE
    below = arm.select(arm.forward(q), q, Configuration.of(elbow=Elbow.BELOW))
    elbows = [arm.frames(joints)[2].pz for joints in (q, below)]
    _, shoulder, _, wrist, *_ = arm.frames(q)
    assert elbows[0] > (shoulder.pz + wrist.pz) / 2 > elbows[1]


def test_at_a_straight_wrist_both_wrists_hold() -> None:
    arm = arm_of("ur5e")
    q = arm.model.units.read((10.0, -80.0, -70.0, -60.0, 0.0, 20.0))
    assert [way.wrist for way in arm.twins(q)] == [Wrist.FLIP]
    assert arm.branch_joints(arm.forward(q), arm.twins(q)[0], q) == pytest.approx(q, abs=1e-7)
    assert arm.twins(arm.model.poses["ready"]) == ()


# --- what is out of reach ------------------------------------------------------------------------------------------


def test_a_scara_keeps_its_tool_vertical() -> None:
    arm = arm_of("cobra600")
    ready = arm.model.poses["ready"]
    tilted = from_oat(0.4, 0.0, 0.3, *np.radians((90.0, 78.0, 0.0)))
    message = (
        r"keeps its tool vertical, pointing down; the location tilts it by 12.00 deg \(give O 90, A 90, T 0 instead\)"
    )
    with pytest.raises(LocationOutOfRange, match=message):
        arm.select(tilted, ready)
    assert not any(solution.usable for solution in arm.inverse_all(tilted))
    told = from_oat(0.4, 0.0, 0.3, *np.radians((90.0, 89.999, 0.0)))  # three decimals of a listing
    assert arm.forward(arm.select(told, ready))[3::4] == pytest.approx(told[3::4], abs=1e-5)


def test_a_planar_arm_stays_in_its_plane() -> None:
    arm = arm_of("planar2")
    with pytest.raises(
        LocationOutOfRange, match=r"moves in the plane Z = 0.0 mm of its own frame, .* Z = 50.0 mm \(give Z 0 instead\)"
    ):
        arm.select(translation(0.3, 0.1, 0.05), arm.model.poses["ready"])
    turned = from_oat(0.3, 0.1, 0.0, *np.radians((90.0, -90.0, 77.0)))  # its turn does not count
    assert arm.forward(arm.select(turned, arm.model.poses["ready"]))[3::4] == pytest.approx((0.3, 0.1, 0.0))


@pytest.mark.parametrize(
    ("name", "place", "error", "message"),
    [
        (
            "cobra600",
            (0.7, 0.0, 0.3),
            LocationTooFar,
            r"be 700.0 mm .* reaches 600.0 mm \(.* 100.0 mm nearer",
        ),
        ("cobra600", (0.03, 0.0, 0.3), LocationTooClose, r"no nearer than 50.0 mm \(.* 20.0 mm away"),
        ("cobra600", (0.4, 0.0, 0.1), JointOutOfRange, r"would be 287.00 mm, its range is 0.00 to 210.00 mm"),
        ("planar3", (0.9, 0.0, 0.0), LocationTooFar, r"the arm reaches 500.0 mm"),
        ("ur5e", (1.5, 0.0, 0.3), LocationTooFar, r"the arm reaches 817.2 mm"),
        ("ur5e", (0.05, 0.0, 0.3), LocationTooClose, r"nearer than 133.3 mm"),
        ("irb120", (1.5, 0.0, 0.3), LocationTooFar, r"mm nearer"),
    ],
)
def test_out_of_reach_is_said_in_millimetres(
    name: str, place: tuple[float, ...], error: type[LocationOutOfRange], message: str
) -> None:
    arm = arm_of(name)
    upright = (90.0, -90.0, 0.0) if name.startswith("planar") else (90.0, 90.0, 0.0)
    with pytest.raises(error, match=message) as told:
        arm.select(from_oat(*place, *np.radians(upright)), arm.model.poses["ready"])
    bound = told.value.upper if told.value.lower is None else told.value.lower
    if error is not JointOutOfRange and bound is not None:
        assert f"{1000.0 * bound:.1f} mm" in str(told.value)


@pytest.mark.parametrize(
    ("bars", "lean", "fold", "pillar", "error", "words"),
    [
        (0.6, 1.0, 0.3, 0.0, LocationTooFar, "the arm reaches 817.2 mm .* {nearer:.1f} mm nearer"),
        (0.6, 1.0, 3.13, 0.0, LocationTooClose, "no nearer than 32.8 mm"),
        (15.0, -1.35, -0.3, 30.0, LocationTooFar, "the arm reaches 817.2 mm"),
    ],
)
def test_how_far_a_ur_is_from_a_place(
    bars: float, lean: float, fold: float, pillar: float, error: type[LocationOutOfRange], words: str
) -> None:
    """Where another arm is whose two bars [m] have another length; also on a pillar [m], far below its shoulder."""
    ur = load_robot("ur5e")
    l1, l2, l3, *others = ur.links
    short, long = (
        arm_for(structs.replace(ur, name=name, links=(structs.replace(l1, d=l1.d + pillar), *two, *others)))
        for name, two in (("short", (l2, l3)), ("long", (structs.replace(l2, a=-bars), structs.replace(l3, a=-bars))))
    )
    q = (0.3, lean, fold, -lean - fold, 1.2, 0.4)
    way = short.configuration(q)
    far = 2000.0 * bars * abs(np.cos(fold / 2.0))
    told = f"joint 4 would be {far:.1f} mm from the shoulder.*" + words.format(nearer=far - 817.2)
    with pytest.raises(error, match=told):
        short.select(long.forward(q), q, way)


@pytest.mark.parametrize("name", ["cobra600", "planar2", "planar3"])
def test_a_refusal_gives_angles_and_coordinates_that_are_right_under_any_tool_and_base(name: str) -> None:
    arm, random = arm_of(name), Random(3)
    for _ in range(20):
        base = compose(translation(0.1, -0.2, random.uniform(-0.1, 0.1)), rotation_z(random.uniform(-3, 3)))
        tool = from_oat(0.0, 0.0, 0.08, *(random.uniform(-3, 3) for _ in range(3)))
        asked = dict(zip("XYZOAT", (random.uniform(-400, 400) for _ in range(6)), strict=True))
        said = instead(arm, asked, base, tool)
        assert said.keys() == {"O", "A", "T"}
        asked |= said
        if name.startswith("planar"):
            said = instead(arm, asked, base, tool)
            assert said.keys() == {"Z"}
            asked |= said
        check_as_given(arm, asked, base, tool)


def check_as_given(arm: RobotArm, asked: dict[str, float], base: Transform, tool: Transform) -> None:
    """The task of an arm about a location in mm and degrees."""
    x, y, z, *angles = asked.values()
    location = from_oat(x / 1000.0, y / 1000.0, z / 1000.0, *np.radians(angles))
    arm.check_task(compose(compose(base, location), inverse(tool)), base, tool)


def instead(arm: RobotArm, asked: dict[str, float], base: Transform, tool: Transform) -> dict[str, float]:
    """What the refusal says to give."""
    with pytest.raises(LocationOutOfRange) as refused:
        check_as_given(arm, asked, base, tool)
    pairs = refused.value.hint.removeprefix("give ").removesuffix(" instead").split(", ")
    return {name: float(number) for name, number in (pair.split() for pair in pairs)}


def test_a_tool_that_sticks_out_where_no_turn_is_chosen_is_refused() -> None:
    with pytest.raises(IllegalValue, match=r"20.0 mm beside an axis whose turn this robot does not choose"):
        arm_of("planar2").check_tool(translation(0.0, 0.02, 0.1))
    arm_of("planar2").check_tool(translation(0.0, 0.0, 0.1))
    arm_of("planar3").check_tool(translation(0.0, 0.02, 0.1))
    arm_of("cobra600").check_tool(translation(0.05, 0.02, 0.1))


def test_a_scara_whose_last_axis_is_beside_its_arm() -> None:
    model = load_robot("cobra600")
    first, second, third, last = model.links
    beside = arm_for(structs.replace(model, links=(first, second, structs.replace(third, a=0.05, theta=0.7), last)))
    assert type(beside) is type(arm_for(model))
    for q in random_joints(beside, 50).tolist():
        joints = tuple(q)
        assert beside.inverse_branch(beside.forward(joints), beside.configuration(joints), joints) == pytest.approx(
            joints
        )


def test_a_scara_whose_first_bar_is_the_shorter_one() -> None:
    model = load_robot("cobra600")
    first, second, *others = model.links
    arm = arm_for(
        structs.replace(model, links=(structs.replace(first, a=second.a), structs.replace(second, a=first.a), *others))
    )
    upright = np.radians((90.0, 90.0, 0.0))
    with pytest.raises(LocationTooClose, match=r"no nearer than 50\.0 mm \(.* 20\.0 mm away"):
        arm.select(from_oat(0.03, 0.0, 0.3, *upright), model.poses["ready"])

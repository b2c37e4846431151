"""Which joints of a URDF file are the arm, which are its hand, and what is said of the choice."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import pytest

from tests.kinematics.test_urdf import written
from vrs_cli.errors import FileDamaged, NotAvailable
from vrs_cli.kinematics.link_data import Box, opening_motion
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import Ends, load_robot
from vrs_cli.kinematics.transform import Vector, compose, position, translation
from vrs_cli.kinematics.urdf import robot
from vrs_cli.kinematics.urdf.chain import choice
from vrs_cli.kinematics.urdf.tree import MAX_FILE_JOINTS, Tree, robot_element


@pytest.fixture(autouse=True)
def _begins_at_its_zeros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another READY takes longer to find than all the rest."""
    monkeypatch.setattr(robot, "better_ready", lambda *_: None)


def joint(
    name: str,
    parent: str,
    child: str,
    kind: str = "revolute",
    *,
    xyz: str = "0 0 0.2",
    axis: str = "0 0 1",
    limits: tuple[float, float] | None = (-2.0, 2.0),
    mimic: str = "",
) -> str:
    limit = "" if limits is None else f'<limit lower="{limits[0]}" upper="{limits[1]}" velocity="1" effort="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}{mimic}</joint>'
    )


def fixed(parent: str, child: str, xyz: str = "0 0 0.1") -> str:
    return joint(f"to_{child}", parent, child, "fixed", xyz=xyz, limits=None)


def arm(count: int, root: str = "base", prefix: str = "") -> str:
    """Joints j1, j2, ... with the links l1, l2, ..., about z and y in turn."""
    links = [root, *(f"{prefix}l{i}" for i in range(1, count + 1))]
    axes = ("0 0 1", "0 1 0")
    return "".join(
        joint(f"{prefix}j{i}", links[i - 1], links[i], axis=axes[(i > 1) and (i % 2 == 0)]) for i in range(1, count + 1)
    )


def visual(link: str) -> str:
    return f'<link name="{link}"><visual><geometry><box size="0.01 0.01 0.01"/></geometry></visual></link>'


def loaded(folder: Path, text: str, base: str | None = None, tip: str | None = None) -> RobotModel:
    return load_robot(written(folder, f'<robot name="r">{text}</robot>'), Ends(base, tip))


def told(model: RobotModel) -> tuple[str, ...]:
    """What is said of the choice of the chain."""
    assert model.origin is not None
    return tuple(note for note in model.origin.notes if not note.startswith("READY"))


PALM = fixed("l7", "palm") + fixed("palm", "palm_tcp")
LEFT = joint("left", "palm", "left_finger", "prismatic", xyz="0 0 0.05", axis="0 1 0", limits=(0.0, 0.04))
FOLLOWS = '<mimic joint="left"/>'
RIGHT = joint("right", "palm", "right_finger", "prismatic", xyz="0 0 0.05", axis="0 -1 0", limits=(0.0, 0.04))
MIMIC = joint("right", "palm", "right_finger", "prismatic", xyz="0 0 0.05", axis="0 -1 0", mimic=FOLLOWS)


@pytest.mark.parametrize("right", [RIGHT, MIMIC])
def test_an_arm_ends_where_its_fingers_part(tmp_path: Path, right: str) -> None:
    model = loaded(tmp_path, arm(7) + PALM + LEFT + right)
    assert model.origin is not None
    assert (model.joint_count, model.origin.tip, told(model)) == (7, "palm_tcp", ())
    assert model.origin.fingers == ("left", "right")
    assert model.hand_width == pytest.approx(0.08)
    assert position(link_frames(model, (0.0,) * 7)[-1]) == pytest.approx((0.0, 0.0, 1.6))


def test_the_tip_is_the_link_that_carries_fingers_where_no_name_says_better(tmp_path: Path) -> None:
    model = loaded(tmp_path, arm(7) + fixed("l7", "palm") + fixed("l7", "tool0") + LEFT + RIGHT)
    assert model.origin is not None
    assert model.origin.tip == "palm"


def test_fingers_of_several_joints_and_without_names(tmp_path: Path) -> None:
    fingers = "".join(
        joint(f"a{i}", "l5", f"f{i}", xyz=f"{x} 0 0.02", axis="0 1 0", limits=(0.0, 1.0))
        + joint(f"b{i}", f"f{i}", f"g{i}", xyz="0 0 0.04", axis="0 1 0", limits=(0.0, 1.0))
        + fixed(f"g{i}", f"h{i}", "0 0 0.03")
        for i, x in ((1, -0.03), (2, 0.03))
    )
    model = loaded(tmp_path, arm(5) + fingers)
    assert model.origin is not None
    assert (model.joint_count, model.origin.tip, len(model.origin.fingers)) == (5, "l5", 4)


@pytest.mark.parametrize(("name", "child"), [("gripper", "l6"), ("j6", "moving_jaw"), ("finger_1", "l6")])
def test_a_jaw_at_the_end_is_no_joint_of_the_arm(tmp_path: Path, name: str, child: str) -> None:
    text = arm(5) + joint(name, "l5", child, axis="0 1 0", limits=(-0.2, 1.8))
    model = loaded(tmp_path, text)
    assert model.origin is not None
    assert (model.joint_count, model.origin.tip, model.origin.fingers) == (5, "l5", (name,))
    (note,) = told(model)
    assert f"joint {name} at the end of the chain moves the hand" in note
    assert f"the tip is l5, which it does not move (--tip {child} takes it for one)" in note
    asked = loaded(tmp_path, text, tip=child)
    assert asked.origin is not None
    assert (asked.joint_count, asked.origin.tip, told(asked)) == (6, child, ())
    chosen = loaded(tmp_path, text, tip="l5")
    assert chosen.origin is not None
    assert (chosen.joint_count, chosen.origin.fingers, told(chosen)) == (5, (name,), ())


@pytest.mark.parametrize(("name", "child"), [("gripper_roll", "l6"), ("j6", "gripper_link"), ("wrist", "hand")])
def test_a_last_joint_that_turns_the_hand_is_one(tmp_path: Path, name: str, child: str) -> None:
    model = loaded(tmp_path, arm(5) + joint(name, "l5", child))
    assert model.origin is not None
    assert (model.joint_count, model.origin.tip) == (6, child)


def test_a_jaw_beside_one_that_the_wrist_turns(tmp_path: Path) -> None:
    wrist = joint("wrist_roll", "l4", "fixed_jaw") + fixed("fixed_jaw", "fixed_jaw_tip")
    model = loaded(tmp_path, arm(4) + wrist + joint("gripper", "fixed_jaw", "moving_jaw", axis="0 1 0"))
    assert model.origin is not None
    assert (model.joint_count, model.origin.tip, model.origin.fingers) == (5, "fixed_jaw", ("gripper",))


def test_a_joint_that_does_not_move_the_place_of_grasping_is_a_jaw(tmp_path: Path) -> None:
    text = arm(5) + fixed("l5", "gripper_tcp") + joint("j6", "l5", "gripper", axis="0 1 0")
    model = loaded(tmp_path, text + fixed("gripper", "end"))
    assert model.origin is not None
    assert (model.joint_count, model.origin.tip, model.origin.fingers) == (5, "gripper_tcp", ("j6",))
    assert "--tip gripper takes it for one" in told(model)[0]


TWO_ARMS = arm(1) + arm(6, "l1", "left_") + arm(6, "l1", "right_") + arm(2, "l1", "head_")


def test_several_arms_are_refused_with_the_tips_to_choose(tmp_path: Path) -> None:
    with pytest.raises(FileDamaged, match=r"several arms, with the ends left_l6, right_l6 \(choose one: --tip l"):
        loaded(tmp_path, TWO_ARMS)
    model = loaded(tmp_path, TWO_ARMS, tip="right_l6")
    assert model.origin is not None
    assert model.origin.joints == ("j1", *(f"right_j{i}" for i in range(1, 7)))
    alone = loaded(tmp_path, TWO_ARMS, base="l1", tip="right_l6")
    assert alone.origin is not None
    assert (alone.joint_count, alone.origin.base) == (6, "l1")


def test_a_head_and_wheels_beside_one_arm_are_no_arms(tmp_path: Path) -> None:
    wheels = "".join(joint(f"w{i}", "base", f"wheel{i}", "continuous", limits=None) for i in range(4))
    model = loaded(tmp_path, wheels + arm(1) + arm(2, "l1", "head_") + arm(7, "l1", "arm_"))
    assert model.origin is not None
    assert (model.joint_count, model.origin.base, model.origin.tip) == (8, "base", "arm_l7")


ENDLESS = (-999999.0, 999999.0)


@pytest.mark.parametrize(
    ("vehicle", "left"),
    [
        (joint("drive", "world", "base", "planar", limits=None), "drive"),
        (joint("float", "world", "base", "floating", limits=None), "float"),
        (
            joint("x", "world", "a", "prismatic", limits=ENDLESS)
            + joint("y", "a", "b", "prismatic", limits=ENDLESS)
            + joint("yaw", "b", "base", limits=ENDLESS),
            "x, y, yaw",
        ),
        (
            joint("steer", "world", "a", limits=ENDLESS) + joint("drive", "a", "base", "prismatic", limits=ENDLESS),
            "steer, drive",
        ),
    ],
)
def test_what_drives_or_floats_is_left_out(tmp_path: Path, vehicle: str, left: str) -> None:
    model = loaded(tmp_path, vehicle + arm(6))
    assert model.origin is not None
    assert (model.joint_count, model.origin.base) == (6, "base")
    assert told(model) == (f"left out, as what has no end is no joint of an arm: {left}; the base is base",)


def test_a_joint_of_the_arm_that_turns_without_end_has_a_turn_each_way(tmp_path: Path) -> None:
    model = loaded(tmp_path, joint("j0", "base", "l0", limits=ENDLESS) + arm(5, "l0"))
    assert (model.joint_count, model.lower[0], model.upper[0]) == (6, -2 * pi, 2 * pi)


def test_a_file_of_fingers_alone_keeps_them(tmp_path: Path) -> None:
    text = "".join(joint(f"finger_{i}", f"l{i}", f"l{i + 1}", axis="0 1 0") for i in range(3))
    assert loaded(tmp_path, text).joint_count == 3


# --- how it opens ------------------------------------------------------------------------------------------------


def place(model: RobotModel, index: int, q: tuple[float, ...], hand: float) -> Vector:
    """Where the middle of a shape is."""
    shape = model.shapes[index]
    assert isinstance(shape.body, Box)
    frame = link_frames(model, q)[shape.link]
    return position(compose(frame, compose(opening_motion(shape.opens, hand), shape.body.pose)))


def test_fingers_are_seen_where_their_joints_put_them(tmp_path: Path) -> None:
    seen = "".join(map(visual, ("left_finger", "right_finger")))
    model, q = loaded(tmp_path, arm(7) + PALM + LEFT + MIMIC + seen), (0.0,) * 7
    for hand in (0.0, 0.3, 1.0):
        assert place(model, 0, q, hand) == pytest.approx((0.0, 0.04 * hand, 1.55), abs=1e-12)
        assert place(model, 1, q, hand) == pytest.approx((0.0, -0.04 * hand, 1.55), abs=1e-12)
    assert from_dict(to_dict(model)) == model


def test_a_finger_on_a_finger_follows_it(tmp_path: Path) -> None:
    text = (
        arm(5)
        + joint("finger", "l5", "f", xyz="0 0 0.1", axis="0 1 0", limits=(0.0, 1.0))
        + joint("tip_joint", "f", "g", xyz="0 0 0.1", axis="0 1 0", mimic='<mimic joint="finger" multiplier="-1"/>')
        + visual("g").replace("<geometry>", '<origin xyz="0 0 0.05"/><geometry>')
    )
    model, q = loaded(tmp_path, text), (0.0,) * 5
    for hand in (0.0, 0.5, 1.0):  # the second joint turns back what the first turns: the tip stays upright
        expected = (0.1 * sin(hand), 0.0, 1.0 + 0.1 + 0.1 * cos(hand) + 0.05)
        assert place(model, 0, q, hand) == pytest.approx(expected, abs=1e-12)
    assert from_dict(to_dict(model)) == model


def test_the_closed_end_is_where_fingers_are_nearer(tmp_path: Path) -> None:
    """Of a hand like Robotiq's, which is open at zero."""

    def finger(name: str, y: float, axis: str, mimic: str = "") -> str:
        return joint(name, "l6", f"{name}_link", xyz=f"0 {y} 0", axis=axis, limits=(0.0, 0.8), mimic=mimic) + fixed(
            f"{name}_link", f"{name}_tip", "0 0 0.1"
        )

    fingers = finger("finger_a", 0.05, "1 0 0") + finger("finger_b", -0.05, "-1 0 0", '<mimic joint="finger_a"/>')
    seen = visual("finger_a_tip")
    model, q = loaded(tmp_path, arm(6) + fingers + seen), (0.0,) * 6
    assert place(model, 0, q, 1.0)[1] == pytest.approx(0.05)
    assert place(model, 0, q, 0.0)[1] < 0.0  # they would cross: the file says how far each goes
    toml = tmp_path / "mine.toml"
    toml.write_text('urdf = "little.urdf"\n[hand]\nclosed = "lower"\nwidth = 60\n', encoding="utf-8")
    other = load_robot(toml)
    assert (place(other, 0, q, 0.0)[1], other.hand_width) == (pytest.approx(0.05), pytest.approx(0.06))


def test_links_are_chosen_of_urdf_files_alone() -> None:
    with pytest.raises(NotAvailable, match=r"the links of puma560 have no names \(a base and a tip are chosen"):
        load_robot("puma560", Ends(tip="hand"))


def telescope(mimic: str, axis: str = "1 0 0") -> str:
    limits, back = (0.0, 0.1), '<mimic joint="out" multiplier="-2"/>'
    return (
        arm(2)
        + joint("out", "l2", "s1", "prismatic", axis="1 0 0", limits=limits)
        + joint("more", "s1", "s2", "prismatic", xyz="0 0 0", axis=axis, limits=limits, mimic=mimic)
        + joint("last", "s2", "s3", "prismatic", xyz="0 0 0", axis="-1 0 0", mimic=back)
        + joint("roll", "s3", "s4", axis="1 0 0")
    )


def test_a_telescope_is_one_joint(tmp_path: Path) -> None:
    model = loaded(tmp_path, telescope('<mimic joint="out" offset="0.01"/>'))
    assert model.origin is not None
    assert model.origin.joints == ("j1", "j2", "out", "roll")
    assert (model.lower[2], model.upper[2], model.max_velocity[2]) == pytest.approx((0.0, 0.4, 4.0))
    tip = position(link_frames(model, (0.0, 0.0, 0.4, 0.0))[-1])
    assert tip == pytest.approx((0.1 + 0.1 + 0.01 + 0.2, 0.0, 0.2 + 0.2 + 0.2 + 0.2))


def test_slides_that_go_on_alike_are_one_joint(tmp_path: Path) -> None:
    """The file of a Stretch has its telescope as four of them."""
    model = loaded(tmp_path, telescope(""))
    assert model.origin is not None
    assert model.origin.joints == ("j1", "j2", "out", "roll")
    assert model.upper[2] == pytest.approx(0.4)
    assert "more slide as the joint before them does: a telescope, which is one joint" in model.origin.notes
    other = loaded(tmp_path, telescope("", axis="0 1 0").replace('<mimic joint="out" multiplier="-2"/>', ""))
    assert other.origin is not None
    assert other.joint_count == 6


@pytest.mark.parametrize(("leader", "axis"), [("j1", "1 0 0"), ("out", "0 1 0")])
def test_a_joint_that_follows_otherwise_is_refused(tmp_path: Path, leader: str, axis: str) -> None:
    with pytest.raises(FileDamaged, match=r"joint more: mimics another joint \(every joint of an arm moves by itself"):
        loaded(tmp_path, telescope(f'<mimic joint="{leader}"/>', axis))


def test_joints_that_all_follow_others_are_no_arm(tmp_path: Path) -> None:
    text = joint("a", "base", "b", mimic='<mimic joint="c"/>') + joint("c", "base", "d", mimic='<mimic joint="a"/>')
    with pytest.raises(FileDamaged, match="no joint moves between base and tip"):
        loaded(tmp_path, text)


def test_links_of_a_gear_beside_the_fingers_do_not_tell_how_wide_it_opens(tmp_path: Path) -> None:
    gear = "".join(
        joint(f"knuckle_{y}", "palm", f"knuckle_link_{y}", xyz=f"0 {y} 0", axis="1 0 0", mimic='<mimic joint="left"/>')
        for y in (0.2, -0.2)
    )
    assert loaded(tmp_path, arm(7) + PALM + LEFT + MIMIC + gear).hand_width == pytest.approx(0.08)


def pointing(axis: str) -> str:
    """An arm of six joints with a finger ahead of its tip."""
    return (
        arm(6) + joint("finger", "l6", "claw", xyz=axis, axis="0 0 1", limits=(0.0, 1.0)) + fixed("claw", "nail", axis)
    )


@pytest.mark.parametrize(
    ("xyz", "name", "angles"),
    [("0.1 0.02 0", "X", "90, 0, 0"), ("0 -0.1 0.05", "-Y", "0, 0, 90"), ("0 0 -0.1", "-Z", "90, 90, 180")],
)
def test_fingers_that_point_elsewhere_than_z_are_named(tmp_path: Path, xyz: str, name: str, angles: str) -> None:
    model = loaded(tmp_path, pointing(xyz))
    assert f"the fingers point along {name} of l6, but APPRO and DEPART go along its Z: " in told(model)[1]
    assert f"flange = [0, 0, 0, {angles}] in a TOML file" in told(model)[1]
    (tmp_path / "mine.toml").write_text(f'urdf = "little.urdf"\nflange = [0, 0, 5, {angles}]\n', encoding="utf-8")
    turned = load_robot(tmp_path / "mine.toml")
    assert len(told(turned)) == 1
    q = (0.1, -0.4, 0.3, 0.5, 0.2, 0.7)
    before, after = (link_frames(one, q)[-1] for one in (model, turned))
    x, y, z = map(float, xyz.split())
    ahead = (after.ax, after.ay, after.az)
    finger = position(compose(before, translation(x, y, z)))
    assert sum(a * (f - p) for a, f, p in zip(ahead, finger, position(before), strict=True)) > 0.08


def test_fingers_that_point_along_z_are_not_named(tmp_path: Path) -> None:
    assert len(told(loaded(tmp_path, pointing("0.02 0 0.1")))) == 1


def test_a_chain_as_long_as_a_file_may_be_is_read() -> None:
    tree = Tree("long.urdf", robot_element("long.urdf", f"<robot>{arm(MAX_FILE_JOINTS)}</robot>"))
    assert choice(tree, None, None).tip == f"l{MAX_FILE_JOINTS}"
    forked = arm(MAX_FILE_JOINTS // 2 - 1) + arm(MAX_FILE_JOINTS // 2, "l1", "other_")
    with pytest.raises(FileDamaged, match="several arms"):
        choice(Tree("forked.urdf", robot_element("forked.urdf", f"<robot>{forked}</robot>")), None, None)

"""Robot files: the PUMA's figures, plain data and back, and what is said of every kind of damage."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from math import degrees, pi, radians
from pathlib import Path

import pytest

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.kinematics.arm import arm_for
from vrs_cli.kinematics.configuration import ALL, NONE
from vrs_cli.kinematics.model import ROBOTS, Link, from_dict, load_robot, robot_names, to_dict
from vrs_cli.kinematics.transform import compose, rotation_z, translation

PUMA = load_robot("puma560")
TEXT = (ROBOTS / "puma560.toml").read_text(encoding="utf-8")


def test_the_puma_is_built_in() -> None:
    assert "puma560" in robot_names()
    assert load_robot("PUMA560") is PUMA
    assert load_robot(ROBOTS / "puma560.toml") == PUMA
    assert PUMA.joint_count == 6
    assert PUMA.links[1] == Link(0.4318, 0.14909, 0.0)
    assert [round(degrees(a)) for a in PUMA.lower] == [-160, -225, -45, -110, -100, -266]
    assert [round(degrees(a)) for a in PUMA.upper] == [160, 45, 225, 170, 100, 266]
    assert PUMA.poses["ready"] == tuple(map(radians, (0, -90, 90, 0, 0, 0)))
    assert PUMA.linear_speed == 0.5
    assert all(
        a == pytest.approx(v / 0.3, rel=2e-3) for v, a in zip(PUMA.max_velocity, PUMA.max_acceleration, strict=True)
    )


def test_nest_is_folded_and_keeps_the_configuration_of_ready() -> None:
    arm = arm_for(PUMA)
    assert arm.configuration(PUMA.poses["nest"]) == arm.configuration(PUMA.poses["ready"])
    T = arm.forward(PUMA.poses["nest"])
    assert T.az == pytest.approx(-1.0)
    assert T.pz < -0.4


def test_plain_data_gives_every_bit_back() -> None:
    data = json.loads(json.dumps(to_dict(PUMA)))
    assert from_dict(data) == PUMA
    assert to_dict(from_dict(data)) == data
    assert hash(from_dict(data)) == hash(PUMA)


def test_models_that_differ_have_different_arms() -> None:
    assert arm_for(PUMA) is arm_for(from_dict(to_dict(PUMA)))
    assert arm_for(replace(PUMA, upper=(1.0,) * 6)) is not arm_for(PUMA)


def test_a_wrist_that_is_not_spherical_is_solved_by_numbers() -> None:
    crooked = arm_for(replace(PUMA, links=(*PUMA.links[:4], Link(0.1, 0.0, pi / 2), PUMA.links[5])))
    assert crooked.ways == (NONE,)
    q = (0.1, -1.0, 1.2, 0.3, 0.5, -0.2)
    assert crooked.select(crooked.forward(q), (0.0, -1.1, 1.3, 0.2, 0.6, 0.0)) == pytest.approx(q, abs=1e-8)


def test_a_flange_beside_the_last_axis_is_still_a_spherical_wrist() -> None:
    beside = arm_for(replace(PUMA, links=(*PUMA.links[:5], Link(0.1, 0.05625, 0.0))))
    assert beside.ways == ALL
    q = (0.1, -1.0, 1.2, 0.3, 0.5, -0.2)
    assert beside.inverse_branch(beside.forward(q), beside.configuration(q), q) == pytest.approx(q, abs=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("alpha = -90.0", 'alpha = "x"', r"joint 1: alpha: 'x' is not a number \(give a number in deg\)"),
        ("alpha = -90.0", "alpha = true", r"joint 1: alpha: True is not a number"),
        ("alpha = -90.0", "alpha = nan", r"joint 1: alpha: nan is not a number"),
        ("alpha = -90.0", "alpha = inf", r"joint 1: alpha: inf is too large"),
        ("alpha = -90.0", f"alpha = {10**400}", r"joint 1: alpha: 1000.*is too large"),
        ("alpha = -90.0", "alpah = -90.0", r"joint 1: has an unknown key 'alpah' \(did you mean alpha\?\)"),
        ("alpha = -90.0", "colour = 1", r"joint 1: has an unknown key 'colour' \(known here: a, d,"),
        ("alpha = -90.0\n", "", r"joint 1: has no alpha \(give a, d, alpha"),
        ("lower = -160.0", "lower = 170", r"joint 1: lower 170 is not below upper 160.0"),
        ("max_velocity = 82.0", "max_velocity = 0", r"joint 1: max_velocity: 0 is not above zero \(.*deg/s"),
        ("linear_speed = 500.0", "linear_speed = -1", r"tool.linear_speed: -1 is not above zero \(.*mm/s"),
        ("linear_speed = 500.0\n", "", r"tool: has no linear_speed"),
        ("ready = [0.0,", "ready = [", r"poses.ready: is not a list of 6 numbers \(give the 6 joint values in deg"),
        ("ready = [0.0,", "ready = [161.0,", r"poses.ready: puts joint 1 at 161 deg \(its range is -160 to 160"),
        ("ready = [0.0,", 'ready = ["a",', r"poses.ready, joint 1: 'a' is not a number"),
        ("nest =", "rest =", r"poses.nest: is missing"),
        ('name = "puma560"', "name = 560", r"name: 560 is not a text"),
        ('name = "puma560"', 'name = " "', r"name: ' ' is not a text"),
        ('title = "Unimation PUMA 560"\n', "", r"the file: has no title"),
        ("[tool]", "[[tool]]", r"tool: is not a table"),
        ("[poses]", "[[poses]]", r"poses: is not a table"),
        ('title = "Unimation PUMA 560"', "title = ", r"Invalid value \(at line \d+, column \d+\).*TOML"),
    ],
)
def test_damage_is_said_with_file_and_key(tmp_path: Path, old: str, new: str, message: str) -> None:
    file = tmp_path / "mine.toml"
    assert old in TEXT
    file.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(FileDamaged, match=re.escape(str(file)) + ".*" + message):
        load_robot(file)


def test_frames_at_both_ends_and_zeros_of_joints(tmp_path: Path) -> None:
    file = tmp_path / "raised.toml"
    ends = "base = [0, 0, 500, 90, -90, 0]\nflange = [0, 0, 20, 90, -90, 90]\n\n"
    text = TEXT.replace("[[joints]]\n", ends + "[[joints]]\n", 1).replace("a = 431.8", "theta = -90\na = 431.8")
    file.write_text(text, encoding="utf-8")
    raised, q = arm_for(load_robot(file)), (0.1, 0.2, 1.5, 0.3, 0.5, -0.2)
    as_puma = (q[0], q[1] - pi / 2, *q[2:])
    expected = compose(translation(0.0, 0.0, 0.5), arm_for(PUMA).forward(as_puma))
    expected = compose(expected, compose(translation(0.0, 0.0, 0.02), rotation_z(pi / 2)))
    assert raised.forward(q) == pytest.approx(expected, abs=1e-12)
    assert raised.configuration(q) is arm_for(PUMA).configuration(as_puma)
    assert raised.inverse_branch(expected, raised.configuration(q), q) == pytest.approx(q, abs=1e-12)
    assert from_dict(to_dict(raised.model)) == raised.model


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[[joints]]", "base = [1, 2]\n[[joints]]", r"base: is not a list of 6 numbers \(give X, Y, Z, O, A, T"),
        ("a = 0.0", 'kind = "bent"\na = 0.0', r"joint 1: kind is 'bent' \(write \"revolute\" or \"prismatic\""),
        ("[[joints]]", "task = 6\n[[joints]]", r"task: 6 is none"),
    ],
)
def test_damage_of_what_may_be_left_out(tmp_path: Path, old: str, new: str, message: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(FileDamaged, match=message):
        load_robot(file)


def test_one_joint_is_no_arm() -> None:
    data = to_dict(PUMA)
    one = {**data, "joints": data["joints"][:1], "poses": {"ready": [0.0], "nest": [0.0]}}
    with pytest.raises(FileDamaged, match=r"there is one joint \(an arm has two at least"):
        from_dict(one)


def test_damage_in_plain_data_is_said_in_metres() -> None:
    data = to_dict(PUMA)
    data["tool"]["linear_speed"] = "fast"
    with pytest.raises(FileDamaged, match=r"header: tool.linear_speed: 'fast' is not a number .*m/s\)"):
        from_dict(data, "header")
    with pytest.raises(FileDamaged, match="joints: is not a list of joints"):
        from_dict({**to_dict(PUMA), "joints": []})
    with pytest.raises(FileDamaged, match="robot model: the file: is not a table"):
        from_dict(17)


def test_files_that_are_not_there_or_not_readable(tmp_path: Path) -> None:
    with pytest.raises(NonexistentFile, match=r"no robot is called 'puma' \(there is .*puma560.*; or .*\.toml"):
        load_robot("puma")
    with pytest.raises(NonexistentFile, match=r"none\.toml"):
        load_robot(tmp_path / "none.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(FileError, match=r"folder\.toml"):
        load_robot(tmp_path / "folder.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileDamaged, match="UTF-8"):
        load_robot(tmp_path / "bytes.toml")


@pytest.mark.parametrize("value", ["1e9", "inf"])
def test_a_figure_beyond_every_robot_is_called_too_large(tmp_path: Path, value: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(TEXT.replace("max_velocity = 82.0", f"max_velocity = {value}", 1), encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"joint 1: max_velocity: .* is too large \(give less than 1e\+09 deg/s\)"):
        load_robot(file)


def test_links_without_a_closed_form_are_an_arm_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "bent.toml"
    path.write_text(TEXT.replace("alpha = 90.0", "alpha = 80.0"))
    assert arm_for(load_robot(path)).method == "damped least squares within the limits"


def test_a_robot_may_name_its_profile(tmp_path: Path) -> None:
    smooth = tmp_path / "smooth.toml"
    smooth.write_text(TEXT.replace('name = "puma560"', 'name = "smooth"\nprofile = "SCURVE"'), encoding="utf-8")
    model = load_robot(smooth)
    assert (PUMA.profile, model.profile) == ("LSPB", "SCURVE")
    assert from_dict(to_dict(model)) == model
    smooth.write_text(TEXT.replace('name = "puma560"', 'name = "smooth"\nprofile = "SQUARE"'), encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"profile: 'SQUARE' is no profile.*LSPB, SCURVE"):
        load_robot(smooth)

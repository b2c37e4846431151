"""The robot model as plain data: there and back, and what is said of every kind of damage."""

from __future__ import annotations

import json
import re
from math import pi
from pathlib import Path

import pytest

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import ROBOTS, load_robot
from vrs_cli.kinematics.transform import compose, rotation_z, translation

PUMA = load_robot("puma560")
TEXT = Path(ROBOTS, "puma560.toml").read_text(encoding="utf-8")


def test_plain_data_gives_every_bit_back() -> None:
    data = json.loads(json.dumps(to_dict(PUMA)))
    assert from_dict(data) == PUMA
    assert to_dict(from_dict(data)) == data
    assert hash(from_dict(data)) == hash(PUMA)


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
        (
            "max_velocity = 82.0",
            "max_velocity = 5e-324",
            r"joint 1: max_velocity: 5e-324 is too small \(give at least 1e-09 deg/s",
        ),
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
        ("[[joints]]", 'task = "upright"\n[[joints]]', r"task: 'upright' is for arms whose flange keeps its direction"),
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


@pytest.mark.parametrize("value", ["1e9", "inf"])
def test_a_figure_beyond_every_robot_is_called_too_large(tmp_path: Path, value: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(TEXT.replace("max_velocity = 82.0", f"max_velocity = {value}", 1), encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"joint 1: max_velocity: .* is too large \(give less than 1e\+09 deg/s\)"):
        load_robot(file)


def test_a_robot_may_name_its_profile(tmp_path: Path) -> None:
    smooth = tmp_path / "smooth.toml"
    smooth.write_text(TEXT.replace('name = "puma560"', 'name = "smooth"\nprofile = "SCURVE"'), encoding="utf-8")
    model = load_robot(smooth)
    assert (PUMA.profile, model.profile) == ("LSPB", "SCURVE")
    assert from_dict(to_dict(model)) == model
    smooth.write_text(TEXT.replace('name = "puma560"', 'name = "smooth"\nprofile = "SQUARE"'), encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"profile: 'SQUARE' is no profile.*LSPB, SCURVE"):
        load_robot(smooth)


def test_a_joint_next_to_zero_is_said_to_be_at_zero() -> None:
    assert load_robot("puma560").joint_text(4, -1e-5, 0) == "0 deg"

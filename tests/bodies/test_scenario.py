"""Scenario files and the words that are typed while a body runs: what is read, and what is said of mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest

from vrs_cli.bodies.scenario import (
    BlockedJoint,
    ClockDrift,
    EmergencyStop,
    Payload,
    Push,
    Release,
    SlippingBrake,
    load_scenario,
    read_command,
)
from vrs_cli.errors import FileDamaged, NonexistentFile
from vrs_cli.kinematics.joints import JointKind

KINDS = (JointKind.REVOLUTE,) * 6
ALL = """
seed = 7

[[push]]
at = 2.0
for = 0.2
force = [0, 40, 0]

[[payload]]
at = 3.0
mass = 2
centre = [0, 0, 100]

[[block]]
at = 4.0
joint = 3

[[slip]]
at = 5.0
joint = 2
torque = 20

[[stop]]
at = 6.0
for = 5

[[drift]]
at = 7.0
rate = 1e-4
jump = -0.5
"""


def test_all_disturbances_of_a_file_are_read(tmp_path: Path) -> None:
    file = tmp_path / "all.toml"
    file.write_text(ALL)
    found = load_scenario(file, KINDS)
    assert found.seed == 7
    assert found.disturbances == (
        Push(at=2.0, lasting=0.2, force=(0.0, 40.0, 0.0)),
        Payload(at=3.0, mass=2.0, centre=(0.0, 0.0, 0.1)),
        BlockedJoint(at=4.0, joint=3),
        SlippingBrake(at=5.0, joint=2, torque=20.0),
        EmergencyStop(at=6.0, lasting=5.0),
        ClockDrift(at=7.0, rate=1e-4, jump=-0.5),
    )


def test_what_is_typed_is_read() -> None:
    assert read_command("push force = [0, 40, 0] for = 0.2", KINDS) == Push(lasting=0.2, force=(0.0, 40.0, 0.0))
    assert read_command(" push joint=2 torque=-5 at=3", KINDS) == Push(at=3.0, joint=2, torque=-5.0)
    assert read_command("payload mass=2, centre=[0,0,100]", KINDS) == Payload(mass=2.0, centre=(0.0, 0.0, 0.1))
    assert read_command("stop", KINDS) == EmergencyStop()
    assert read_command("release", KINDS) == Release()
    assert read_command("release block", KINDS) == Release(BlockedJoint)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("", "no word"),
        ("pusch", "push"),
        ("push", "pushes nothing"),
        ("push 40", "not read"),
        ("push force=[0,0", "not read"),
        ("push force=40", "list of 3 numbers"),
        ("push force=[0,0,1] force=[0,0,2]", "not read"),
        ("payload", "no mass"),
        ("payload mass=-1", "no mass"),
        ("payload mass=nan", "not a number"),
        ("block", "None is none of this robot"),
        ("block joint=7", "give 1 to 6"),
        ("block joint=2.0", "give 1 to 6"),
        ("block joint=2 for=-1", "not above zero"),
        ("slip joint=1 torque=-1", "below zero"),
        ("drift rate=1", "no clock"),
        ("stop joint=1", "unknown key"),
        ("release everything", "everything"),
    ],
)
def test_mistakes_get_one_message(line: str, told: str) -> None:
    with pytest.raises(FileDamaged) as found:
        read_command(line, KINDS)
    assert told in str(found.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[[push]]\nforce = [1, 0, 0]", "has no at"),
        ("[push]\nat = 1", "write [[push]]"),
        ("push = 3", "write [[push]]"),
        ("[[puhs]]\nat = 1", "unknown key"),
        ("seed = -1", "whole number"),
        ("seed = true", "whole number"),
        ("[[block]]\nat = 1\njoint = 9", "block 1: joint"),
        ("a = [", "TOML"),
        ("a = " + "[" * 5000, "TOML"),
    ],
)
def test_mistakes_of_a_file_name_it(text: str, told: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(text)
    with pytest.raises(FileDamaged) as found:
        load_scenario(file, KINDS)
    assert told in str(found.value)
    assert "bad.toml" in str(found.value)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(NonexistentFile):
        load_scenario(tmp_path / "none.toml", KINDS)

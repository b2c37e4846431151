"""Robots that are built in, and files."""

from __future__ import annotations

from math import degrees, radians
from pathlib import Path

import pytest

from tests.examples import some
from tests.kinematics.robot_texts import robot_text
from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, VrsError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import Link
from vrs_cli.kinematics.robot_file import ROBOTS, load_robot, robot_names

PUMA = load_robot("puma560")
MESSAGE = 1000  # characters


def test_the_puma_is_built_in() -> None:
    assert "puma560" in robot_names()
    assert load_robot("PUMA560") is PUMA
    assert load_robot(Path(ROBOTS, "puma560.toml")) == PUMA
    assert PUMA.joint_count == 6
    assert PUMA.links[1] == Link(0.4318, 0.14909, 0.0)
    assert [round(degrees(a)) for a in PUMA.lower] == [-160, -225, -45, -110, -100, -266]
    assert [round(degrees(a)) for a in PUMA.upper] == [160, 45, 225, 170, 100, 266]
    assert PUMA.poses["ready"] == tuple(map(radians, (0, -90, 90, 0, 0, 0)))
    assert PUMA.linear_speed == 0.5
    assert all(
        a == pytest.approx(v / 0.3, rel=2e-3) for v, a in zip(PUMA.max_velocity, PUMA.max_acceleration, strict=True)
    )


def test_files_that_are_not_there_or_not_readable(tmp_path: Path) -> None:
    with pytest.raises(NonexistentFile, match=r"no robot is called 'puma' \(there is .*puma560.*; or .*\.toml"):
        load_robot("puma")
    with pytest.raises(NonexistentFile, match=r"none\.toml"):
        load_robot(tmp_path / "none.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(FileError, match=r"folder\.toml"):
        load_robot(tmp_path / "folder.toml")
    (tmp_path / "digits.toml").write_text(f"joints = {'1' * 5000}", encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"digits\.toml"):
        load_robot(tmp_path / "digits.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileDamaged, match="UTF-8"):
        load_robot(tmp_path / "bytes.toml")


@pytest.mark.parametrize("part", range(4))
def test_a_damaged_file_is_a_robot_or_has_one_clear_message(tmp_path: Path, part: int) -> None:
    path, refused = tmp_path / "arm.toml", 0
    for seed in range(part, some(1000), 4):
        path.write_text(robot_text(seed), encoding="utf-8")
        try:
            arm = arm_for(load_robot(path))
        except VrsError as error:
            refused += 1
            said = f"{error} {error.hint}"
            assert path.parent.name in said, seed
            assert said.isprintable(), seed
            assert len(said) < MESSAGE, seed
        else:
            arm.branches(arm.forward(arm.model.poses["ready"]))
    assert refused > 10


@pytest.mark.parametrize("name", ["\0.toml", "\0", f"{'A' * 5000}.toml", "\udce4.urdf", "loop.toml"])
def test_a_name_that_no_file_can_have(tmp_path: Path, name: str) -> None:
    (tmp_path / "loop.toml").symlink_to(tmp_path / "loop.toml")
    with pytest.raises(FileError) as caught:
        load_robot(tmp_path / name)
    assert len(str(caught.value)) < MESSAGE + 5000

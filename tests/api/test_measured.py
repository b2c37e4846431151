"""`r.report` and `r.measured`: the measured robot in Python, in the units of the robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import vrs_cli as vrs
from vrs_cli.errors import IllegalValue

HERE = np.array([1.0, -45.0, 180.0, 0.0, 45.0, 0.0])


def test_reports_are_read_in_the_units_of_the_robot() -> None:
    robot = vrs.Robot("puma560")
    before = robot.measured
    assert (len(before), before.unknown_since, before.at(0.0)) == (0, None, None)
    robot.report(1.0, HERE, np.full(6, 10.0), np.arange(6.0), mode="holds").report(1.5, HERE + 5.0, np.full(6, 10.0))
    seen = robot.measured
    assert (len(before), len(seen), seen.unknown_since) == (0, 2, 1.5)
    assert seen.at(1.25) == pytest.approx(HERE + 2.5)
    assert seen.at(1.5000001) is None
    several = seen.at([0.5, 1.0, 1.5])
    assert several is not None
    assert np.isnan(several[0]).all()
    assert several[1:] == pytest.approx(np.array([HERE, HERE + 5.0]))
    assert seen.times.tolist() == [1.0, 1.5]
    assert seen.joints == pytest.approx(np.array([HERE, HERE + 5.0]))
    assert seen.velocity == pytest.approx(np.full((2, 6), 10.0), rel=1e-6)
    assert seen.effort[0].tolist() == list(range(6))
    assert np.isnan(seen.effort[1]).all()
    assert seen.modes == ("holds", "follows")
    assert robot.in_units("SI").measured.at(1.0) == pytest.approx(np.radians(HERE))


def test_undo_leaves_the_record_and_a_file_keeps_it(tmp_path: Path) -> None:
    robot = vrs.Robot("puma560").move(HERE)
    robot.report(0.5, HERE).report(0.25, HERE + 1.0)
    robot.undo()
    robot.save(tmp_path / "day.vrst")
    again = vrs.load(tmp_path / "day.vrst").measured
    assert again.timeline == robot.measured.timeline
    assert again.times.tolist() == [0.25, 0.5]


def test_what_is_no_report_is_refused() -> None:
    robot = vrs.Robot("puma560")
    with pytest.raises(ValueError, match="mode: follows, holds, stopped are known, not 'sleeps'"):
        robot.report(0.0, HERE, mode="sleeps")
    with pytest.raises(ValueError, match="velocity"):
        robot.report(0.0, HERE, [1.0, 2.0])
    with pytest.raises(ValueError, match="velocity: one row"):
        robot.report(0.0, HERE, np.zeros((2, 6)))
    with pytest.raises(IllegalValue, match="time 1e\\+09 s"):
        robot.report(1e9, HERE)
    assert len(robot.measured) == 0

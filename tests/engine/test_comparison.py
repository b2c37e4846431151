"""Tests of the comparison of two courses of events, against results computed by hand."""

from __future__ import annotations

from itertools import combinations
from math import radians

import numpy as np
import pytest

from tests.engine.test_branches import MODEL, drive
from tests.files.trajectories import initial, planned
from vrs_cli.engine.branches import MAIN, Branches
from vrs_cli.engine.comparison import compare, first_difference
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import positions_at
from vrs_cli.trajectory.timeline import Timeline


@pytest.fixture
def branches() -> Branches:
    engine = Engine(MODEL)
    engine.perform(drive(1, 60))
    engine.perform(drive(2, 10))
    branches = Branches(engine)
    branches.make("trial")
    return branches


def test_the_same_is_the_same(branches: Branches) -> None:
    told = compare(branches.engine.arm, branches.book(MAIN), branches.book("trial"))
    assert told.since is None
    assert told.a == told.b
    assert (told.tool.distance, told.joints.distance) == (0.0, 0.0)
    assert all(pair.a == pair.b for pair in told.commands)


def test_how_long_and_how_far(branches: Branches) -> None:
    engine = branches.engine
    end = engine.end
    engine.perform(drive(6, 45))
    told = compare(engine.arm, branches.book(MAIN), branches.book("trial"))
    assert (told.a.duration, told.b.duration) == (end, engine.end)
    assert (told.a.commands, told.b.commands) == (2, 3)
    assert told.b.segments == len(engine.timeline) - 1
    assert told.a.joint_travel == pytest.approx(radians(70), rel=1e-12)
    assert told.b.joint_travel == pytest.approx(radians(115), rel=1e-12)
    assert told.since == end
    assert (told.joints.joint, told.joints.distance) == (6, pytest.approx(radians(45)))
    assert told.joints.time == pytest.approx(engine.end, abs=1e-5)


def test_the_tool_path_of_one_joint_is_its_arc() -> None:
    engine = Engine(MODEL)
    branches = Branches(engine)
    branches.make("trial")
    engine.perform(drive(1, 90))
    x, y = (engine.position().T_world_tool[i] for i in (3, 7))
    told = compare(engine.arm, branches.book(MAIN), branches.book("trial"))
    assert told.b.tool_path == pytest.approx(radians(90) * (x * x + y * y) ** 0.5, rel=1e-3)
    assert told.a.tool_path == 0.0


def test_the_greatest_distance_is_found_between_samples(branches: Branches) -> None:
    engine = branches.engine
    engine.perform(drive(3, -20, at=0.45))
    a, b = branches.book(MAIN), branches.book("trial")
    told = compare(engine.arm, a, b)
    times = np.linspace(0.0, max(a.timeline.end, b.timeline.end), 100_001)
    p, q = (positions_at(engine.arm, line.timeline, times) for line in (a, b))
    tool = np.linalg.norm(p.T_world_tool[:, :, 3] - q.T_world_tool[:, :, 3], axis=1).max()
    joints = np.abs(p.joints - q.joints).max()
    assert told.tool.distance == pytest.approx(tool, rel=1e-6)
    assert told.tool.distance >= tool - 1e-9
    assert told.joints.distance == pytest.approx(joints, rel=1e-6)
    differ = times[np.abs(p.joints - q.joints).max(axis=1) > 1e-12]
    assert told.since is not None
    assert told.since <= differ[0] <= told.since + 0.01


def test_commands_are_paired_and_dropped_ones_told(branches: Branches) -> None:
    engine = branches.engine
    engine.undo()
    engine.perform(drive(4, 10))
    told = compare(engine.arm, branches.book(MAIN), branches.book("trial"))
    texts = [(pair.a and pair.a.text, pair.b and pair.b.text) for pair in told.commands]
    assert texts == [("DRIVE 1", "DRIVE 1"), ("DRIVE 2", None), (None, "DRIVE 4")]


def test_the_first_difference_is_the_time_of_the_edit(branches: Branches) -> None:
    engine = branches.engine
    engine.perform(drive(3, -20, at=0.5))
    assert first_difference(branches.book(MAIN).timeline, engine.timeline) == 0.5


def test_the_first_difference_is_that_of_all_segments_one_by_one() -> None:
    timeline, deltas = planned(60, seed=5)
    versions = [Timeline([initial()])]
    for delta in deltas:
        versions.append(versions[-1].apply(delta))
    assert versions[-1] == timeline
    for a, b in combinations(versions[::3], 2):
        alone = (Timeline(a), Timeline(b))  # with rows of their own, nothing is shared
        assert first_difference(a, b) == first_difference(*alone) == first_difference(b, a)
        assert first_difference(a, alone[0]) is None

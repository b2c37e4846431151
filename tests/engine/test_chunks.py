"""Tests of chunks of time-stamped joints: whatever they ask, limits are kept, and what can be followed is followed."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.engine.wall import ManualWall
from tests.examples import examples
from tests.laws.motion_laws import check_continuous, check_limits
from vrs_cli.engine.book import whole
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_at
from vrs_cli.engine.steering import MAX_SAMPLES, Chunk
from vrs_cli.errors import IllegalValue, MotionError, TooLate
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import JointTarget, Move, SetParameter

MODELS = {name: load_robot(name) for name in ("puma560", "cobra600", "planar2")}


def waves(model: RobotModel, start: Joints, times: np.ndarray, size: float, rate: float) -> list[Joints]:
    """Return joints that leave `start` slowly and swing by a part of each range."""
    span = np.minimum(np.array(start) - model.lower, np.array(model.upper) - start)
    swing = 0.5 * (1.0 - np.cos(rate * (times - times[0])))
    return [tuple(row) for row in (np.array(start) + size * span * swing[:, None]).tolist()]


@pytest.mark.parametrize("name", MODELS)
@examples(25)
@given(
    st.sampled_from(["LSPB", "SCURVE", "QUINTIC"]),
    st.floats(0.0, 1.5),
    st.floats(0.0, 0.8),
    st.lists(
        st.tuples(st.floats(0.001, 0.3), st.lists(st.floats(-0.2, 1.2), min_size=6, max_size=6)),
        min_size=1,
        max_size=12,
    ),
)
def test_any_chunk_keeps_the_laws_and_ends_at_its_last_sample(
    name: str, profile: str, begin: float, earlier: float, samples: list[tuple[float, list[float]]]
) -> None:
    model = MODELS[name]
    engine = Engine(model)
    engine.perform(SetParameter("PROFILE", profile))
    engine.perform(
        Move(JointTarget(tuple(0.5 * (a + b) for a, b in zip(model.lower, model.upper, strict=True))), False),
        program=True,
    )
    before = engine.timeline
    times = (begin + np.cumsum([gap for gap, _ in samples])).tolist()
    rows = [
        tuple(low + (high - low) * f for f, low, high in zip(parts, model.lower, model.upper, strict=False))
        for _, parts in samples
    ]
    whole(engine.follow(Chunk(model, times, rows)))
    second = max(times[0] - earlier, 0.0)
    for k, chunk in enumerate((Chunk(model, times, rows), Chunk(model, [second, second + 0.1], [rows[-1], rows[0]]))):
        try:
            followed = whole(engine.follow(chunk))
        except MotionError:
            continue  # a motion under way that has no room to stop
        check_continuous(engine, engine.timeline)
        check_limits(engine, engine.timeline)
        here = engine.position(followed.end).joints
        low, high = np.array(model.lower), np.array(model.upper)
        assert (np.array(here) >= low - 1e-9).all()
        assert (np.array(here) <= high + 1e-9).all()
        if not k and not followed.held:
            assert np.abs(np.array(here) - chunk.joints[-1]).max() < 1e-9
    engine.undo(len(engine.book.history.done) - 1)
    assert engine.timeline == before


def test_the_last_sample_is_met_where_ticks_end_before_it() -> None:
    model = MODELS["planar2"]
    engine, (low, _), (lowest, high) = Engine(model), *zip(model.lower, model.upper, strict=True)
    for _ in range(2):
        chunk = Chunk(model, [0.25, 0.375], [(low, high), (low, lowest)])
        followed = whole(engine.follow(chunk))
        assert engine.position(followed.end).joints == pytest.approx((low, lowest), abs=1e-9)
        check_limits(engine, engine.timeline)


@pytest.mark.parametrize("name", MODELS)
def test_what_can_be_met_is_followed_closely(name: str) -> None:
    engine = Engine(MODELS[name])
    times = np.arange(0.5, 4.0, 0.02)
    rows = waves(engine.model, engine.position().joints, times, 0.2, 1.5)
    followed = whole(engine.follow(Chunk(engine.model, times.tolist(), rows)))
    assert max(followed.mean) < radians(0.2)
    assert max(followed.worst) < radians(0.5)
    assert (followed.begin, followed.late, followed.held) == (pytest.approx(0.5), 0, 0)
    assert engine.now == followed.end


def test_a_chunk_takes_the_place_of_the_rest_of_the_one_before() -> None:
    engine = Engine(MODELS["puma560"], clock=WallClock(wall := ManualWall(), wall.sleep))
    times = np.arange(0.0, 2.0, 0.02)
    rows = waves(engine.model, engine.position().joints, times, 0.2, 1.5)
    whole(engine.follow(Chunk(engine.model, times.tolist(), rows)))
    first = engine.timeline
    wall.sleep(0.705)
    engine.clock.advance(engine.clock.reached)
    followed = whole(engine.follow(Chunk(engine.model, times[25:75].tolist(), rows[25:75])))
    assert followed.late == 11
    assert followed.begin == pytest.approx(0.705, abs=1e-6)
    for t in (0.1, 0.35, 0.704):
        assert joints_at(engine.arm, engine.timeline, t) == joints_at(engine.arm, first, t)
    assert max(followed.worst) < radians(0.5)
    check_continuous(engine, engine.timeline)
    with pytest.raises(TooLate, match="all 5 samples have passed"):
        whole(engine.follow(Chunk(engine.model, times[:5].tolist(), rows[:5])))


def long_chunk(engine: Engine) -> Chunk:
    """Make a chunk of several parts."""
    times = np.arange(0.5, 5.0, 0.02)
    return Chunk(engine.model, times.tolist(), waves(engine.model, engine.position().joints, times, 0.2, 1.5))


def test_a_chunk_that_is_planned_in_parts_is_that_of_one_part(monkeypatch: pytest.MonkeyPatch) -> None:
    parts, one = Engine(MODELS["puma560"]), Engine(MODELS["puma560"])
    before = parts.timeline
    whole(parts.follow(long_chunk(parts)))
    monkeypatch.setattr("vrs_cli.engine.steering.TICKS_AT_ONCE", 10**6)
    whole(one.follow(long_chunk(one)))
    assert len(parts.book.deltas) > len(one.book.deltas) == 1
    for t in np.arange(0.0, one.end + 0.1, 0.013):
        assert joints_at(parts.arm, parts.timeline, float(t)) == joints_at(one.arm, one.timeline, float(t))
    assert parts.end == one.end
    assert len(parts.book.history.done) == 1
    parts.undo(1)
    assert parts.timeline == before


def test_what_else_moves_the_robot_ends_a_chunk_that_is_planned() -> None:
    engine = Engine(MODELS["puma560"], clock=WallClock(wall := ManualWall(), wall.sleep))
    work = engine.follow(long_chunk(engine))
    next(work)
    wall.sleep(0.8)
    engine.clock.advance(engine.clock.reached)
    engine.stop()
    stopped = engine.timeline
    with pytest.raises(MotionError, match="was changed while the chunk was planned"):
        next(work)
    assert engine.timeline is stopped
    check_limits(engine, engine.timeline)


def test_parts_that_come_late_go_on_from_now() -> None:
    engine = Engine(MODELS["puma560"], clock=WallClock(wall := ManualWall(), wall.sleep))
    work = engine.follow(long_chunk(engine))
    next(work)
    first = engine.timeline
    wall.sleep(2.2)  # the first part ends at 1.3 s
    engine.clock.advance(engine.clock.reached)
    whole(work)
    for t in (0.6, 1.2, 1.7, 2.19):
        assert joints_at(engine.arm, engine.timeline, t) == joints_at(engine.arm, first, t)
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)
    assert engine.end > 4.9


def test_a_jump_is_approached_inside_the_limits() -> None:
    engine = Engine(MODELS["puma560"])
    here = engine.position().joints
    far = (here[0] + 1.0, *here[1:])
    followed = whole(engine.follow(Chunk(engine.model, [1.0, 1.02, 1.04], [here, far, far])))
    assert followed.worst[0] > 0.9
    assert followed.end > 1.5
    check_limits(engine, engine.timeline)
    assert engine.position(followed.end).joints == pytest.approx(far, abs=1e-9)


READY = MODELS["puma560"].poses["ready"]


@pytest.mark.parametrize(
    ("times", "joints", "said"),
    [
        ([], [], "a chunk of 0 samples"),
        ([0.0] * (MAX_SAMPLES + 1), [READY] * (MAX_SAMPLES + 1), f"a chunk of {MAX_SAMPLES + 1} samples"),
        ([0.0, 1.0], [READY], "2 times, and 1 sets of joints"),
        ([0.0], [(1.0, 2.0)], "sample 0 of 2 joints"),
        ([0.0, 0.0], [READY, READY], "sample 1 at 0 s, not after 0 s"),
        ([0.0, float("nan")], [READY, READY], "sample 1: a number that is not finite"),
        ([0.0, 500.0], [READY, READY], "a chunk from 0 to 500 s"),
    ],
)  # fmt: skip
def test_what_is_no_chunk_is_refused(times: list[float], joints: list[Joints], said: str) -> None:
    with pytest.raises(IllegalValue, match=said):
        Chunk(MODELS["puma560"], times, joints)

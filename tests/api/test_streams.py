"""Robots that steer to joints and whose tool is dragged, target by target: of this process and of a server."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import numpy as np
import pytest

import vrs_cli as vrs
from vrs_cli.errors import JointOutOfRange, RequestRefused

New = Callable[[], vrs.Robot]
READY = np.array([0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
DOWN = (0, -45, 180, 0, 45, 0)


def circle(k: int) -> np.ndarray:
    return READY + np.array([20.0 * np.sin(0.02 * k), 10.0 - 10.0 * np.cos(0.02 * k), 0, 0, 0, 0])


def test_steering_follows_the_targets_and_rests_at_the_last(new: New) -> None:
    r = new()
    for k in range(100):
        r.steer(circle(k))
        if k > 10:
            assert np.abs(r.joints - circle(k)).max() < 0.5
    assert r.now == pytest.approx(2.0, abs=1e-6)
    assert np.abs(r.where(np.linspace(0.0, r.now, 400)).velocity).max() < 60.0, "it does not stop between targets"
    assert np.allclose(r.wait().joints, circle(99), atol=1e-9)
    assert [one.text for one in r.commands] == ["STEER"] * 3, "the first, those that follow, the last"


def test_steering_keeps_the_limits_of_the_robot(new: New) -> None:
    r = new()
    for k in range(60):
        r.steer(READY + np.array([100.0 * (k // 10 % 2), 0, 0, 0, 0, 0]), rate=100)
    r.wait()
    seen = r.sample(500)
    assert (np.abs(seen.velocity) <= r.model.max_velocity + 1e-6).all()
    assert (np.abs(seen.acceleration) <= r.model.max_acceleration + 1e-6).all()


def test_one_target_is_a_motion_there(new: New) -> None:
    r = new().steer(*DOWN).wait()
    assert r.joints.tolist() == pytest.approx(DOWN)
    assert len(r.commands) == 1


def test_a_target_takes_the_place_of_motions(new: New) -> None:
    r = new().move(*DOWN)
    r.steer(READY + 5.0).wait()
    assert np.allclose(r.joints, READY + 5.0)
    r.steer(READY)
    r.move(*DOWN).wait()
    assert r.joints.tolist() == pytest.approx(DOWN), "the target before is not gone to"


def test_steering_speaks_the_units_of_the_robot(new: New) -> None:
    r = new().in_units("SI")
    r.steer(np.radians(READY + 3.0), speed=50).wait()
    assert np.allclose(r.joints, np.radians(READY + 3.0))
    assert np.abs(r.sample().velocity).max() <= 0.5 * r.model.max_velocity.max()


def test_targets_need_not_be_waited_for(new: New) -> None:
    r = new()
    with r.without_waiting():
        for k in range(20):
            r.steer(circle(k))
    assert np.allclose(r.wait().joints, circle(19), atol=1e-9)
    with pytest.raises(JointOutOfRange), r.without_waiting():
        r.steer(999, 0, 0, 0, 0, 0)


def test_what_is_no_target_is_refused_and_ends_the_stream(new: New) -> None:
    r = new()
    r.steer(circle(1)).steer(circle(2))
    with pytest.raises(JointOutOfRange, match="Joint 1"):
        r.steer(200, 0, 0, 0, 0, 0)
    with pytest.raises(ValueError, match="shape"):
        r.steer(1, 2, 3)
    with pytest.raises(TypeError, match="drag takes a location"):
        r.steer(vrs.trans(0, 450, 0))
    for rate in (0.0, 1.0, 1001.0, inf):
        with pytest.raises(ValueError, match="rate"):
            r.steer(READY, rate=rate)
    with pytest.raises(ValueError, match="speed"):
        r.steer(READY, speed=101)
    with pytest.raises(TypeError, match="location: a Location is wanted"):
        r.drag(READY)


def test_who_stops_the_robot_is_not_steered_over(new: New) -> None:
    """A loop that sends on would make another user's stop useless."""
    r = new()
    r.steer(circle(1)).steer(circle(2))
    r.held.abort()  # as another thread or user does
    with pytest.raises(RequestRefused, match="steers no longer"):
        r.steer(circle(3))
    r.steer(circle(4)).wait()
    assert np.allclose(r.joints, circle(4))
    r.steer(circle(5)).steer(circle(6)).abort().steer(circle(7)).wait()
    assert np.allclose(r.joints, circle(7)), "who stops it may go on"


def test_a_dragged_tool_follows_and_rests_at_the_last_target(new: New) -> None:
    r = new().move(*DOWN).wait()
    begin, since = r.where().location, r.now
    for k in range(50):
        held = r.drag(vrs.trans(k, 0, -k) @ begin)
        assert not held.held
    assert r.now == pytest.approx(since + 1.0, abs=1e-4)
    assert np.allclose(r.wait().where().xyz, begin.xyz + np.array([49, 0, -49]), atol=1e-3)
    assert [one.text for one in r.commands][-1] == "DRAG"
    r.undo()
    assert np.allclose(r.where(r.end).xyz, begin.xyz), "all of it is one command"


def test_a_matrix_is_a_target(new: New) -> None:
    r = new().move(*DOWN).wait()
    T = np.array(r.where().location.matrix)
    T[0, 3] += 0.02
    r.drag(T)
    assert np.allclose(r.wait().where().location.matrix, T, atol=1e-6)


def test_out_of_reach_the_tool_says_what_holds_it(new: New) -> None:
    r = new().move(*DOWN).wait()
    far = vrs.trans(2000, 0, 0) @ r.where().location
    for _ in range(300):
        held = r.drag(far)
    assert held.held
    assert held.limits == ("out of reach: too far",)
    assert held.distance == pytest.approx(float(np.linalg.norm(r.where().xyz - far.xyz)))
    assert repr(held).startswith("<Dragged: ")
    metres = r.in_units("SI").drag(far.matrix)
    assert metres.distance == pytest.approx(held.distance / 1000.0, rel=1e-3)
    r.wait()
    assert r.end <= r.now + 1e-9


def test_a_drag_begins_anew_after_other_motions_and_after_a_stop(new: New) -> None:
    r = new().move(*DOWN).wait()
    begin = r.where().location
    r.drag(vrs.trans(10, 0, 0) @ begin)
    r.move(*DOWN).wait()
    r.drag(vrs.trans(20, 0, 0) @ begin)
    assert np.allclose(r.wait().where().xyz, begin.xyz + np.array([20, 0, 0]), atol=1e-3)
    r.drag(begin)
    r.held.abort()
    with pytest.raises(RequestRefused, match="the tool was let go: something else has moved or stopped the robot"):
        r.drag(begin)
    r.drag(begin)
    assert np.allclose(r.wait().where().xyz, begin.xyz, atol=1e-3)
    r.drag(vrs.trans(20, 0, 0) @ begin)
    r.abort().drag(begin)
    assert np.allclose(r.wait().where().xyz, begin.xyz, atol=1e-3)


def test_in_real_time_targets_take_their_time() -> None:
    r = vrs.Robot(realtime=20.0)
    since = r.now
    for k in range(100):
        r.steer(circle(k))
    assert r.now - since >= 1.98
    assert np.allclose(r.wait().joints, circle(99), atol=1e-9)
    begin = r.where().location
    for k in range(20):
        r.drag(vrs.trans(0, 0, -k) @ begin)
    assert np.allclose(r.wait().where().xyz, begin.xyz - [0, 0, 19], atol=1e-2)

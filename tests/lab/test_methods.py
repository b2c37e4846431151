"""Test viewers and controllers of users: their inputs, their scores, and the messages about failures."""

from __future__ import annotations

from math import pi
from pathlib import Path
from random import Random

import numpy as np
import pytest

from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.lab.bench import FOLLOWED, SCENARIOS, MethodTrial, _Bench, goals, method_outcome
from vrs_cli.lab.methods import (
    CONTROLLERS,
    VIEWERS,
    Extrapolated,
    Guarded,
    MethodError,
    MoveAndWait,
    Predictor,
    RemoteController,
    load_method,
)
from vrs_cli.net.delay_line import Constant, Delays, DelayWays, Gamma

ROBOT = load_robot("puma560")
EXAMPLE = str(Path(__file__).parents[2] / "examples" / "10_predictor.py") + ":DoubleExponential"
NONE = Constant(0.0)

HEAD = "class {name}:\n    def __init__(self, robot, delay): self.n = robot.joint_count\n"
RECEIVE = "    def receive(self, t, joints): self.joints = joints\n"
PREDICT = "    def predict(self, t): {body}\n"


def trial(
    scenario: str = "waves",
    forward: Delays = NONE,
    backward: Delays = NONE,
    controller: str = "direct",
    viewers: tuple[str, ...] = (*VIEWERS,),
) -> MethodTrial:
    return MethodTrial(ROBOT, DelayWays(forward, backward, 3), scenario, controller, viewers, 8.0, 25.0)


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_without_delays_every_viewer_sees_the_robot(scenario: str) -> None:
    found = method_outcome(trial(scenario)).viewers
    assert {*found} == {"frames", "extrapolated", "timeline"}
    assert max(it.most for it in found.values()) < 1e-9
    assert max(it.jump for it in found.values()) < 1e-9


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_the_last_frame_is_the_robot_as_it_was_a_delay_ago(scenario: str) -> None:
    bench = _Bench(trial(scenario, NONE, Constant(0.19)))
    bench.run()
    score = bench.viewer_scores()["frames"]
    g = [bench.robot.position(t).joints for t in bench.looks.tolist()]
    apart = np.degrees(np.abs(np.array(g[5:]) - np.array(g[:-5])).max(axis=1))
    assert score.mean == pytest.approx(apart.mean(), abs=1e-9)
    assert score.most == pytest.approx(apart.max(), abs=1e-9)
    assert score.most > 5.0


def test_who_has_the_timeline_sees_what_was_commanded_ahead() -> None:
    found = method_outcome(trial("moves", Constant(0.1), Constant(0.2))).viewers
    assert found["timeline"].most == 0.0, "a lead of 0.4 s is more than 0.3 s"
    assert found["extrapolated"].most > 5.0


@pytest.mark.parametrize("scenario", FOLLOWED)
def test_goals_are_inside_the_ranges_and_those_of_the_seed(scenario: str) -> None:
    times = np.arange(0.0, 20.0, 0.04)
    found = goals(scenario, ROBOT, times, Random(1))
    assert (found >= ROBOT.lower).all()
    assert (found <= ROBOT.upper).all()
    assert (found == goals(scenario, ROBOT, times, Random(1))).all()
    assert (found != goals(scenario, ROBOT, times, Random(2))).any()
    if scenario != "steps":
        assert (np.abs(np.diff(found, axis=0)) / 0.04 <= 0.31 * np.array(ROBOT.max_velocity)).all()


def test_a_controller_that_looks_ahead_makes_up_for_the_way_there() -> None:
    lags = {}
    for name in CONTROLLERS:
        score = method_outcome(trial("waves", Constant(0.2), Constant(0.2), name, ())).controller
        assert score is not None
        lags[name] = score.lag
    assert lags["ahead"] + 0.1 < lags["direct"] < lags["wait"]
    assert lags["direct"] >= 0.2, "the way there"


def test_equal_trials_have_equal_results() -> None:
    one = trial("stops", Gamma(0.2, 0.08), Gamma(0.2, 0.08))
    assert method_outcome(one) == method_outcome(one)


def test_the_example_is_better_than_the_last_frame() -> None:
    found = method_outcome(trial("waves", NONE, Constant(0.2), viewers=("frames", EXAMPLE))).viewers
    assert found[EXAMPLE].mean < 0.7 * found["frames"].mean
    assert found[EXAMPLE].call_time > 0.0


def test_frames_come_in_order_and_before_they_are_asked_for() -> None:
    heard: list[tuple[str, float]] = []

    class Listener(Extrapolated):
        def receive(self, t: float, joints: Floats) -> None:
            heard.append(("frame", t))
            super().receive(t, joints)

        def predict(self, t: float) -> Floats:
            heard.append(("look", t))
            return super().predict(t)

    bench = _Bench(trial("waves", Gamma(0.1, 0.05), Gamma(0.3, 0.2)))
    bench.run()
    viewer = Guarded("frames", Predictor, ROBOT, 0.2, 25.0)
    viewer._method = Listener(ROBOT, 0.2)
    first = int(np.searchsorted(bench.looks, bench.arrived[0]))
    bench._viewer_joints(viewer, np.zeros((len(bench.looks), 6)), first)
    frames = [t for what, t in heard if what == "frame"]
    assert frames == bench.looks[: len(frames)].tolist()
    known = -1
    for what, t in heard:
        if what == "frame":
            known += 1
        else:
            assert known == np.searchsorted(bench.arrived, t, side="right") - 1


def test_move_and_wait_sends_one_goal_until_the_robot_was_seen_there() -> None:
    method = MoveAndWait(ROBOT, 0.2)
    first, second = np.zeros(6), np.full(6, 0.5)
    assert (method.command(0.0, first) == first).all()
    method.receive(0.1, np.full(6, 0.1))
    assert (method.command(0.2, second) == first).all()
    method.receive(0.3, np.full(6, 0.001))
    assert (method.command(0.4, second) == second).all()


# --- classes that fail -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return 1 / 0", "predict(0.000) raised ZeroDivisionError: division by zero (mine.py:4)"),
        ("return self.joints[:3]", "predict(0.000) returned an array of shape (3,) (the shape is (6,))"),
        ("return self.joints * float('nan')", "predict(0.000) returned nan for joint 1 (return finite numbers)"),
        ("return 'x' * 200", "predict(0.000) returned 'xxxx"),
        ("return None", "predict(0.000) returned an array of shape ()"),
        ("return object()", "predict(0.000) returned <object object"),
        ("raise SystemExit(3)", "predict(0.000) ended the process (return instead)"),
        ("return [1j] * self.n", "predict(0.000) returned [1j"),
    ],
)
def test_what_is_wrong_with_an_answer_is_told(body: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(HEAD.format(name="Mine") + RECEIVE + PREDICT.format(body=body))
    with pytest.raises(MethodError) as told:
        method_outcome(trial(viewers=(f"{path}:Mine",)))
    text = str(told.value)
    assert f"{path}:Mine: {said}" in text
    assert "\n" not in text


def test_a_method_that_is_slow_or_hangs_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "mine.py"
    path.write_text(HEAD.format(name="Hangs") + RECEIVE + "    def predict(self, t):\n        while True: pass\n")
    monkeypatch.setattr("vrs_cli.lab.methods.MAX_CALL", 0.05)
    with pytest.raises(MethodError, match=r"takes longer than 0\.05 s"):
        method_outcome(trial(viewers=(f"{path}:Hangs",)))
    ticks = iter(range(10_000))
    monkeypatch.setattr("vrs_cli.lab.methods.perf_counter", lambda: 0.1 * next(ticks))
    path.write_text(HEAD.format(name="Slow") + RECEIVE + PREDICT.format(body="return self.joints"))
    with pytest.raises(MethodError, match=r"it takes 100 ms a call \(at 25 Hz it has 40 ms\)"):
        method_outcome(trial(viewers=(f"{path}:Slow",)))


@pytest.mark.parametrize(
    ("text", "content", "said"),
    [
        ("{}", "", "is no class (write module:Class or FILE.py:Class)"),
        ("{}:Mine", None, "is not there"),
        ("{}:Mine", "def (", "cannot be loaded: SyntaxError"),
        ("{}:Mine", "raise SystemExit", "cannot be loaded: SystemExit"),
        ("{}:Mine", "1 / 0", "cannot be loaded: ZeroDivisionError: division by zero (mine.py:1)"),
        ("{}:Mine", "class Mind: pass", "has no class Mine (did you mean Mind?)"),
        ("{}:Mine", "Mine = 3", "has no class Mine"),
        ("{}:Mine", HEAD.format(name="Mine") + RECEIVE, "has no method predict"),
        ("{}:Mine", "import vrs_cli as vrs\nclass Mine(vrs.Predictor): pass", "has no method receive"),
        ("no.such.module:Mine", None, "cannot be loaded: ModuleNotFoundError: No module named 'no'"),
    ],
)
def test_what_is_wrong_with_a_name_is_told(text: str, content: str | None, said: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    if content is not None:
        path.write_text(content)
    with pytest.raises(MethodError) as told:
        load_method(text.format(path), Predictor)
    assert said in str(told.value)


def test_a_class_of_a_module_is_found_and_its_set_points_are_sent() -> None:
    assert load_method("vrs_cli.lab.methods:MoveAndWait", RemoteController) is MoveAndWait
    found = method_outcome(trial("waves", controller="vrs_cli.lab.methods:GoalAhead", viewers=())).controller
    assert found is not None
    assert found.rms < 180.0 / pi

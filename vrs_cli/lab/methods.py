"""Load users' viewers and controllers for `vrs lab experiment methods`, and define the built-in ones for comparison.

A viewer estimates where a robot is now from frames (joint positions) that arrive late; a controller sends the robot set
points that arrive late. Each is a class with two methods. A user's class may derive from Predictor or RemoteController,
or just have the same methods.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from threading import current_thread, main_thread
from time import perf_counter
from traceback import extract_tb
from types import FrameType, ModuleType
from typing import Any, NoReturn

import numpy as np

from vrs_cli.errors import UsageError, did_you_mean
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.repl.interrupt import alarm

MAX_CALL = 2.0  # [s] a call of a user's method that takes longer is stopped with an error
CLOSE = 0.01  # [rad, m] MoveAndWait takes a robot as arrived if all its joints are this close to the set point


class Predictor:
    """A viewer, which estimates where a robot is now from earlier joint positions. Each trial makes a new object.

    `robot`: the model of the arm; its limits `lower`, `upper` [rad, or m for sliding joints], `max_velocity` and
    `max_acceleration` have n values each. `delay`: half of the measured median round trip D_f + D_b [s], where D_f is
    the delay to the robot, and D_b the delay from the robot.
    """

    def __init__(self, robot: RobotModel, delay: float) -> None:
        self.robot, self.delay = robot, delay

    def receive(self, t: float, joints: Floats) -> None:
        """Receive a frame: the robot was at `joints` (n,) [rad; m] at the time `t` [s]. Frames arrive in the order of
        t. `predict` gets times of the same clock, because robot and viewer have synchronous clocks.
        """
        raise NotImplementedError

    def predict(self, t: float) -> Floats:
        """Return the estimated joint positions of the robot at the current time `t` [s], (n,) [rad; m].

        This method is called with increasing times, after the first frame; all frames that arrived before t have been
        received.
        """
        raise NotImplementedError


class RemoteController:
    """A controller that makes a robot follow a moving goal over a delayed connection. `robot`: the model of the arm;
    `delay`: half of the measured median round trip [s]."""

    def __init__(self, robot: RobotModel, delay: float) -> None:
        self.robot, self.delay = robot, delay

    def receive(self, t: float, joints: Floats) -> None:
        """Receive a frame: the robot was at `joints` (n,) [rad; m] at the time `t` [s]."""
        raise NotImplementedError

    def command(self, t: float, goal: Floats) -> Floats:
        """Return the set point (n,) [rad; m] to send at the time `t` [s]. It arrives at the robot D_f later, and the
        robot follows it within its limits.

        `goal` (n,): the joint positions where the robot should be at t [rad; m].
        """
        raise NotImplementedError


# --- built-in viewers and controllers, for comparison ----------------------------------------------------------------


class LastFrame(Predictor):
    """A viewer that shows the last frame that has arrived."""

    def receive(self, t: float, joints: Floats) -> None:  # noqa: ARG002
        self._joints = joints

    def predict(self, t: float) -> Floats:  # noqa: ARG002
        return self._joints


class Extrapolated(Predictor):
    """A viewer that continues from the last frame with the velocity between the last two frames: dead reckoning (IEEE
    1278.1, 1995)."""

    _last: tuple[float, Floats] | None = None
    _velocity: Floats | float = 0.0

    def receive(self, t: float, joints: Floats) -> None:
        if self._last is not None:
            self._velocity = (joints - self._last[1]) / (t - self._last[0])
        self._last = t, joints

    def predict(self, t: float) -> Floats:
        assert self._last is not None  # true because `predict` is only called after the first frame
        then, joints = self._last
        return joints + (t - then) * self._velocity


class Direct(RemoteController):
    """A controller that sends the goal unchanged."""

    def receive(self, t: float, joints: Floats) -> None:
        pass

    def command(self, t: float, goal: Floats) -> Floats:  # noqa: ARG002
        return goal


class GoalAhead(Direct):
    """A controller that sends the goal extrapolated, with its current velocity, to the time when the set point
    arrives."""

    _last: tuple[float, Floats] | None = None

    def command(self, t: float, goal: Floats) -> Floats:
        last, self._last = self._last, (t, goal)
        return goal if last is None else goal + (goal - last[1]) * (self.delay / (t - last[0]))


class MoveAndWait(RemoteController):
    """A controller that sends the current goal, waits until the robot has arrived there, and then sends the goal of
    that time: move and wait (Ferrell, 1965)."""

    _sent: Floats | None = None
    _arrived = True

    def receive(self, t: float, joints: Floats) -> None:  # noqa: ARG002
        self._arrived = self._sent is None or bool(np.abs(joints - self._sent).max() < CLOSE)

    def command(self, t: float, goal: Floats) -> Floats:  # noqa: ARG002
        if self._arrived or self._sent is None:
            self._sent = np.clip(goal, self.robot.lower, self.robot.upper)
            self._arrived = False
        return self._sent


VIEWERS: dict[str, type[Predictor]] = {"frames": LastFrame, "extrapolated": Extrapolated}
CONTROLLERS: dict[str, type[RemoteController]] = {"direct": Direct, "ahead": GoalAhead, "wait": MoveAndWait}


# --- viewers and controllers written by users ------------------------------------------------------------------------


class MethodError(UsageError, text="Cannot be tried"):
    """A viewer or controller written by a user cannot be loaded, or fails in a trial."""


def load_method(text: str, base: type[Predictor | RemoteController]) -> type:
    """Return the class of a viewer or controller. `text`: `module:Class`, `FILE.py:Class`, or the name of a built-in
    one; `base`: Predictor or RemoteController.

    Raises MethodError if the class does not exist or lacks a method of `base`.
    """
    known = VIEWERS if base is Predictor else CONTROLLERS
    if text in known:
        return known[text]
    place, _, name = text.rpartition(":")
    if not place or not name:
        raise MethodError(f"{text!r} is no class", "write module:Class or FILE.py:Class")
    module = _load_module(place)
    found = getattr(module, name, None)
    if not isinstance(found, type):
        classes = [key for key, one in vars(module).items() if isinstance(one, type)]
        raise MethodError(f"{place} has no class {name}", did_you_mean(name, classes, "write module:Class"))
    wanted = [key for key in vars(base) if not key.startswith("_")]
    own = [key for key in wanted if callable(getattr(found, key, None)) and getattr(found, key) is not vars(base)[key]]
    if own != wanted:
        lacking = next(key for key in wanted if key not in own)
        raise MethodError(
            f"{text} has no method {lacking}", f"{base.__name__} in docs/experiment.md has {' and '.join(wanted)}"
        )
    return found


def _load_module(place: str) -> ModuleType:
    """Import a module by its name, or from a file whose name ends in .py. Raises MethodError if the import fails for
    any reason."""
    folders = [str(Path(place).resolve().parent) if place.endswith(".py") else str(Path.cwd())]
    before, sys.path = sys.path, [*folders, *sys.path]
    try:
        if not place.endswith(".py"):
            return import_module(place)
        if not Path(place).is_file():
            raise MethodError(f"{place} is not there", "write module:Class or FILE.py:Class")
        spec = spec_from_file_location(f"_method_{Path(place).stem}", place)
        assert spec is not None  # true because the name of the file ends in .py
        assert spec.loader is not None
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    except MethodError:
        raise
    except BaseException as error:  # catch everything, because a user's module may even raise SystemExit
        if isinstance(error, KeyboardInterrupt):
            raise
        raise MethodError(f"{place} cannot be loaded: {_failure_text(error)}") from None
    finally:
        sys.path = before


class Guarded:
    """A wrapper around a viewer or controller. It measures the time of calls, and turns any failure of a user's class
    into a MethodError with a message of one line."""

    def __init__(
        self, text: str, base: type[Predictor | RemoteController], robot: RobotModel, delay: float, rate: float
    ):
        self._text, self._n, self._period = text, robot.joint_count, 1.0 / rate
        self._calls, self.spent = 0, 0.0
        self._own = text not in VIEWERS and text not in CONTROLLERS
        made = load_method(text, base)
        self._method = self._call("__init__", lambda: made(robot, delay))

    @property
    def call_time(self) -> float:
        """Return the mean duration of a call [s]."""
        return self.spent / max(self._calls, 1)

    def receive(self, t: float, joints: Floats) -> None:
        self._call(f"receive({t:.3f})", lambda: self._method.receive(t, joints.copy()))

    def predict(self, t: float) -> Floats:
        """Return the joint positions that the viewer estimates, (n,) [rad; m]. Raises MethodError."""
        return self._joints(f"predict({t:.3f})", lambda: self._method.predict(t))

    def command(self, t: float, goal: Floats) -> Floats:
        """Return the set point that the controller sends, (n,) [rad; m]. Raises MethodError."""
        return self._joints(f"command({t:.3f})", lambda: self._method.command(t, goal.copy()))

    def _joints(self, what: str, ask: Callable[[], object]) -> Floats:
        answer = self._call(what, ask)
        try:
            joints = np.array(answer, dtype=np.float64)
        except (TypeError, ValueError):
            self._fail(f"{what} returned {_short(answer)}", f"return an array of {self._n} numbers")
        if joints.shape != (self._n,):
            self._fail(f"{what} returned an array of shape {joints.shape}", f"the shape is ({self._n},)")
        if not np.isfinite(joints).all():
            joint = int(np.argmin(np.isfinite(joints)))
            self._fail(f"{what} returned {joints[joint]} for joint {joint + 1}", "return finite numbers")
        return joints

    def _call(self, what: str, do: Callable[[], object]) -> Any:
        if not self._own:
            return do()
        begun = perf_counter()
        try:
            with time_limit(MAX_CALL):
                answer = do()
        except TimeoutError:
            self._fail(f"{what} takes longer than {MAX_CALL:g} s", f"it has {1e3 * self._period:g} ms a call")
        except Exception as error:
            self._fail(f"{what} raised {_failure_text(error)}")
        except SystemExit:
            self._fail(f"{what} ended the process", "return instead")
        self.spent += perf_counter() - begun
        self._calls += 1
        if self._calls >= 25 and self.call_time > self._period:
            took = f"{1e3 * self.call_time:.0f} ms a call"
            self._fail(f"it takes {took}", f"at {1.0 / self._period:g} Hz it has {1e3 * self._period:g} ms")
        return answer

    def _fail(self, detail: str, hint: str = "") -> NoReturn:
        raise MethodError(f"{self._text}: {detail}", hint) from None


def _failure_text(error: BaseException) -> str:
    """Return an exception as text, with the file and line of the user's code that raised it."""
    rows = [
        row for row in extract_tb(error.__traceback__) if row.filename != __file__ and "importlib" not in row.filename
    ]
    at = f" ({Path(rows[-1].filename).name}:{rows[-1].lineno})" if rows else ""
    said = _short(error)
    return f"{type(error).__name__}{f': {said}' if said else ''}{at}"


def _short(value: object) -> str:
    try:
        text = " ".join((str(value) if isinstance(value, BaseException) else repr(value)).split())
    except Exception:
        text = type(value).__name__
    return text if len(text) <= 100 else f"{text[:97]}..."


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in the `with` block if it takes longer than `seconds`. There is no limit outside the main
    thread, or on systems without `setitimer`."""
    if not hasattr(signal, "setitimer") or current_thread() is not main_thread():
        yield
        return

    def over(_signal: int, _frame: FrameType | None) -> None:
        raise TimeoutError

    with alarm(signal.SIGALRM, signal.ITIMER_REAL, seconds, over):
        yield

"""Tools dragged at random, and an oracle of what a drag may do, made from the polynomials of the timeline alone.

`python -m tests.laws.drags SECONDS [FIRST] [ROBOT ...]` drags each robot for so long, and prints what became of it.
"""

from __future__ import annotations

import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import degrees, dist, hypot, pi, radians, sin, sqrt
from random import Random
from time import process_time
from typing import NamedTuple

from tests.by_hand import command
from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.dragging import ELBOW_MARGIN, LAG_S, MIN_AHEAD, Dragging
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Configuration, Joints
from vrs_cli.kinematics.model import RobotModel, levers
from vrs_cli.kinematics.numeric.search import Aim, Miss
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import (
    Transform,
    at_position,
    compose,
    from_oat,
    inverse,
    orthonormal_frame,
    position,
    rotation_about,
    translation,
    unit,
)
from vrs_cli.trajectory.polynomial import Polynomial
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.values.commands import SetBase, SetMonitorSpeed, SetParameter, SetTool
from vrs_cli.values.dragging import Limit, Shortfall

TICK = 0.02  # [s]
ROUNDING = 1e-6
ARRIVED = 1e-4  # [m, rad]
PULSE = 0.5  # [Hz] of the fastest joint of a hand
FOLLOWED = 12  # times that a hand is followed inside the reach, for 5 s each
PASSED = 0.05  # of the shoulder's measure, which the arm may pass by for a moment where it is pulled through


# --- the oracle ------------------------------------------------------------------------------------------------------


def value(a: Polynomial, s: float) -> float:
    return sum(c * s**k for k, c in enumerate(a))


def slope(a: Polynomial) -> Polynomial:
    return tuple(k * c for k, c in enumerate(a))[1:] or (0.0,)


def extremes(a: Polynomial, lasting: float) -> Iterator[float]:
    """The values of a polynomial of degree 3 at most where they may be the least and the greatest."""
    yield from (value(a, 0.0), value(a, lasting))
    c, b, *rest = (*slope(a), 0.0)[:3] if len(a) > 2 else (0.0, 0.0)
    square = rest[0] if rest else 0.0
    roots: list[float] = []
    if square and b * b - 4.0 * square * c >= 0.0:
        root = sqrt(b * b - 4.0 * square * c)
        roots = [(-b - root) / (2.0 * square), (-b + root) / (2.0 * square)]
    elif b and not square:
        roots = [-c / b]
    yield from (value(a, s) for s in roots if 0.0 < s < lasting)


def check_limits(model: RobotModel, segments: list[Segment], *, smooth: bool) -> None:
    """No joint leaves its range, or has more velocity, acceleration or jerk than it may, at any instant."""
    for segment in segments:
        assert isinstance(segment.path, JointPath)
        limits = zip(model.lower, model.upper, model.max_velocity, model.max_acceleration, model.max_jerk, strict=True)
        for a, (low, high, v, acceleration, jerk) in zip(segment.path.coefficients, limits, strict=True):
            lasting = segment.duration
            places = list(extremes(a, lasting))
            assert low - ROUNDING <= min(places) <= max(places) <= high + ROUNDING, segment
            assert max(map(abs, extremes(slope(a), lasting))) <= v * (1.0 + ROUNDING), segment
            assert max(map(abs, extremes(slope(slope(a)), lasting))) <= acceleration * (1.0 + ROUNDING), segment
            if smooth:
                assert abs(value(slope(slope(slope(a))), 0.0)) <= jerk * (1.0 + ROUNDING), segment


def check_no_jump(segments: list[Segment], *, smooth: bool) -> None:
    """Place and velocity, and where jerks are limited acceleration, go on from segment to segment."""
    for one, other in pairwise(segments):
        assert isinstance(one.path, JointPath)
        assert isinstance(other.path, JointPath)
        for a, b in zip(one.path.coefficients, other.path.coefficients, strict=True):
            assert abs(value(a, one.duration) - value(b, 0.0)) <= 1e-9, (one, other)
            v = value(slope(a), one.duration), value(slope(b), 0.0)
            stands = one.finish < other.start
            assert (max(map(abs, v)) if stands else abs(v[1] - v[0])) <= 1e-7, (one, other)
            if smooth and not stands:
                after, before = (value(slope(slope(row)), s) for row, s in ((b, 0.0), (a, one.duration)))
                assert abs(after - before) <= 1e-4, (one, other)


def check_keeps_elbow(engine: Engine, dragging: Dragging, begin: float, roundabout: list[float]) -> None:
    """The arm stays on its side of the axis of joint 1, but for a way round, and the elbow on its side, always."""
    arm, kept = engine.arm, dragging.pursuit.kept
    if not arm.lines_keep_words:
        return  # nor does a drag
    steps = max(int((engine.end - begin) / 0.005), 1)
    for k in range(steps + 1):
        t = begin + (engine.end - begin) * k / steps
        q = engine.position(t).joints
        have, free = arm.configuration(q), arm.singularity(q)
        if arm.fold is not None and abs(q[arm.fold[0]] - _side(arm.fold, q)) < 2.0 * ELBOW_MARGIN:
            continue  # on the border
        if (have.arm, have.elbow) != (kept.arm, kept.elbow) and free.shoulder > PASSED:
            assert any(-0.2 <= t - since <= 1.0 for since in roundabout), (t, q, have, kept)


def _side(fold: tuple[int, float], q: Joints) -> float:
    half = radians(180.0)
    return fold[1] + half * round((q[fold[0]] - fold[1]) / half)


def check_holds(engine: Engine, dragging: Dragging, wish: Transform, held: Shortfall) -> None:
    """What is said to hold the tool does."""
    model, arm, goal = engine.model, engine.arm, dragging.pursuit.goal
    assert bool(held.holds) == bool(held.away or held.turned)
    for hold in held.holds:
        if hold.limit is Limit.JOINT:
            assert goal[hold.joint - 1] == getattr(model, hold.end)[hold.joint - 1]
        elif hold.limit is Limit.SINGULARITY and not hold.joint:
            assert min(arm.singularity(goal)) < 0.15, (goal, arm.singularity(goal))
        elif hold.limit is Limit.REACH and hold.which:
            kept, wrist = dragging.pursuit.kept, arm.configuration(goal).wrist
            way = Configuration.of(kept.arm, kept.elbow, wrist)
            assert arm.branch_joints(flange_of(engine, wish), way, goal) is None, hold
        elif hold.limit is Limit.SPEED:
            joint, here = hold.joint - 1, engine.position().joints
            late = abs(goal[joint] - here[joint]) / model.max_velocity[joint]
            assert late > 0.9 * LAG_S * MIN_AHEAD * engine.settings.monitor_speed / 100.0, (hold, late)


def flange_of(engine: Engine, wish: Transform) -> Transform:
    frames = engine.frames
    return compose(compose(frames.base, wish), inverse(frames.tool))


# --- a hand that drags at random -------------------------------------------------------------------------------------


class Tally(NamedTuple):
    """By what wishes were held, and the CPU that each took [s]."""

    holds: Counter[str]
    cpu: list[float]


class Hand:
    """Drags the tool of a robot about, as a seed says: through its reach and beyond, fast and slow, with rests."""

    def __init__(self, seed: int, model: RobotModel, profile: str = "LSPB") -> None:
        self.random, self.profile = Random(seed), profile
        self.engine = Engine(model)
        self.tally = Tally(Counter(), [])
        self.roundabout: list[float] = []  # when a joint went the other way round, as MOVE does
        self.far = 1.3 * levers(model)[1][0]
        self._prepare()

    def _prepare(self) -> None:
        engine, source = self.engine, self.random
        engine.perform(SetParameter("PROFILE", self.profile))
        if all(engine.model.task.counts) and source.random() < 0.5:
            engine.perform(SetTool(from_oat(0.01, 0.02, 0.1, 0.3, 0.2, 0.1)))
            engine.perform(SetBase(from_oat(0.1, 0.2, 0.05, 0.4, -1.5707963, 0.0)))
        if source.random() < 0.3:
            engine.perform(SetMonitorSpeed(source.uniform(10.0, 100.0)))

    def drag(self, seconds: float) -> None:
        """Take the tool, drag it, let it go; then see what it did."""
        engine, begin = self.engine, self.engine.now
        first = len(engine.timeline)
        dragging = Dragging(engine)
        wish = engine.position().T_world_tool
        while engine.now < begin + seconds:
            way, turn, lasting = self._pull(wish)
            if self.random.random() < 0.1:
                wish = self._place()  # at once, as by a click
            for _ in range(lasting):
                wish = pulled(wish, way, turn)
                self.wish(dragging, wish)
                engine.clock.advance(engine.now + TICK * self.random.choice((1.0, 1.0, 1.0, 0.6, 1.7)))
        engine.clock.advance(engine.end)
        self.check(dragging, begin, first)

    def wish(self, dragging: Dragging, wish: Transform) -> Shortfall:
        cpu = process_time()
        held = dragging.to(wish)
        self.tally.cpu.append(process_time() - cpu)
        if dragging.pursuit.roundabout:
            self.roundabout.append(self.engine.now)
        self.tally.holds.update([str(hold.limit.value) for hold in held.holds] or ["nothing"])
        if self.random.random() < 0.1:
            check_holds(self.engine, dragging, wish, held)
        return held

    def check(self, dragging: Dragging, begin: float, first: int) -> None:
        engine, smooth = self.engine, self.profile == "SCURVE"
        segments = [engine.timeline[k] for k in range(max(first - 1, 0), len(engine.timeline))]
        segments = [one for one in segments if isinstance(one.path, JointPath)]
        check_limits(engine.model, segments, smooth=smooth)
        check_no_jump(segments, smooth=smooth)
        check_keeps_elbow(engine, dragging, begin, self.roundabout)

    def settle(self, seconds: float = 12.0) -> float:
        """The tool is wished where the arm can be as it is, from wherever it is held: it comes there. How long [s]."""
        engine, dragging = self.engine, Dragging(self.engine)
        self._astray(dragging)
        goal = self._joints_like(dragging)
        wish, begin = engine.world_pose(goal), engine.now
        while engine.now < begin + seconds:
            self.wish(dragging, wish)
            engine.clock.advance(engine.now + TICK)
            if missed(engine, wish) < ARRIVED:
                break
        assert missed(engine, wish) < ARRIVED or self._beyond(dragging, wish), (engine.position().joints, goal)
        return engine.now - begin

    def _beyond(self, dragging: Dragging, wish: Transform) -> bool:
        """Whether the arm does not reach it as it is: its wrist may have passed through straight."""
        arm, pursuit = self.engine.arm, dragging.pursuit
        way = Configuration.of(pursuit.kept.arm, pursuit.kept.elbow, arm.configuration(pursuit.goal).wrist)
        return arm.inverse_branch(flange_of(self.engine, wish), way, pursuit.goal) is None

    def _astray(self, dragging: Dragging) -> None:
        for _ in range(3):
            wish = self._place()
            for _ in range(40):
                self.wish(dragging, wish)
                self.engine.clock.advance(self.engine.now + TICK)

    def _joints_like(self, dragging: Dragging) -> Joints:
        """Somewhere in the ranges, arm and elbow as they are."""
        model, arm, kept = self.engine.model, self.engine.arm, dragging.pursuit.kept
        while True:
            parts = [self.random.uniform(0.05, 0.95) for _ in model.lower]
            q = tuple(low + (high - low) * f for f, low, high in zip(parts, model.lower, model.upper, strict=True))
            have, free = arm.configuration(q), arm.singularity(q)
            if (have.arm, have.elbow) == (kept.arm, kept.elbow) and min(free) > 0.1:
                wrist = arm.configuration(dragging.pursuit.goal).wrist
                if have.wrist is wrist:
                    return q

    def _pull(self, wish: Transform) -> tuple[tuple[float, float, float], tuple[float, float, float], int]:
        """The way and the turn of a tick, and for how many ticks."""
        source, goal = self.random, position(self._place())
        far = max(dist(goal, position(wish)), 1e-3)
        speed, lasting = source.choice((0.0, 0.1, 0.3, 1.0, 3.0)), source.randint(5, 80)
        x, y, z = ((g - p) / far * speed * TICK for g, p in zip(goal, position(wish), strict=True))
        turn = source.choice((0.0, 0.3, 1.5)) * TICK
        return (x, y, z), (source.gauss(0.0, turn), source.gauss(0.0, turn), source.gauss(0.0, turn)), lasting

    def _place(self) -> Transform:
        source, far = self.random, self.far
        here = self.engine.position().T_world_tool
        if source.random() < 0.5:
            model = self.engine.model
            q = tuple(source.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))
            return self.engine.world_pose(q)
        return at_position(here, *(source.uniform(-far, far) for _ in range(3)))


def pulled(T: Transform, way: tuple[float, float, float], turn: tuple[float, float, float]) -> Transform:
    angle = hypot(*turn)
    R = at_position(T, 0.0, 0.0, 0.0)
    R = orthonormal_frame(compose(rotation_about(unit(turn), angle), R)) if angle else R
    return compose(translation(T.px + way[0], T.py + way[1], T.pz + way[2]), R)


def missed(engine: Engine, wish: Transform) -> float:
    """By how much the tool misses a wish, in what counts for the robot [m, rad]."""
    return max(Aim(engine.arm, flange_of(engine, wish), engine.frames.tool).miss(engine.position().joints))


# --- a hand inside the reach -----------------------------------------------------------------------------------------


def follow(model: RobotModel, seed: int, seconds: float) -> Miss:
    """Wishes on a smooth way through joints of one configuration: the root of the mean squared miss."""
    arm, source = arm_for(model), Random(seed)
    ranges = list(zip(model.lower, model.upper, strict=True))
    while True:
        middle = tuple(low + (high - low) * source.uniform(0.3, 0.7) for low, high in ranges)
        if min(arm.singularity(middle)) > 0.4:
            break
    sizes = [min(0.12 * (high - low), 0.17) for low, high in ranges]
    beats = [(source.uniform(0.2, PULSE), source.uniform(0.0, 6.0)) for _ in ranges]
    engine = Engine(model, start=middle)
    dragging, misses = Dragging(engine), list[Miss]()
    while engine.now < seconds:
        t = engine.now
        grown = min(1.0, t / 2.0)
        q = tuple(x + grown * a * sin(2.0 * pi * f * t + p) for x, a, (f, p) in zip(middle, sizes, beats, strict=True))
        wish = engine.world_pose(q)
        shortfall = dragging.to(wish)
        assert not shortfall.holds, (t, shortfall)
        misses.append(Aim(arm, flange_of(engine, wish)).miss(engine.position().joints))
        engine.clock.advance(t + TICK)
    mean = [sum(x * x for x in column) / len(misses) for column in zip(*misses, strict=True)]
    return Miss(mean[0] ** 0.5, mean[1] ** 0.5)


# --- for long --------------------------------------------------------------------------------------------------------


def main(seconds: float, first: int = 1, robots: Sequence[RobotModel] = ()) -> int:
    return 1 if sum([long_drag(model, seconds, first) for model in robots or map(load_robot, robot_names())]) else 0


def long_drag(model: RobotModel, seconds: float, first: int) -> int:
    """Print what came of it; how many faults."""
    holds, cpu, settled, faults, done, seed = Counter[str](), list[float](), list[float](), 0, 0.0, first
    while done < seconds:
        hand = Hand(seed, model, ("LSPB", "SCURVE")[seed % 2])
        try:
            for _ in range(3):
                hand.drag(10.0)
                settled.append(hand.settle())
        except Exception:
            faults += 1
            print(f"--- {model.name}, seed {seed}\n{traceback.format_exc()[-1500:]}", flush=True)
        done, seed = done + hand.engine.now, seed + 1
        holds.update(hand.tally.holds)
        cpu += hand.tally.cpu
    cpu.sort()
    spent = f"{1e3 * sum(cpu) / len(cpu):.2f} ms, 99 % {1e3 * cpu[len(cpu) * 99 // 100]:.2f}, worst {1e3 * cpu[-1]:.1f}"
    held = ", ".join(f"{key} {100.0 * n / len(cpu):.0f} %" for key, n in holds.most_common())
    print(f"{model.name}: {done:.0f} s, {len(cpu)} wishes, {faults} faults; held by {held}; CPU of a wish {spent}")
    print(f"    settled in {sum(settled) / max(len(settled), 1):.1f} s, {max(settled, default=0.0):.1f} at most")
    rms = [follow(model, first + k, 5.0) for k in range(FOLLOWED)]
    away, turned = (sqrt(sum(x * x for x in column) / FOLLOWED) for column in zip(*rms, strict=True))
    print(f"    inside the reach: behind by {1e3 * away:.1f} mm, {degrees(turned):.2f} deg rms", flush=True)
    return faults


if __name__ == "__main__":
    command(main)

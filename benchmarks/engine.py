"""Planner f and position g beside what a user would pick instead: `python -m benchmarks engine`.

Every figure is the least of repeats in this one run, of the processor; compare ratios, not microseconds.
"""

from __future__ import annotations

import gc
import random
import tracemalloc
from bisect import bisect_right
from collections.abc import Callable
from functools import partial
from itertools import count
from math import radians
from statistics import fmean
from typing import Any, TypeVar

import numpy as np
from msgspec import structs

from benchmarks.peers import Figures, Peers, beside
from benchmarks.peers.timing import at_once, each
from benchmarks.report import Figure, show
from vrs_cli.engine import boundary, problem, single_motion, targets
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.planner import plan
from vrs_cli.engine.position import joints_at, joints_over, positions_at
from vrs_cli.engine.problem import Here, Problem
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import JointTarget, Motion, MotionKind, Move, PoseTarget, Start

MODEL = load_robot("puma560")
MOTIONS = 3400  # of three segments each
TIMES = 1000  # read one by one
MANY = 100_000  # read at once, sorted
TASKS = 40  # motions planned
KINDS = ("from_rest", "from_motion", "from_acceleration")
ARM = Engine(MODEL).arm
BY_HAND = "bisect and Horner by hand"

M = TypeVar("M")


def main() -> None:
    peers = Peers()
    engine = wandering(MOTIONS)
    lines = [straight(profile) for profile in Profile]
    figures = [*reading(engine, peers), *planning(peers), *editing(engine), *lines]
    title = f"Engine; g on a timeline of {len(engine.timeline)} segments, {engine.end:.0f} s"
    show(title, figures, peers.missing)


def wandering(motions: int, seed: int = 1) -> Engine:
    """An engine with a timeline of so many joint-interpolated motions, three segments each."""
    engine, source = Engine(MODEL), random.Random(seed)
    for _ in range(motions):
        wander(engine, source)
    return engine


def wander(engine: Engine, source: random.Random) -> None:
    engine.perform(Move(JointTarget(_somewhere(source)), straight=False))


def _somewhere(source: random.Random) -> tuple[float, ...]:
    return tuple(map(source.uniform, MODEL.lower, MODEL.upper))


# --- g -----------------------------------------------------------------------------------------------------------


def reading(engine: Engine, peers: Peers) -> list[Figure]:
    """g for one time and for many, and what a change of the timeline costs the next reader."""
    arm, timeline, source = engine.arm, engine.timeline, random.Random(2)
    times = [source.uniform(0.0, engine.end) for _ in range(TIMES)]
    many = np.sort(np.random.default_rng(2).uniform(0.0, engine.end, MANY))
    one = each(lambda t: joints_at(arm, timeline, t), times)
    joints = at_once(lambda: joints_over(arm, timeline, many), MANY)
    scipy = peers.figures("scipy_peer", {**polynomials(timeline), "many": many.tolist()})
    everything = at_once(lambda: positions_at(arm, timeline, many), MANY)
    return [
        Figure("g, one time, joints", one, "", {BY_HAND: each(bisect_and_horner(timeline), times)}),
        Figure("g, 100,000 sorted times, joints, per time", joints, "2 x PPoly", beside("g many", scipy)),
        Figure("- velocity, acceleration, tool, hand as well", everything),
        Figure("an edit, and the next read of 1000 times", _edit_and_read(engine), "", beside("edit", scipy)),
    ]


def polynomials(timeline: Timeline) -> dict[str, Any]:
    """The segments that last, for scipy: joints only, each of three coefficients."""
    segments = [s for s in timeline if s.duration and isinstance(s.path, JointPath)]
    rows = [[(*a, 0.0, 0.0)[:3] for a in s.path.coefficients] for s in segments]  # type: ignore[union-attr]
    return {"starts": [s.start for s in segments], "finish": segments[-1].finish, "coefficients": rows}


def bisect_and_horner(timeline: Timeline) -> Callable[[float], Joints]:
    """Return g as one would write it by hand for joints alone: the least that Python needs for the same."""
    work = polynomials(timeline)
    starts, rows = work["starts"], work["coefficients"]

    def joints(t: float) -> Joints:
        at = bisect_right(starts, t) - 1
        s = t - starts[at]
        return tuple([a + s * (b + s * c) for a, b, c in rows[at]])

    return joints


def _edit_and_read(engine: Engine) -> float:
    """An insertion in the middle, and 1000 times read of the new timeline there: no array is made anew."""
    arm, timeline, delta = engine.arm, engine.timeline, _insertion(engine)
    times = np.linspace(delta.cut - 500.0, delta.cut + 500.0, 1000)
    return at_once(lambda: joints_over(arm, timeline.apply(delta), times), 1)


# --- f -----------------------------------------------------------------------------------------------------------


def planning(peers: Peers) -> list[Figure]:
    """f for a joint motion, from rest and out of motion, without the timeline around it."""
    work = tasks()
    from_rest, from_motion, from_acceleration = (work[name] for name in KINDS)
    rest, motion = planned(from_rest), planned(from_motion)
    theirs = [peers.figures(name, work) for name in ("ruckig_peer", "toppra_peer", "toolbox_peer")]
    return [
        Figure("f, MOVE from rest", rest, "60", beside("f from_rest", *theirs)),
        Figure("f, MOVE out of motion", motion, "60", beside("f from_motion", *theirs)),
        *_jerk_limited("from rest", "from_rest", from_rest, theirs[0]),
        *_jerk_limited("out of motion", "from_motion", from_motion, theirs[0]),
        *_jerk_limited("out of acceleration", "from_acceleration", from_acceleration, theirs[0]),
    ]


def tasks() -> dict[str, Any]:
    """Motions to plan, each from joints and velocities to a goal, and the limits."""
    source = random.Random(3)
    still = (0.0,) * MODEL.joint_count
    from_rest = [(_somewhere(source), still, _somewhere(source)) for _ in range(TASKS)]
    from_motion = [(_amid(source), tuple(0.5 * v for v in MODEL.max_velocity), goal) for _, _, goal in from_rest]
    from_acceleration = [(*task, _accelerating(source)) for task in from_motion]
    limits = {"velocity": MODEL.max_velocity, "acceleration": MODEL.max_acceleration, "jerk": MODEL.max_jerk}
    return {**dict(zip(KINDS, (from_rest, from_motion, from_acceleration), strict=True)), **limits}


def _amid(source: random.Random) -> Joints:
    """Somewhere with room to stop."""
    return tuple(
        0.5 * (low + high) + source.uniform(-0.25, 0.25) * (high - low)
        for low, high in zip(MODEL.lower, MODEL.upper, strict=True)
    )


def _accelerating(source: random.Random) -> Joints:
    return tuple(source.uniform(-a, a) for a in MODEL.max_acceleration)


def _jerk_limited(words: str, kind: str, tasks: list[tuple[Joints, ...]], ruckig: Figures) -> list[Figure]:
    """SCURVE beside Ruckig, which solves the same problem for the least time, each joint on a path of its own."""
    lasting = [_plan(Profile.SCURVE, *task)[-1].finish for task in tasks]
    return [
        Figure(f"f, MOVE {words}, SCURVE", planned(tasks, Profile.SCURVE), "", beside(f"f {kind}", ruckig)),
        Figure("- the motions, on the average", 1e6 * fmean(lasting), "", beside(f"duration {kind}", ruckig)),
    ]


def planned(tasks: list[tuple[Joints, ...]], profile: Profile = Profile.LSPB) -> float:
    return each(partial(_plan, profile), *zip(*tasks, strict=True), rounds=5)


def _plan(profile: Profile, q: Joints, v: Joints, goal: Joints, a: Joints = ()) -> tuple[Segment, ...]:
    motion = Motion(1, MotionKind.JOINT, Start.AT, goal=goal, profile=profile)
    forget_plans()
    return plan_motion(Problem(ARM, Here(JointState(q, v, a)), motion, 0.0))


def forget_plans() -> None:
    """Let f plan anew what it remembers: a program seldom makes one motion twice from the same state."""
    single_motion._remembered_plan.cache_clear()
    boundary._survey.cache_clear()
    targets._remembered_joints.cache_clear()
    problem._REMEMBERED_STATES.clear()


def traced(make: Callable[[], M]) -> tuple[int, M]:
    """Return the bytes that Python has allocated for a value and not freed, and the value. Plans that f remembers, a
    limited number, do not count: how many of them are new depends on what was measured before.
    """
    forget_plans()
    gc.collect()
    tracemalloc.start()
    made = make()
    forget_plans()
    gc.collect()
    used = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    return used, made


def editing(engine: Engine) -> list[Figure]:
    """f with the timeline around it, and apply."""
    arm, timeline = engine.arm, engine.timeline
    last, end, delta = engine.book.deltas[-1].motion, engine.end, _insertion(engine)
    at = delta.cut

    def repeated(work: Callable[[], object]) -> float:
        def anew(_: int) -> object:
            forget_plans()
            return work()

        return each(anew, range(50))

    return [
        Figure("f and timeline: MOVE appended", repeated(lambda: plan(arm, timeline, last, end, end))),
        Figure("- out of motion, the rest dropped", repeated(lambda: plan(arm, timeline, last, at, at, insert=False))),
        Figure("- inserted, next motion planned again", repeated(lambda: plan(arm, timeline, last, at, at))),
        Figure("apply an insertion in the middle", repeated(lambda: timeline.apply(delta))),
    ]


def _insertion(engine: Engine) -> Any:
    """A delta that inserts a motion in the middle of the timeline."""
    timeline = engine.timeline
    middle = timeline[len(timeline) // 2 - 100]
    at = middle.start + 0.4 * middle.duration
    return plan(engine.arm, timeline, engine.book.deltas[-1].motion, at, at)


def straight(profile: Profile) -> Figure:
    """f for a straight line of 200 mm, with every joint verified."""
    engine = Engine(MODEL)
    engine.perform(Move(JointTarget(tuple(map(radians, (0, -45, 180, 0, 45, 0)))), straight=False))
    pose = engine.position().T_world_tool
    engine.perform(Move(PoseTarget(pose._replace(py=pose.py + 0.2)), straight=True))
    before, at = engine.timeline, engine.end
    engine.perform(Move(PoseTarget(pose), straight=True))
    motion, turn = structs.replace(engine.book.deltas[-1].motion, profile=profile), count()

    def planned_anew(_: int) -> object:
        """A hair beside those before, which are remembered."""
        goal = pose._replace(py=pose.py + 1e-9 * next(turn))
        return plan(engine.arm, before, structs.replace(motion, pose=goal), at, at)

    planned = each(planned_anew, range(20))
    if profile is Profile.LSPB:
        return Figure("f, MOVES of 200 mm, verified", planned, "600")
    return Figure(f"f, MOVES of 200 mm, {profile.name}, verified", planned)


if __name__ == "__main__":
    main()

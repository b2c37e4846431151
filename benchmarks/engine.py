"""Planner f and position g beside what a user would pick instead: `python -m benchmarks engine`.

Every figure is a median of repeats in this one run, on this machine; compare ratios, not microseconds.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from math import radians
from typing import Any

import numpy as np

from benchmarks.peers import Peers, beside
from benchmarks.peers.timing import at_once, each
from benchmarks.report import Figure, show
from vrs_cli.engine.commands import JointTarget, Move, PoseTarget
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.planner import Here, plan, plan_motion
from vrs_cli.engine.position import joints_at, joints_over, positions_at
from vrs_cli.kinematics.model import load_robot
from vrs_cli.trajectory.blend import JointState
from vrs_cli.trajectory.motion import Kind, Motion, Start
from vrs_cli.trajectory.segment import JointPath
from vrs_cli.trajectory.timeline import Timeline

MODEL = load_robot("puma560")
MOTIONS = 3400  # of three segments each
TIMES = 1000  # read one by one
MANY = 100_000  # read at once, sorted
TASKS = 40  # motions planned
JERK_TIME = 0.1  # [s] to full acceleration, for peers that limit jerk


def main() -> None:
    peers = Peers()
    engine = wandering(MOTIONS)
    figures = [*reading(engine, peers), *planning(peers), *editing(engine), straight()]
    title = f"Engine; g on a timeline of {len(engine.timeline)} segments, {engine.end:.0f} s"
    show(title, figures, peers.missing)


def wandering(motions: int, seed: int = 1) -> Engine:
    """An engine with a timeline of so many joint-interpolated motions, three segments each."""
    engine, source = Engine(MODEL), random.Random(seed)
    for _ in range(motions):
        engine.perform(Move(JointTarget(_somewhere(source)), straight=False))
    return engine


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
    scipy = peers.figures("scipy_peer", {**_polynomials(timeline), "times": times, "many": many.tolist()})
    everything = at_once(lambda: positions_at(arm, timeline, many), MANY)
    return [
        Figure("g, one time, joints", one, "PPoly / 2", beside("g one", scipy)),
        Figure("g, 100,000 sorted times, joints, per time", joints, "2 x PPoly", beside("g many", scipy)),
        Figure("- velocity, acceleration, tool, hand as well", everything),
        Figure("an edit, and the next read of 1000 times", _edit_and_read(engine), "", beside("edit", scipy)),
    ]


def _polynomials(timeline: Timeline) -> dict[str, Any]:
    """The segments that last, for scipy: joints only, each of three coefficients."""
    segments = [s for s in timeline if s.duration and isinstance(s.path, JointPath)]
    rows = [[(*a, 0.0, 0.0)[:3] for a in s.path.coefficients] for s in segments]  # type: ignore[union-attr]
    return {"starts": [s.start for s in segments], "finish": segments[-1].finish, "coefficients": rows}


def _edit_and_read(engine: Engine) -> float:
    """An insertion in the middle, and 1000 times read of the new timeline there: no array is made anew."""
    arm, timeline, delta = engine.arm, engine.timeline, _insertion(engine)
    times = np.linspace(delta.cut - 500.0, delta.cut + 500.0, 1000)
    return at_once(lambda: joints_over(arm, timeline.apply(delta), times), 1)


# --- f -----------------------------------------------------------------------------------------------------------


def planning(peers: Peers) -> list[Figure]:
    """f for a joint motion, from rest and out of motion, without the timeline around it."""
    source = random.Random(3)
    still = (0.0,) * MODEL.joint_count
    from_rest = [(_somewhere(source), still, _somewhere(source)) for _ in range(TASKS)]
    from_motion = [(q, tuple(0.5 * v for v in MODEL.max_velocity), goal) for q, _, goal in from_rest]
    work = {
        "from_rest": from_rest,
        "from_motion": from_motion,
        "velocity": MODEL.max_velocity,
        "acceleration": MODEL.max_acceleration,
        "jerk": [a / JERK_TIME for a in MODEL.max_acceleration],
    }
    rest, motion = _planned(from_rest), _planned(from_motion)
    theirs = [peers.figures(name, work) for name in ("ruckig_peer", "toppra_peer", "toolbox_peer")]
    return [
        Figure("f, MOVE from rest", rest, "60", beside("f from_rest", *theirs)),
        Figure("f, MOVE out of motion", motion, "60", beside("f from_motion", *theirs)),
    ]


def _planned(tasks: list[tuple[tuple[float, ...], ...]]) -> float:
    arm = Engine(MODEL).arm

    def work(q: tuple[float, ...], v: tuple[float, ...], goal: tuple[float, ...]) -> object:
        return plan_motion(arm, Here(JointState(q, v)), Motion(1, Kind.JOINT, Start.AT, goal=goal), 0.0)

    return each(work, *zip(*tasks, strict=True), rounds=5)


def editing(engine: Engine) -> list[Figure]:
    """f with the timeline around it, and apply."""
    arm, timeline = engine.arm, engine.timeline
    last, end, delta = engine.deltas[-1].motion, engine.end, _insertion(engine)
    at = delta.cut

    def repeated(work: Callable[[], object]) -> float:
        return each(lambda _: work(), range(50))

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
    return plan(engine.arm, timeline, engine.deltas[-1].motion, at, at)


def straight() -> Figure:
    """f for a straight line of 200 mm, with every joint verified."""
    engine = Engine(MODEL)
    engine.perform(Move(JointTarget(tuple(map(radians, (0, -45, 180, 0, 45, 0)))), straight=False))
    pose = engine.position().T_world_tool
    engine.perform(Move(PoseTarget(pose._replace(py=pose.py + 0.2)), straight=True))
    before, at = engine.timeline, engine.end
    engine.perform(Move(PoseTarget(pose), straight=True))
    motion = engine.deltas[-1].motion
    return Figure(
        "f, MOVES of 200 mm, verified", each(lambda _: plan(engine.arm, before, motion, at, at), range(20)), "600"
    )


if __name__ == "__main__":
    main()

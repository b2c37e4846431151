"""The laws that a run keeps, each a generator of the faults that it finds, in words.

Lengths in metres, angles in radians. `Asked` is what the oracle expects of one edit of the timeline.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tests.oracle.programs import Motion, Settings
from tests.oracle.recording import Edit, Piece
from tests.oracle.robot import Array, Robot, angle, shift

GRID = 2.0**30  # times are multiples of 1 / GRID
PLACE, TURN = 1e-8, 1e-7  # of a target, whose numbers are rounded [m, rad]
CONTINUOUS, RATE = 1e-8, 1e-6  # at a boundary, one side of which may come from inverse kinematics
SMOOTH = ("scurve", "quintic")  # profiles whose acceleration does not jump
EXACT = 1e-9
LED = 1e-11  # [m] how near joints lead to a pose
ROUNDED = 1e-12
ROUNDING = 1.0 + 1e-6
HONEST = 1.001  # of a limit, by differences of positions 1 ms apart
MEASURE = 1e-4  # a configuration nearer to the other one is none of the two
SAMPLES = np.linspace(0.0, 1.0, 17)
MS = 1e-3

Faults = Iterator[str]


@dataclass(frozen=True)
class Asked:
    """A motion of the program, and the settings in force."""

    motion: Motion
    settings: Settings

    @property
    def goal(self) -> Array | None:
        """T_robot_tool of a target that is a place in the world."""
        return None if self.motion.pose is None else np.asarray(self.settings.base @ self.motion.pose)


@dataclass(frozen=True)
class Case:
    """One edit, and what is known of the motions by their numbers."""

    robot: Robot
    edit: Edit
    asked: dict[int, Asked]

    @property
    def mine(self) -> Asked | None:
        return self.asked.get(self.edit.motion["number"])


def of_edit(case: Case) -> Faults:
    """All laws of one edit."""
    for law in (order, past, stamp, continuity, rest_at_ends, targets, relative, pace, straightness, corner, words):
        yield from (f"{law.__name__}: {fault}" for fault in law(case))


# --- time --------------------------------------------------------------------------------------------------------


def order(case: Case) -> Faults:
    """Segments follow each other, at times of the grid; the tail is shifted, its paths untouched."""
    after, before, delta = case.edit.after, case.edit.before, case.edit.delta
    for a, b in pairwise(after):
        if not a.start <= a.finish <= b.start:
            yield f"[{a.start}, {a.finish}] before {b.start}"
    for piece in after:
        if any(t * GRID != round(t * GRID) for t in (piece.start, piece.finish)):
            yield f"[{piece.start}, {piece.finish}] is off the grid"
    if len(after) != len(before) - delta["drop"] + len(delta["segments"]):
        yield "the number of segments is wrong"


def past(case: Case) -> Faults:
    """What is before the execution time stays as it was."""
    executed = case.edit.delta["executed"]
    for part in SAMPLES[:-1]:
        t = executed * part
        if t < executed and not np.array_equal(at(case.edit.before, t), at(case.edit.after, t)):
            yield f"at {t} another place than before, although the edit is at {executed}"
            return


def at(timeline: list[Piece], t: float) -> Array:
    """Joints or pose at a time, as the segments have them."""
    piece = next((p for p in reversed(timeline) if p.start <= t), timeline[0])
    s = np.array([min(max(t - piece.start, 0.0), piece.duration)])
    return piece.joints_at(s)[0] if piece.line is None else piece.tool_at(s)[0]


def stamp(case: Case) -> Faults:
    """A motion begins when it is said to, and with AT or IN when the program says."""
    delta, new = case.edit.delta, case.edit.new
    if new and case.edit.after[new[0]].start != delta["executed"]:
        yield f"begins at {case.edit.after[new[0]].start}, said {delta['executed']}"
    if case.mine is None or case.mine.motion.at is None:
        return
    wanted = case.mine.motion.at + (delta["issued"] if case.mine.motion.relative else 0.0)
    if abs(delta["executed"] - wanted) > 1.0 / GRID:
        yield f"executed at {delta['executed']}, asked {wanted}"


# --- smoothness --------------------------------------------------------------------------------------------------


def continuity(case: Case) -> Faults:
    """Position and velocity go on from segment to segment; in a gap the arm stands."""
    for a, b in around(case.edit):
        left, right = edges(case.robot, a, b)
        place, turn = apart(case.robot, left[0], right[0])
        if place > CONTINUOUS or turn > TURN:
            yield f"at {b.start} a jump of {place} m, {turn} rad"
        if a.finish < b.start:
            left = (left[0], np.zeros_like(left[1]))
            if moves(a, a.duration):
                yield f"moves at {a.finish}, where a gap begins"
        leap = np.abs(left[1] - right[1])[case.robot.rates if left[0].ndim == 2 else slice(None)].max()
        if a.duration and b.duration and leap > RATE:
            yield f"at {b.start} the velocity jumps by {leap}"


def around(edit: Edit) -> Iterator[tuple[Piece, Piece]]:
    """Neighbours of which at least one is new."""
    first, last = max(edit.new.start - 1, 0), min(edit.new.stop + 1, len(edit.after))
    return pairwise(edit.after[first:last])


def edges(robot: Robot, a: Piece, b: Piece) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Place and velocity at the end of a and the start of b: joints if both are in joint space, else of the tool."""
    if a.line is None and b.line is None:
        return tuple((p.joints_at(s)[0], p.joints_at(s, 1)[0]) for p, s in ends(a, b))  # type: ignore[return-value]
    tool = (b if a.line is None else a).tool
    return tuple(tool_state(robot, p, s, tool) for p, s in ends(a, b))  # type: ignore[return-value]


def ends(a: Piece, b: Piece) -> tuple[tuple[Piece, Array], tuple[Piece, Array]]:
    return (a, np.array([a.duration])), (b, np.array([0.0]))


def tool_state(robot: Robot, piece: Piece, s: Array, tool: Array) -> tuple[Array, Array]:
    """Pose and twist of a tool that may be another than that of the motion."""
    if piece.line is None:
        q = piece.joints_at(s)
        return robot.tip(q, tool)[0], robot.twist(q, piece.joints_at(s, 1), tool)[0]
    T, (v, w) = piece.tool_at(s)[0], np.split(piece.twist_at(s)[0], 2)
    moved = T @ np.linalg.inv(piece.tool) @ tool
    return moved, np.concatenate((v + np.cross(w, moved[:3, 3] - T[:3, 3]), w))


def apart(robot: Robot, a: Array, b: Array) -> tuple[float, float]:
    """By how much two places differ: joints, or poses in what counts for the robot."""
    if a.ndim == 1:
        return float(np.abs(a - b).max()), 0.0
    return float(np.linalg.norm((a - b)[robot.places, 3])), float(angle(a, b)) if robot.turns else 0.0


def moves(piece: Piece, s: float, least: float = RATE) -> bool:
    rate = piece.joints_at(np.array([s]), 1) if piece.line is None else piece.twist_at(np.array([s]))
    return bool(np.abs(rate).max() > least)


def rest_at_ends(case: Case) -> Faults:
    """A timeline starts and ends at rest."""
    first, last = case.edit.after[0], case.edit.after[-1]
    if moves(first, 0.0):
        yield "the arm moves at the start"
    if moves(last, last.duration):
        yield f"the arm moves at the end, {last.finish}"


# --- places ------------------------------------------------------------------------------------------------------


def targets(case: Case) -> Faults:
    """Motions that come to rest are where the program sent them."""
    for index in case.edit.new:
        piece, asked = case.edit.after[index], case.asked.get(case.edit.after[index].motion["number"])
        later = case.edit.after[index + 1 :]
        if asked is None or (later and later[0].motion["number"] == piece.motion["number"]):
            continue
        if moves(piece, piece.duration):
            if piece.motion["number"] == case.edit.motion["number"] and not later:
                yield f"{asked.motion.text} does not come to rest"
        else:
            yield from missed(case.robot, asked, piece)


def missed(robot: Robot, asked: Asked, piece: Piece) -> Faults:
    """How a segment that should end on an absolute target does not."""
    if asked.motion.joints is not None:
        off = np.abs(end_joints(piece) - asked.motion.joints).max()
        if off > CONTINUOUS:
            yield f"{asked.motion.text} ends {off} from its joints"
    goal = asked.goal
    if goal is not None:
        yield from off_pose(robot, end_pose(robot, piece), goal, asked.motion.text)


def off_pose(robot: Robot, pose: Array, goal: Array, text: str) -> Faults:
    place, turn = apart(robot, pose, goal)
    if place > PLACE or turn > TURN:
        yield f"{text} ends {place} m, {turn} rad from its target"


def relative(case: Case) -> Faults:
    """DRIVE and DEPART go on from where the motion before ends."""
    asked, own = case.mine, pieces_of(case)
    if asked is None or not own:
        return
    start = case.edit.before[-1]
    if asked.motion.drive is not None:
        joint, change = asked.motion.drive
        wanted = end_joints(start).copy()
        wanted[joint] += change
        off = np.abs(end_joints(own[-1]) - wanted).max()
        if off > CONTINUOUS:
            yield f"{asked.motion.text} ends {off} from where it should"
    if asked.motion.back is not None:
        flange = end_pose(case.robot, start) @ np.linalg.inv(start.tool)
        goal = flange @ own[-1].tool @ shift(0.0, 0.0, -asked.motion.back)[0]
        yield from off_pose(case.robot, end_pose(case.robot, own[-1]), goal, asked.motion.text)


def end_joints(piece: Piece) -> Array:
    """The joints at the end; on a line those of the last seed."""
    if piece.line is None:
        return np.asarray(piece.joints_at(np.array([piece.duration]))[0])
    return np.array(piece.line["seeds"][-1])


def end_pose(robot: Robot, piece: Piece) -> Array:
    """T_robot_tool at the end."""
    if piece.line is None:
        return np.asarray(robot.tip(end_joints(piece)[None], piece.tool)[0])
    return np.asarray(piece.tool_at(np.array([piece.duration]))[0])


def words(case: Case) -> Faults:
    """A MOVE ends in the configuration that was asked for; a line keeps the one that it has."""
    robot, asked = case.robot, case.mine
    own = pieces_of(case)
    if asked is None or not own:
        return
    if asked.motion.pose is not None and not asked.motion.straight:
        have = robot.words(end_joints(own[-1]))
        for place, word in asked.settings.words.items() if have else ():
            if have[place][0] != word and have[place][1] > MEASURE:
                yield f"{asked.motion.text} ends {have[place][0]}, {word} was asked for"
    for piece in own:
        seeds = [] if piece.line is None else [robot.words(np.array(q)) for q in piece.line["seeds"]]
        for place in zip(*seeds, strict=True):
            if len({word for word, measure in place if measure > MEASURE}) > 1:
                yield f"{asked.motion.text} changes its configuration at {piece.start} to {piece.finish}"


# --- ways --------------------------------------------------------------------------------------------------------


def from_rest(case: Case) -> list[Piece]:
    """The segments of the motion of an edit, if it begins at rest."""
    own = pieces_of(case)
    return [] if not own or moves(own[0], 0.0, EXACT) or swings(own[0]) else own


def pieces_of(case: Case) -> list[Piece]:
    """Those that an edit made for its own motion."""
    new = (case.edit.after[i] for i in case.edit.new)
    return [piece for piece in new if piece.motion["number"] == case.edit.motion["number"]]


def swings(piece: Piece) -> bool:
    """Whether a jerk-limited motion carries an acceleration on."""
    rows = piece.joints if piece.line is None else piece.line["position"]
    return piece.motion.get("profile") in SMOOTH and any(abs(row[2]) > EXACT for row in rows if len(row) > 2)


def pace(case: Case) -> Faults:
    """From rest no motion is faster, or speeds up more, than SPEED and ACCEL say."""
    if case.mine is None:
        return
    settings, tool = case.mine.settings, case.robot.tool
    speed, a = settings.speed, settings.acceleration
    fraction = case.mine.motion.speed or speed.fraction
    for piece in from_rest(case):
        s = SAMPLES * piece.duration
        if piece.line is None:
            have = [*(np.abs(piece.joints_at(s, k)).max(axis=0) for k in (1, 2))]
            most = [case.robot.velocity * fraction, case.robot.acceleration * a]
        else:
            parts = (*np.split(piece.twist_at(s), 2, axis=1), piece.acceleration_at(s))
            have = [np.linalg.norm(part, axis=1).max() for part in parts]
            most = [tool["linear_speed"] * speed.fraction, tool["angular_speed"] * speed.rotation]
            most.append(tool["linear_acceleration"] * a)
        if any(np.any(x > ROUNDING * y + RATE) for x, y in zip(have, most, strict=True)):
            yield f"{case.mine.motion.text} from {piece.start}: {have}, asked {most}"


def straightness(case: Case) -> Faults:
    """From rest a line is straight, for the tool or for the joints, and never goes back."""
    own = from_rest(case)
    if case.mine is None or not own or moves(own[-1], own[-1].duration):
        return
    if len({piece.line is None for piece in own}) > 1:
        return  # it stops first, where its line would lead out of reach
    start, end = place_at(own[0], 0.0), place_at(own[-1], own[-1].duration)
    way = (end - start) / max(np.linalg.norm(end - start), ROUNDED)
    for piece in own:
        off = np.array([place_at(piece, part * piece.duration) for part in SAMPLES]) - start
        along = off @ way
        if np.linalg.norm(off - along[:, None] * way, axis=1).max() > CONTINUOUS:
            yield f"{case.mine.motion.text} leaves its line from {piece.start}"
        if (np.diff(along) < -ROUNDED).any():
            yield f"{case.mine.motion.text} goes back on its line from {piece.start}"


def place_at(piece: Piece, s: float) -> Array:
    """The joints, or the place of the tool."""
    at_s = np.array([s])
    return np.asarray(piece.joints_at(at_s)[0] if piece.line is None else piece.tool_at(at_s)[0, :3, 3])


def corner(case: Case) -> Faults:
    """A motion that rounds a corner leaves the one before no farther from the corner than ROUNDING says."""
    asked, new = case.mine, case.edit.new
    if asked is None or asked.motion.at is not None or asked.settings.rounding is None or not new or not new.start:
        return
    before = case.edit.after[new.start - 1]
    cut = next((p for p in reversed(case.edit.before) if p.motion["number"] == before.motion["number"]), None)
    if cut is None or not moves(before, before.duration) or before.finish < case.edit.after[new.start].start:
        return
    gap = apart(case.robot, end_pose(case.robot, before), end_pose(case.robot, cut))[0]
    if gap > asked.settings.rounding + 2e-5:
        yield f"{asked.motion.text} leaves the corner {gap} m before it, {asked.settings.rounding} was asked for"


# --- every millisecond -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Samples:
    """The robot at every millisecond and the exact end, as it is exported: (N,), (N, n), (N, n), (N, 3)."""

    times: Array
    joints: Array
    velocities: Array
    xyz: Array


def every_millisecond(robot: Robot, timeline: list[Piece], samples: Samples) -> Faults:
    """Joints are where the segments say, in their ranges, and keep their limits by honest differences."""
    starts = np.array([piece.start for piece in timeline])
    index = np.maximum(np.searchsorted(starts, samples.times, side="right") - 1, 0)
    yield from leads_there(robot, timeline, samples, index)
    outside = ((samples.joints < robot.lower - EXACT) | (samples.joints > robot.upper + EXACT)).any(axis=1)
    if outside.any():
        yield f"a joint leaves its range at {samples.times[outside][0]}"
    if np.abs(samples.velocities[[0, -1]]).max() > RATE:
        yield "the arm does not rest at both ends"
    yield from limits(robot, samples, jerk_limited(timeline, samples, index))
    yield from rates_of_places(robot, samples)


def jerk_limited(timeline: list[Piece], samples: Samples, index: Array) -> Array:
    """(N,): whether the jerk is limited there."""
    smooth = np.array([piece.motion.get("profile") in SMOOTH for piece in timeline])
    return np.asarray(smooth[index] & (samples.times < np.array([piece.finish for piece in timeline])[index]))


def limits(robot: Robot, samples: Samples, smooth: Array) -> Faults:
    q, t = samples.joints[:-1], samples.times
    for k, what in enumerate(("velocity", "acceleration", "jerk"), 1):
        rate = np.abs(np.diff(q, k, axis=0)) / MS**k / getattr(robot, what)
        if what == "jerk":  # where it is limited all the time
            rate[~np.array([smooth[i : i + len(rate)] for i in range(k + 1)]).all(axis=0)] = 0.0
        if rate.size and rate.max() > HONEST:
            row, joint = np.unravel_index(rate.argmax(), rate.shape)
            yield f"joint {joint + 1} has {rate.max():.6f} of its {what} at {t[row]:.3f}"


def rates_of_places(robot: Robot, samples: Samples) -> Faults:
    """The velocity that is told is that of the joints."""
    q, v = samples.joints[:-1], samples.velocities[:-1]
    off = np.abs(np.diff(q, axis=0) - (v[:-1] + v[1:]) / 2 * MS) > robot.acceleration * MS * MS + ROUNDED
    if off.any():
        yield f"the velocity is not that of the joints at {samples.times[off.any(axis=1).argmax()]:.3f}"


def leads_there(robot: Robot, timeline: list[Piece], samples: Samples, index: Array) -> Faults:
    """Exported joints and places are those of the segments."""
    for i in np.unique(index):
        piece, rows = timeline[i], index == i
        s, q = np.clip(samples.times[rows] - piece.start, 0.0, piece.duration), samples.joints[rows]
        tip = robot.tip(q, piece.tool)
        world = np.linalg.norm((np.linalg.inv(piece.base) @ tip)[:, :3, 3] - samples.xyz[rows], axis=1).max()
        if world > LED:
            yield f"the tool is told {world} m from where the joints lead, from {piece.start}"
        if piece.line is None:
            off = np.abs(piece.joints_at(s) - q).max()
        else:
            want = piece.tool_at(s)
            off = np.linalg.norm((want - tip)[:, robot.places, 3], axis=1).max()
            if robot.turns and angle(want, tip).max() > TURN:
                yield f"the tool is turned by {angle(want, tip).max()} beside its line, from {piece.start}"
        if off > LED:
            yield f"the joints are {off} from where they should be, from {piece.start}"

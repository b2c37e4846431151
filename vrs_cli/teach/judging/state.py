"""Judge the state of a robot: joints, variables, settings, one motion, the timeline."""

from __future__ import annotations

from itertools import pairwise
from math import degrees, inf

from msgspec import Struct

from vrs_cli.engine.approximation import ToolPath, distance_from_line
from vrs_cli.engine.position import joints_at, position_at
from vrs_cli.engine.settings import Settings
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, Vector, angle_between, compose, distance, position
from vrs_cli.teach import checks
from vrs_cli.teach.judging.basis import Basis, Evidence, JudgedRun, Verdict, exceeds, falls_short, figure, round_to
from vrs_cli.values.commands import Motion, MotionKind

PATH_ERROR = 1e-5  # [m] maximum error of the lines that approximate the path of the tool
MOVES = (MotionKind.JOINT, MotionKind.STRAIGHT)


def _verdict(right: bool, reason: str, at: float | None = None) -> Verdict:
    """Return a verdict with all points, or with none."""
    return Verdict(float(right), reason, at)


# --- joints and places ------------------------------------------------------------------------------------------------


def judge_joints(check: checks.JointsCheck, run: JudgedRun) -> Verdict:
    """Judge the joints at the end of the run, at a time, or at the ends of motions."""
    evidence, basis = run.evidence, run.basis
    units, step = evidence.arm.model.units, basis.rounding.deg

    def fits(q: Joints) -> bool:
        pairs = zip(units.to_display(q), check.at, strict=False)
        return all(wanted is None or not exceeds(abs(one - wanted), check.deg, step) for one, wanted in pairs)

    if check.time is None and check.when is checks.When.PASSED:
        ends = [one.end for one in commanded_motions(evidence)]
        count = sum(fits(joints_at(evidence.arm, evidence.timeline, end)) for end in ends)
        return _verdict(count >= check.count, f"{count} motions ended there, {check.count} are wanted")
    t = evidence.end if check.time is None else check.time
    q = joints_at(evidence.arm, evidence.timeline, t)
    shown = ", ".join(figure(one, step) for one in units.to_display(q))
    return _verdict(fits(q), f"the joints are {shown} at {figure(t, basis.rounding.s)} s", t)


def judge_location(check: checks.LocationCheck, run: JudgedRun) -> Verdict:
    evidence, basis = run.evidence, run.basis
    found: Transform | None = None
    for item in check.of.items:
        value = evidence.variables.get(item)
        if not isinstance(value, Transform):
            return _verdict(False, f"{check.of.text} is not defined")
        found = value if found is None else compose(found, value)
    wanted = basis.place(check.at)
    assert found is not None, "a name has a part"
    far, off = 1000.0 * distance(found, wanted), degrees(angle_between(found, wanted))
    text = f"{check.of.text} is {figure(far, basis.rounding.mm)} mm from the place that is wanted"
    right = not exceeds(far, check.mm, basis.rounding.mm)
    if check.deg is not None:
        text += f", turned by {figure(off, basis.rounding.deg)} deg"
        right &= not exceeds(off, check.deg, basis.rounding.deg)
    return _verdict(right, text)


def judge_configuration(check: checks.ConfigurationCheck, run: JudgedRun) -> Verdict:
    evidence = run.evidence
    q = joints_at(evidence.arm, evidence.timeline, evidence.end)
    words = str(evidence.arm.configuration(q)).split()
    return _verdict(set(check.words) <= set(words), f"the arm is {' '.join(words)}", evidence.end)


# --- values -----------------------------------------------------------------------------------------------------------


def judge_variable(check: checks.VariableCheck, run: JudgedRun) -> Verdict:
    evidence = run.evidence
    value = evidence.variables.get(check.of.items[0])
    if value is None:
        return _verdict(False, f"{check.of.text} has no value")
    if isinstance(value, float | int) and isinstance(check.value, float):
        right = abs(value - check.value) <= check.within + 1e-9
    else:
        right = value == check.value
    shown = f"{value:.7g}" if isinstance(value, float) else str(value)
    return _verdict(right, f"{check.of.text} is {shown}")


def judge_setting(check: checks.SettingCheck, run: JudgedRun) -> Verdict:
    """Judge a switch or a parameter."""
    evidence = run.evidence
    value = _setting(evidence.settings, check.of)
    return _verdict(value == check.value, f"{check.of} is {value}")


def _setting(settings: Settings, name: str) -> float | str:
    if name in settings.switches:
        return "ON" if settings.switches[name] else "OFF"
    return settings.parameters[name]


def judge_program(check: checks.ProgramCheck, run: JudgedRun) -> Verdict:
    evidence = run.evidence
    there = any(one.key == check.of for one in evidence.programs)
    return _verdict(there, f"there is {'a' if there else 'no'} program {check.of}")


def judge_undone(check: checks.UndoneCheck, run: JudgedRun) -> Verdict:
    """Judge the number of undone commands."""
    evidence = run.evidence
    return _verdict(evidence.undone >= check.commands, f"commands taken back: {evidence.undone}")


# --- the timeline -----------------------------------------------------------------------------------------------------


class CommandedMotion(Struct, frozen=True):
    """A motion on the timeline: its command, the time of its start and the time of its end [s]."""

    motion: Motion
    begin: float
    end: float


def commanded_motions(evidence: Evidence) -> list[CommandedMotion]:
    """Return the motions that were commanded in the step, in the order of their commands. If a later motion cuts a
    motion short, the motion ends at the cut."""
    found = dict[int, CommandedMotion]()
    for segment in evidence.timeline:
        motion = segment.motion
        if motion.number and motion.kind in MOVES and segment.duration > 0.0:
            begin = found[motion.number].begin if motion.number in found else segment.start
            found[motion.number] = CommandedMotion(motion, begin, segment.finish)
    return [one for _, one in sorted(found.items()) if one.begin >= evidence.started]


def judge_motion(check: checks.MotionCheck, run: JudgedRun) -> Verdict:
    evidence, basis = run.evidence, run.basis
    motions = commanded_motions(evidence)
    if not motions:
        return _verdict(False, "nothing has moved in this step")
    wrong = [_wrong(check, one, evidence, basis) for one in (motions[-1:] if check.last else motions)]
    return _verdict(
        "" in wrong, next(filter(None, reversed(wrong)), "the motion is as it is wanted"), motions[-1].begin
    )


def _wrong(check: checks.MotionCheck, one: CommandedMotion, evidence: Evidence, basis: Basis) -> str:
    """Describe the requirements that a motion does not meet; return "" if it meets all."""
    arm, timeline, step = evidence.arm, evidence.timeline, basis.rounding.s
    if check.space not in (None, one.motion.kind):
        return f"{one.motion.text} is a motion in {one.motion.kind.value} space"
    if check.profile not in (None, one.motion.profile):
        return f"{one.motion.text} has the profile {one.motion.profile.name}"
    if check.seconds is not None and not _inside(one.end - one.begin, check.seconds, step):
        return f"{one.motion.text} takes {figure(one.end - one.begin, step)} s"
    if check.begins is not None and exceeds(abs(one.begin - check.begins), 0.0, step):
        return f"{one.motion.text} begins at {figure(one.begin, step)} s"
    ends = [position_at(arm, timeline, t) for t in (one.begin, one.end)]
    if check.mm is not None:
        far = 1000.0 * distance(ends[0].T_world_tool, ends[1].T_world_tool)
        if not _inside(far, check.mm, basis.rounding.mm):
            return f"{one.motion.text} ends {figure(far, basis.rounding.mm)} mm from where it begins"
    turning = sum(abs(a - b) > 1e-9 for a, b in zip(ends[0].joints, ends[1].joints, strict=True))
    if turning < check.joints:
        return f"{one.motion.text} turns {turning} joints"
    record = next((record for record in evidence.commands if record.number == one.motion.number), None)
    if record is None:
        return f"it is not known when {one.motion.text} was commanded"
    if check.displaced is not None and record.is_displaced is not check.displaced:
        return f"{record.text} begins {'at another' if record.is_displaced else 'at the'} time than was asked"
    if falls_short(record.executed - record.issued, check.lead, step):
        return f"{record.text} begins {figure(record.executed - record.issued, step)} s after its command"
    return ""


def _inside(value: float, span: checks.ValueRange, step: float) -> bool:
    return not falls_short(value, span.least, step) and not exceeds(value, span.most, step)


def judge_phases(check: checks.PhasesCheck, run: JudgedRun) -> Verdict:
    """Judge the phases of the segments, without segments of zero length."""
    evidence = run.evidence
    phases = [one.phase for one in evidence.timeline if one.motion.number and one.duration > 0.0]
    order, length = list(check.order), len(check.order)
    places = range(len(phases) - length + 1)
    right = phases == order if check.only else any(phases[at : at + length] == order for at in places)
    names = [one.value for one in phases]
    shown = names if len(names) <= 12 else [*names[:6], "...", *names[-6:]]
    return _verdict(right, f"the timeline has {', '.join(shown) or 'no motion'}")


def judge_passes(check: checks.PassesCheck, run: JudgedRun) -> Verdict:
    """Judge how close the tool came to a place in the step."""
    evidence, basis = run.evidence, run.basis
    place = position(basis.place(check.at))
    near, t = _nearest(evidence, place)
    step = basis.rounding.mm
    if near == inf:
        return _verdict(False, "nothing has moved in this step")
    text = f"the tool comes within {figure(1000.0 * near, step)} mm of the place"
    return _verdict(_inside(1000.0 * near, check.mm, step), text, round_to(t, basis.rounding.s))


def _nearest(evidence: Evidence, place: Vector) -> tuple[float, float]:
    """Return the minimum distance of the tool's tip from a position [m], and its time [s]."""
    lines = ToolPath(evidence.arm, PATH_ERROR).lines(evidence.timeline, evidence.started, evidence.end)
    found = (inf, evidence.started)
    for line in lines:
        if line.begin >= evidence.started:
            points = zip(line.times, line.points, strict=True)
            for (t, a), (_, b) in pairwise(points):
                found = min(found, (distance_from_line(place, a, b), line.offset + t))
    return found

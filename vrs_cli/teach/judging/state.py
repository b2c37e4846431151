"""Judge the state of a robot: joints, variables, settings, one motion, the timeline."""

from __future__ import annotations

from itertools import pairwise
from math import degrees, inf

from msgspec import Struct

from vrs_cli.engine.approximation import ToolPath, distance_from_line
from vrs_cli.engine.position import joints_at, position_at
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import angle_between, distance
from vrs_cli.teach import checks
from vrs_cli.teach.judging import basis
from vrs_cli.values.commands import Motion, MotionKind

PATH_ERROR = 1e-5  # [m] maximum error of the lines that approximate the path of the tool
MOVES = (MotionKind.JOINT, MotionKind.STRAIGHT)


def _verdict(right: bool, reason: str, at: float | None = None) -> basis.Verdict:
    """Return a verdict with all points, or with none."""
    return basis.Verdict(float(right), reason, at)


# --- joints and places ------------------------------------------------------------------------------------------------


def judge_joints(check: checks.JointsCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge the joints at the end of the run, at a time, or at the ends of motions."""
    evidence, units, step = run.evidence, run.evidence.arm.model.units, run.basis.rounding.deg

    def fits(q: Joints) -> bool:
        pairs = zip(units.to_display(q), check.at, strict=False)
        return all(wanted is None or not basis.exceeds(abs(one - wanted), check.deg, step) for one, wanted in pairs)

    if check.time is None and check.when is checks.When.PASSED:
        count = sum(fits(joints_at(evidence.arm, evidence.timeline, one.end)) for one in commanded_motions(evidence))
        return _verdict(count >= check.count, f"{count} motions ended there, {check.count} are wanted")
    t = evidence.end if check.time is None else check.time
    q = joints_at(evidence.arm, evidence.timeline, t)
    shown = ", ".join(basis.figure(one, step) for one in units.to_display(q))
    return _verdict(fits(q), f"the joints are {shown} at {basis.figure(t, run.s)} s", t)


def judge_location(check: checks.LocationCheck, run: basis.JudgedRun) -> basis.Verdict:
    found, step = basis.compound_pose(check.of.items, run.evidence.variables), run.basis.rounding.deg
    if found is None:
        return _verdict(False, f"{check.of.text} is not defined")
    wanted = run.basis.place(check.at)
    far, off = 1000.0 * distance(found, wanted), degrees(angle_between(found, wanted))
    text = f"{check.of.text} is {basis.figure(far, run.mm)} mm from the place that is wanted"
    right = not basis.exceeds(far, check.mm, run.mm)
    if check.deg is not None:
        text += f", turned by {basis.figure(off, step)} deg"
        right &= not basis.exceeds(off, check.deg, step)
    return _verdict(right, text)


def judge_configuration(check: checks.ConfigurationCheck, run: basis.JudgedRun) -> basis.Verdict:
    evidence = run.evidence
    words = str(evidence.arm.configuration(joints_at(evidence.arm, evidence.timeline, evidence.end))).split()
    return _verdict(set(check.words) <= set(words), f"the arm is {' '.join(words)}", evidence.end)


# --- values -----------------------------------------------------------------------------------------------------------


def judge_variable(check: checks.VariableCheck, run: basis.JudgedRun) -> basis.Verdict:
    value = run.evidence.variables.get(check.of.items[0])
    if value is None:
        return _verdict(False, f"{check.of.text} has no value")
    if isinstance(value, float | int) and isinstance(check.value, float):
        right = abs(value - check.value) <= check.within + 1e-9
    else:
        right = value == check.value
    return _verdict(right, f"{check.of.text} is {f'{value:.7g}' if isinstance(value, float) else value}")


def judge_setting(check: checks.SettingCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge a switch or a parameter."""
    settings = run.evidence.settings
    values = {**settings.parameters, **{name: "ON" if on else "OFF" for name, on in settings.switches.items()}}
    return _verdict(values[check.of] == check.value, f"{check.of} is {values[check.of]}")


def judge_program(check: checks.ProgramCheck, run: basis.JudgedRun) -> basis.Verdict:
    there = any(one.key == check.of for one in run.evidence.programs)
    return _verdict(there, f"there is {'a' if there else 'no'} program {check.of}")


def judge_undone(check: checks.UndoneCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge the number of undone commands."""
    undone = run.evidence.undone
    return _verdict(undone >= check.commands, f"commands taken back: {undone}")


# --- the timeline -----------------------------------------------------------------------------------------------------


class CommandedMotion(Struct, frozen=True):
    """A motion on the timeline: its command, the time of its start and the time of its end [s]."""

    motion: Motion
    begin: float
    end: float


def commanded_motions(evidence: basis.Evidence) -> list[CommandedMotion]:
    """Return the motions that were commanded in the step, in the order of their commands. If a later motion interrupts
    a motion, the interrupted motion ends at that time."""
    found = dict[int, CommandedMotion]()
    for segment in evidence.timeline:
        motion = segment.motion
        if motion.number and motion.kind in MOVES and segment.duration > 0.0:
            begin = found[motion.number].begin if motion.number in found else segment.start
            found[motion.number] = CommandedMotion(motion, begin, segment.finish)
    return [one for _, one in sorted(found.items()) if one.begin >= evidence.started]


def judge_motion(check: checks.MotionCheck, run: basis.JudgedRun) -> basis.Verdict:
    motions = commanded_motions(run.evidence)
    if not motions:
        return _verdict(False, "nothing has moved in this step")
    wrong = [_wrong(check, one, run) for one in (motions[-1:] if check.last else motions)]
    return _verdict(
        "" in wrong, next(filter(None, reversed(wrong)), "the motion is as it is wanted"), motions[-1].begin
    )


def _wrong(check: checks.MotionCheck, one: CommandedMotion, run: basis.JudgedRun) -> str:
    """Describe the first requirement of a check that the motion `one` does not meet; return "" if it meets all."""
    evidence, step = run.evidence, run.s
    if check.space not in (None, one.motion.kind):
        return f"{one.motion.text} is a motion in {one.motion.kind.value} space"
    if check.profile not in (None, one.motion.profile):
        return f"{one.motion.text} has the profile {one.motion.profile.name}"
    if check.seconds is not None and not _inside(one.end - one.begin, check.seconds, step):
        return f"{one.motion.text} takes {basis.figure(one.end - one.begin, step)} s"
    if check.begins is not None and basis.exceeds(abs(one.begin - check.begins), 0.0, step):
        return f"{one.motion.text} begins at {basis.figure(one.begin, step)} s"
    ends = [position_at(evidence.arm, evidence.timeline, t) for t in (one.begin, one.end)]
    if check.mm is not None:
        far = 1000.0 * distance(ends[0].T_world_tool, ends[1].T_world_tool)
        if not _inside(far, check.mm, run.mm):
            return f"{one.motion.text} ends {basis.figure(far, run.mm)} mm from where it begins"
    turning = sum(abs(a - b) > 1e-9 for a, b in zip(ends[0].joints, ends[1].joints, strict=True))
    if turning < check.joints:
        return f"{one.motion.text} turns {turning} joints"
    record = next((record for record in evidence.commands if record.number == one.motion.number), None)
    if record is None:
        return f"it is not known when {one.motion.text} was commanded"
    if check.displaced is not None and record.is_displaced is not check.displaced:
        return f"{record.text} begins {'at another' if record.is_displaced else 'at the'} time than was asked"
    if basis.falls_short(record.executed - record.issued, check.lead, step):
        return f"{record.text} begins {basis.figure(record.executed - record.issued, step)} s after its command"
    return ""


def _inside(value: float, span: checks.ValueRange, step: float) -> bool:
    return not basis.falls_short(value, span.least, step) and not basis.exceeds(value, span.most, step)


def judge_phases(check: checks.PhasesCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge the phases of the timeline's segments, except those of zero duration."""
    phases = [one.phase for one in run.evidence.timeline if one.motion.number and one.duration > 0.0]
    order, length = list(check.order), len(check.order)
    right = phases == order if check.only else any(phases[at : at + length] == order for at in range(len(phases)))
    names = [one.value for one in phases]
    shown = names if len(names) <= 12 else [*names[:6], "...", *names[-6:]]
    return _verdict(right, f"the timeline has {', '.join(shown) or 'no motion'}")


def judge_passes(check: checks.PassesCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge how close the tool came to a place in the step."""
    evidence, place, step = run.evidence, run.basis.point(check.at), run.mm
    distances = (
        (distance_from_line(place, a, b), line.offset + t)
        for line in ToolPath(evidence.arm, PATH_ERROR).lines(evidence.timeline, evidence.started, evidence.end)
        if line.begin >= evidence.started
        for (t, a), (_, b) in pairwise(zip(line.times, line.points, strict=True))
    )
    near, t = min(distances, default=(inf, evidence.started))
    if near == inf:
        return _verdict(False, "nothing has moved in this step")
    text = f"the tool comes within {basis.figure(1000.0 * near, step)} mm of the place"
    return _verdict(_inside(1000.0 * near, check.mm, step), text, basis.round_to(t, run.s))

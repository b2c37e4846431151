"""Judge the outcome of a run: its output (signals, typed lines), the words of its program, its end, its duration, its
errors, and what the arm touched."""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from math import degrees, dist, inf
from typing import TYPE_CHECKING, NamedTuple

from msgspec.structs import replace

from vrs_cli.engine.position import position_at
from vrs_cli.interfaces.tasks.performing import TypedLine
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, angle_between, at_position, distance, position, vector_sum
from vrs_cli.language.analysis.structure import beyond
from vrs_cli.language.text import ast
from vrs_cli.language.text.printer import statement_text
from vrs_cli.language.words.values import OUTPUTS
from vrs_cli.teach import checks
from vrs_cli.teach.judging import basis
from vrs_cli.teach.judging.ways import PASSED_MM, did_not_go, windows
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.values.numbers import count
from vrs_cli.values.results import RunOutcome
from vrs_cli.values.scene import CellScene
from vrs_cli.values.world import Contact
from vrs_cli.world.course import PartState

if TYPE_CHECKING:
    from vrs_cli.contacts.checker import Checker


class OutputChange(NamedTuple):
    """A change of an output, `t` seconds after the run began: on, or off if the number is negative."""

    t: float
    signal: int


def output_changes(run: basis.JudgedRun) -> list[OutputChange]:
    """Return the changes of all outputs in a run, in order of time."""
    it = run.evidence
    found = [
        OutputChange(t - it.started, channel if value > 0.0 else -channel)
        for channel in it.timeline.channels
        if channel in OUTPUTS
        for t, value in it.timeline.changes(channel)
        if it.started <= t <= it.end
    ]
    return sorted(found, key=lambda change: change.t)


def came_on(signal: int, run: basis.JudgedRun) -> float | None:
    """Return when an input first turned on [s since the run began]; None if it did not."""
    it = run.evidence
    found = [t for t, value in it.timeline.changes(signal) if value > 0.0 and it.started <= t <= it.end]
    t = it.started
    while it.course is not None and (change := it.course.next_change(t, it.end)) is not None:
        t, number, on = change
        if number == signal and on:
            found.append(t)
            break
    return min(found) - it.started if found else None


def judge_signals(check: checks.SignalsCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge whether outputs changed in the required order and at the required times."""
    seen, total, used = output_changes(run), len(check.changes), set[int]()
    first, last = 0, 0.0
    for found, wanted in enumerate(check.changes):
        place = next((k for k in range(first, len(seen)) if _wrong(wanted, seen[k], run) is None), None)
        if place is None:
            return basis.Verdict(found / total, _missing(wanted, seen[first:], found, total, run), run.evidence.end)
        used.add(place)
        first, last = place + 1, seen[place].t
    if check.only:
        named = {abs(one.signal) for one in check.changes}
        more = [one for k, one in enumerate(seen) if k not in used and abs(one.signal) in named]
        if more:
            what = f"signal {abs(more[0].signal)} {_verb(more[0].signal)} at {basis.figure(more[0].t, run.s)} s as well"
            return basis.Verdict(basis.HALF, f"{what}, which is not wanted", run.evidence.started + more[0].t)
    return basis.Verdict(1.0, f"{count(total, 'signal')} changed as wanted", run.evidence.started + last)


def _wrong(wanted: checks.SignalChange, seen: OutputChange, run: basis.JudgedRun) -> str | None:
    """Return why a change differs from the required one: None if they are equal, "" if another signal changed."""
    if seen.signal != wanted.signal:
        return ""
    when, step = basis.figure(seen.t, run.s), run.s
    since, later = 0.0, ""
    if wanted.since is not None:
        came = came_on(wanted.since, run)
        if came is None:
            return f"at {when} s, and signal {wanted.since} never came on"
        since, later = came, f" after signal {wanted.since} came on at {basis.figure(came, step)} s"
    if basis.falls_short(seen.t - since, wanted.after, step):
        return f"at {when} s, it is wanted at {basis.figure(wanted.after, step)} s{later} or later"
    if basis.exceeds(seen.t - since, wanted.before, step):
        return f"at {when} s, it is wanted by {basis.figure(wanted.before, step)} s{later}"
    if wanted.near is not None:
        it = run.evidence
        place = run.basis.point(wanted.near)
        tip = position(position_at(it.arm, it.timeline, it.started + seen.t).T_world_tool)
        far = 1000.0 * dist(tip, place)
        if basis.exceeds(far, wanted.mm, run.mm):
            away = f"{basis.figure(far, run.mm)} mm from {run.place_text(place)}"
            allowed = f"{basis.figure(wanted.mm, run.mm)} mm allowed"
            return f"at {when} s with the tool at {run.place_text(tip)}, {away}, {allowed}"
    return None


def _missing(
    wanted: checks.SignalChange, rest: Sequence[OutputChange], found: int, total: int, run: basis.JudgedRun
) -> str:
    """Return the reason to show for a required change that the run does not contain."""
    name, done = f"signal {abs(wanted.signal)}", f"{found} of {count(total, 'change')} right"
    reasons = (f"{name} {_verb(one.signal)} {wrong} ({done})" for one in rest if (wrong := _wrong(wanted, one, run)))
    did = "come on" if wanted.signal > 0 else "go off"
    return next(reasons, f"{name} did not {did}{' after that' if found else ''} ({done})")


def _verb(signal: int) -> str:
    return "came on" if signal > 0 else "went off"


MAX_SHOWN_CHARS = 60

# --- words of the program --------------------------------------------------------------------------------------------


def judge_words(check: checks.WordsCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge the words in the submitted programs that can run."""
    used = frozenset(word for program in run.evidence.programs for one in program.statements for word in words_of(one))
    missing = [word for word in check.use if not _uses(run.evidence.programs, used, word)]
    wrong = [word for word in check.avoid if _uses(run.evidence.programs, used, word)]
    reasons = [f"the program does not use {_word_list(missing)}"] if missing else []
    if wrong:
        reasons.append(f"the program uses {_word_list(wrong)}, which it must not use")
    share = 1.0 - (len(missing) + len(wrong)) / (len(check.use) + len(check.avoid))
    return basis.Verdict(share, "; ".join(reasons) or "the program uses the words that it should")


def _word_list(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _uses(programs: Iterable[ast.Program], used: Container[str], word: str) -> bool:
    """Return whether programs use a word, or an instruction that begins with given words, such as `ENABLE CP`."""
    wanted = " ".join(word.upper().split())
    if " " not in wanted:
        return wanted in used
    statements = (one for program in programs for one in program.statements if not isinstance(one, ast.BadLine))
    return any(f"{statement_text(one).upper()} ".startswith(f"{wanted} ") for one in statements)


_CONTROL: Mapping[type, str] = {
    ast.Goto: "GOTO",
    ast.If: "IF",
    ast.Else: "ELSE",
    ast.While: "WHILE",
    ast.Do: "DO",
    ast.Until: "UNTIL",
    ast.For: "FOR",
    ast.Case: "CASE",
    ast.Value: "VALUE",
    ast.Any: "ANY",
    ast.End: "END",
}


def words_of(statement: ast.Statement) -> Iterator[str]:
    """Yield the words of the language in a statement, in capitals."""
    for node in ast.nodes(statement):
        match node:
            case ast.Instruction(word=word) | ast.Unary(operator=word) | ast.Binary(operator=word):
                yield word
            case ast.Call(name=word) | ast.BareWord(text=word):
                yield word.upper()
            case ast.IfGoto():
                yield from ("IF", "THEN" if node.then else "GOTO")
            case ast.Modifiers():
                yield from (word for word, given in (("AT", node.at), ("IN", node.within)) if given is not None)
                yield from ("ALWAYS",) if node.always else ()
                yield from (node.unit,) if node.unit else ()
            case _ if type(node) in _CONTROL:
                yield _CONTROL[type(node)]


def judge_dialect(check: checks.DialectCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge whether a submission uses only words of a dialect."""
    for program in run.evidence.programs:
        for found in beyond(replace(program, dialect=check.dialect)):
            return basis.Verdict(
                0.0, f"line {found.span.line}: {found.detail}{f' ({found.hint})' if found.hint else ''}"
            )
    return basis.Verdict(1.0, f"all words are of {check.dialect.title}")


# --- typed lines ---------------------------------------------------------------------------------------------------


def judge_typed(check: checks.TypedCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge which lines the program printed with TYPE, in which order and at which times."""
    started, step, place = run.evidence.started, run.s, 0
    typed = tuple(replace(line, t=line.t - started) for line in run.evidence.typed)
    used, lines = set[int](), _wanted_lines(check, run)
    for found, wanted in enumerate(lines):
        place, early = _next_match(typed, place, wanted, step)
        if place < 0:
            share = found / len(lines)
            return basis.Verdict(share, _missing_lines(wanted, found, len(lines), early, step), run.evidence.end)
        used.add(place - 1)
    more = [line for number, line in enumerate(typed) if number not in used] if check.only else []
    if more:
        when = f"at {basis.figure(more[0].t, step)} s"
        return basis.Verdict(
            basis.HALF, f"{quote(more[0].text)} was typed {when}, which is not wanted", started + more[0].t
        )
    return basis.Verdict(1.0, f"{count(len(lines), 'wanted line')} typed{' in order' if len(lines) > 1 else ''}")


def _wanted_lines(check: checks.TypedCheck, run: basis.JudgedRun) -> list[checks.TypedText]:
    """Return the required lines. Raises ValueError if the model solution gives them and its run is unknown."""
    if not check.needs_model:
        return [one for one in check.lines if isinstance(one, checks.TypedText)]
    if run.basis.model is None:
        raise ValueError("the model's run is not known")
    return [checks.TypedText(line.text) for line in run.basis.model.typed]


def _next_match(
    typed: tuple[TypedLine, ...], first: int, wanted: checks.TypedText, step: float
) -> tuple[int, TypedLine | None]:
    """Search `typed` from index `first` for a line that matches. Return the index after this line (-1: no match), and a
    line whose text matches but whose time is wrong, if there is one."""
    other: TypedLine | None = None
    for number in range(first, len(typed)):
        line = typed[number]
        if not _matches(line.text, wanted):
            continue
        if not basis.falls_short(line.t, wanted.after, step) and not basis.exceeds(line.t, wanted.before, step):
            return number + 1, None
        other = other or line
    return -1, other


def _matches(text: str, wanted: checks.TypedText) -> bool:
    """Return whether a line equals the required text (without outer blanks), or the whole line matches the pattern."""
    if wanted.pattern:
        return re.fullmatch(wanted.text, text.strip()) is not None
    return text.strip() == wanted.text.strip()


def _missing_lines(wanted: checks.TypedText, found: int, total: int, other: TypedLine | None, step: float) -> str:
    """Return the reason to show for a required line that was not typed."""
    if other is not None:
        bounds = [f"at {basis.figure(wanted.after, step)} s or later"] if wanted.after > 0.0 else []
        bounds += [f"by {basis.figure(wanted.before, step)} s"] if wanted.before < LATEST else []
        return f"{quote(other.text)} was typed at {basis.figure(other.t, step)} s, it is wanted {' and '.join(bounds)}"
    what = f"a line that fits {quote(wanted.text)}" if wanted.pattern else quote(wanted.text)
    after = f" after the {count(found, 'line')} before it" if found else ""
    return f"{what} was not typed{after} ({found} of {count(total, 'wanted line')})"


def quote(text: str) -> str:
    """Return a string in quotes, truncated if it is long."""
    cut = text.strip() if len(text.strip()) <= MAX_SHOWN_CHARS else f"{text.strip()[: MAX_SHOWN_CHARS - 3]}..."
    return f'"{cut}"'


def judge_tool_at(check: checks.ToolAtCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge where the tool is at the end."""
    model = run.basis.model
    wanted = run.basis.place(check.at, None if model is None else _final_tool(model))
    return _nearness("the tool", _final_tool(run.evidence), wanted, check, run)


def _final_tool(evidence: basis.Evidence) -> Transform:
    return position_at(evidence.arm, evidence.timeline, evidence.end).T_world_tool


def judge_part_at(check: checks.PartAtCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge where a part is at the end. For a falling part, the place where it comes to rest counts."""
    evidence, model = run.evidence, run.basis.model
    in_model = None if model is None else final_part(model, check.part)
    wanted = run.basis.place(check.at, None if in_model is None else in_model.pose)
    state = final_part(evidence, check.part)
    if state is None or not state.exists:
        return basis.Verdict(0.0, f"the {check.part} was not there at the end", evidence.end)
    verdict = _nearness(f"the {check.part}", state.pose, wanted, check, run)
    if state.held and verdict.share < 1.0:
        return basis.Verdict(verdict.share, f"{verdict.reason}; the hand still holds it", verdict.at)
    return verdict


def final_part(evidence: basis.Evidence, name: str) -> PartState | None:
    """Return the state of a part at the end of a run; None if the cell has no such part."""
    course = evidence.course
    if course is None or name not in course.parts():
        return None
    last = course.spans(name, evidence.end)[-1]
    return course.state(name, max(evidence.end, last.end) if last.end < inf else evidence.end)


def _nearness(
    what: str, found: Transform, place: Transform, check: checks.ToolAtCheck | checks.PartAtCheck, run: basis.JudgedRun
) -> basis.Verdict:
    """Compare the pose `found` with the required pose `place`. `what`: the name of the thing in the reason."""
    wanted = at_position(place, *vector_sum(position(place), check.offset))
    step, turn_step = run.mm, run.basis.rounding.deg
    far = 1000.0 * distance(found, wanted)
    share = basis.share_within(far, check.mm, step)
    text = f"{what} ended {basis.figure(far, step)} mm from the place, {basis.figure(check.mm, step)} mm allowed"
    if check.deg is not None:
        off = degrees(angle_between(found, wanted))
        text += f", turned by {basis.figure(off, turn_step)} deg, {basis.figure(check.deg, turn_step)} deg allowed"
        share = min(share, basis.share_within(off, check.deg, turn_step))
    return basis.Verdict(share, f"{text}; at {run.place_text(position(found))}", run.evidence.end)


def judge_held(check: checks.HeldCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge what the hand holds at the end."""
    course, end = run.evidence.course, run.evidence.end
    held = "" if course is None else course.held_part(end) or ""
    text = f"the hand holds the {held} at the end" if held else "the hand holds nothing at the end"
    if held == check.part:
        return basis.Verdict(1.0, text, end)
    return basis.Verdict(0.0, f"{text}, {f'the {check.part}' if check.part else 'nothing'} is wanted", end)


ENDED = (RunOutcome.ABORTED, RunOutcome.PAUSED, RunOutcome.HALTED)  # outcomes of programs that stopped before their end


def judge_no_error(_check: checks.NoErrorCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge whether the program ended without an error. A program that still runs has no error so far."""
    evidence = run.evidence
    if (wrong := stopped_early(evidence, run.s)) is not None:
        return basis.Verdict(0.0, wrong, evidence.clock)
    return basis.Verdict(1.0, "the program had no error")


def stopped_early(evidence: basis.Evidence, step: float) -> str | None:
    """Describe why a program stopped before its end; return None if it reached its end."""
    fault = evidence.fault
    if fault is not None:
        line = f"in line {fault.line}, {fault.source.strip()}" if fault.line else f"at step {fault.step}"
        return f"the program stopped {line}: {fault.message}"
    if evidence.outcome in ENDED:
        return f"the program did not come to its end: it stopped at {basis.figure(evidence.clock, step)} s"
    return None


def judge_cycle_time(check: checks.CycleTimeCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge how long a run took until the arm came to rest, or how long the fastest motion from one place to another
    took."""
    if check.begin is not None and check.end is not None:
        a, b = run.basis.point(check.begin), run.basis.point(check.end)
        if not (found := windows(run, a, b, PASSED_MM)):
            return did_not_go(run, a, b, PASSED_MM)
        begin, end = min(found, key=lambda one: one[1] - one[0])
        what = f"the way from {run.place_text(a)} to {run.place_text(b)}"
        return _time_verdict(what, end - begin, begin, check, run.s)
    evidence, step = run.evidence, run.s
    if (wrong := stopped_early(evidence, step)) is not None:
        return basis.Verdict(0.0, wrong, evidence.clock)
    last = max(evidence.clock, evidence.timeline.end)
    return _time_verdict("the run", last - evidence.started, evidence.started, check, step)


def _time_verdict(
    what: str, seconds: float, started: float, check: checks.CycleTimeCheck, step: float
) -> basis.Verdict:
    took = f"{what} took {basis.figure(seconds, step)} s"
    if basis.falls_short(seconds, check.least, step):
        return basis.Verdict(0.0, f"{took}, at least {basis.figure(check.least, step)} s is wanted")
    share = basis.share_within(seconds, check.most, step, basis.MORE)
    text = f"{took}, {basis.figure(check.most, step)} s allowed"
    return basis.Verdict(share, text, None if share == 1.0 else started + check.most)


@lru_cache(32)
def _checker(arm: RobotArm, scene: CellScene, clearance: float, allow: tuple[checks.Pair, ...]) -> Checker:
    from vrs_cli.contacts.checker import Checker

    return Checker(arm, scene, clearance, allow)


def first_contact(run: basis.JudgedRun, clearance: float, allow: tuple[checks.Pair, ...]) -> Contact | None:
    """Return the first contact in the whole run. `clearance` [m]: bodies that come closer than this count as
    touching."""
    from vrs_cli.contacts.sweep import stages

    it = run.evidence
    if it.end <= it.started:
        return None
    checker = _checker(it.arm, it.cell.scene, clearance, allow)
    return checker.first_in(it.timeline, stages(it.timeline, it.course, it.started, it.end))


def judge_contact(check: checks.ContactCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge whether bodies touched that must not touch.

    Each motion was checked when it was commanded. If no contact was reported and no motion was inserted before another,
    there was no contact. Otherwise the final run is checked again.
    """
    it = run.evidence
    found = None
    if it.contacts or any(record.asked is not None for record in it.commands):
        found = first_contact(run, 0.0, check.allow)
    if found is None:
        return basis.Verdict(1.0, "nothing touched that should not")
    return basis.Verdict(0.0, _contact_text(found, run), found.t)


def judge_clearance(check: checks.ClearanceCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge the smallest distance between the arm and other things."""
    wanted = basis.figure(check.mm, run.mm)
    found = first_contact(run, 1e-3 * max(basis.smallest(check.mm, run.mm), 0.0), check.allow)
    if found is None:
        return basis.Verdict(1.0, f"{wanted} mm were kept from everything")
    half = first_contact(run, 1e-3 * basis.HALF * check.mm, check.allow) if not found.depth else found
    reason = f"{_contact_text(found, run)}; {wanted} mm are to be kept"
    return basis.Verdict(0.0 if half is not None else basis.HALF, reason, found.t)


def _contact_text(contact: Contact, run: basis.JudgedRun) -> str:
    """Describe a contact. Two touching faces have many contact points, so the text gives the position of the tip
    instead."""
    it = run.evidence
    tip = position(position_at(it.arm, it.timeline, contact.t).T_world_tool)
    when = f"at {basis.figure(contact.t, run.s)} s with the tool at {run.place_text(tip)}"
    names = f"{_article(contact.first)} touched {_article(contact.second)}"
    if contact.depth > 0.0:
        return f"{names} {when}, {basis.figure(1000.0 * contact.depth, run.mm)} mm deep"
    return f"{_article(contact.first)} came too near to {_article(contact.second)} {when}"


def _article(name: str) -> str:
    return name if name.startswith("link ") else f"the {name}"

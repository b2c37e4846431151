"""Mark a run from its recorded evidence (one mark per check), and grade submissions.

A submission runs in all variants of an exercise; its grading collects the marks and points of these runs.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from vrs_cli.errors import EndOfInput, FileDamaged, LimitReached, ProgramNotExecutable, VrsError
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.dialogue import Notes, at_once
from vrs_cli.interfaces.station.loaded_file import LoadedFile
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.limits import Isolation
from vrs_cli.language.words.values import key_of
from vrs_cli.teach import checks
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.judging.basis import Basis, Evidence, JudgedRun, Verdict, evidence_of, round_to
from vrs_cli.teach.kinds import KINDS
from vrs_cli.values.diagnostics import Severity, in_order
from vrs_cli.values.numbers import count
from vrs_cli.values.questions import LineWanted, Question

if TYPE_CHECKING:
    from vrs_cli.contacts.checker import Checker

MAX_LINES = 2000  # maximum number of lines of a program file; reading that many takes 0.2 s


class Submission(Struct, frozen=True):
    """A submission of a student. `file`: the name of the file. `text`: the program. `unread`: the reason why the file
    was not read, or "" if it was."""

    student: str
    file: str
    text: str
    unread: str = ""


class NotExecuted(VrsError, text="Not executed"):
    """The error raised if a submission contains no program that can run."""


class SubmissionRuns:
    """The runs of one submission in the variants of an exercise. `checkers`: contact checkers by seed, shared with
    other submissions; the first run with a seed adds its checker."""

    def __init__(self, submission: Submission, checkers: dict[int | None, Checker | None] | None = None) -> None:
        self._checkers = {} if checkers is None else checkers
        self._text, self._lines = submission.text, submission.text.count("\n")
        self._loaded: LoadedFile | None = None

    def run(self, exercise: Exercise) -> Evidence:
        """Run the submission in a variant within the limits of the exercise.

        The submission can use only the files of the current folder. If the program stops with an error, the evidence
        holds the error. Raises NotExecuted.
        """
        if self._lines > MAX_LINES:
            raise NotExecuted(f"the file has {self._lines} lines, and {MAX_LINES} are allowed")
        station = _station(exercise)
        station.contacts.prepare(self._checkers.get(exercise.seed))
        with Isolation():
            exercise.give(station)
            if self._loaded is None:
                self._loaded = at_once(station.read_file(self._text))
            station.take(self._loaded)
            exercise.give(station)
            name = self._program(exercise, station, self._loaded)
            try:
                result = station.execute(name, all_tasks=True)
            except ProgramNotExecutable as error:
                raise NotExecuted(self.mistake or f"{error.title} {error.detail}") from None
            self._checkers.setdefault(exercise.seed, station.contacts.checker)
            return evidence_of(station, result, given=exercise.given_programs)

    @property
    def mistake(self) -> str:
        """Return the first mistake in the loaded file with its line, and the number of further mistakes; "" if there is
        none."""
        found = () if self._loaded is None else self._loaded.diagnostics
        wrong = in_order(one for one in found if one.severity is Severity.ERROR)
        if not wrong:
            return ""
        more = f" (and {count(len(wrong) - 1, 'more mistake')})" if len(wrong) > 1 else ""
        return f"line {wrong[0].span.line}: {wrong[0].message}{more}"

    def _program(self, exercise: Exercise, station: Station, loaded: LoadedFile) -> str:
        """Return the name of the program to run. Raises NotExecuted."""
        names = [one.program.name for one in loaded.programs]
        if exercise.program is None:
            if not names:
                raise NotExecuted(self.mistake or "the file holds no program: a program begins with .PROGRAM")
            return names[0]
        if key_of(exercise.program) in station.programs:
            return exercise.program
        holds = f"; it holds {', '.join(names)[:200]}" if names else ""
        raise NotExecuted(self.mistake or f"the file holds no program {exercise.program}{holds}")


def _station(exercise: Exercise) -> Station:
    """Return a station with the cell and the inputs of a variant, and with a terminal that no user is connected to."""
    terminal = Notes()
    terminal.begin(_nobody)
    station = Station(
        terminal,
        exercise.robot,
        limits=exercise.limits,
        folder=Folder(closed=True),
        advice=lambda _option: "the exercise allows no more",
    )
    station.dialect = exercise.dialect
    station.driver.surround(exercise.cell)
    station.driver.add_inputs(exercise.inputs)
    return station


def _nobody(question: Question) -> None:
    """Handle questions to the user, because no user is present during grading: raise EndOfInput for PROMPT, and give no
    answer to other questions."""
    if isinstance(question, LineWanted):
        raise EndOfInput("PROMPT has nothing to read", "nobody types while a program is graded")


MAX_REASON_CHARS = 1000


class VariantMarks(Struct, frozen=True):
    """The marks of a run in one variant. `seed`: None for the unchanged exercise. `stopped`: the error that ended the
    program, or why it did not run. `limited`: whether a limit of the exercise ended it."""

    seed: int | None
    marks: tuple[Mark, ...]
    stopped: str = ""
    limited: bool = False


class Grading(Struct, frozen=True):
    """The result of a submission. `lost`: why it was not graded; "" if it was graded. `sha256`: the digest of the
    program's text. A program that reaches a limit in one variant does not run in the later variants."""

    student: str
    file: str
    sha256: str
    lost: str = ""
    variants: tuple[VariantMarks, ...] = ()

    @property
    def marks(self) -> tuple[tuple[int | None, Mark], ...]:
        """Return the lowest mark of each check over all variants, with the seed of the first variant that has this
        mark."""
        rows = zip(*([(one.seed, found) for found in one.marks] for one in self.variants), strict=True)
        return tuple(min(row, key=lambda pair: pair[1].points) for row in rows)

    @property
    def points(self) -> float:
        return round_to(sum(found.points for _, found in self.marks), POINT_STEP)

    @property
    def stopped(self) -> str:
        """Return the first error that ended the program in a variant, or why it did not run."""
        return next((one.stopped for one in self.variants if one.stopped), "")


class Grader:
    """A grader of submissions of one exercise. It holds the variants, and the evidence of the model solution in each
    variant."""

    def __init__(self, exercise: Exercise) -> None:
        """Run the model solution in all variants. Raises FileDamaged if it cannot run."""
        self.exercise = exercise
        self._variants = tuple(exercise.variant(seed) for seed in exercise.seeds)
        self.models = dict[int | None, Evidence]()
        self._checkers = dict[int | None, "Checker | None"]()
        runs = SubmissionRuns(Submission("", "model.v2", exercise.solution), self._checkers)
        for variant in self._variants:
            try:
                model = self.models[variant.seed] = runs.run(variant)
            except NotExecuted as error:
                path = Path(exercise.folder, "teacher", "model.v2")
                raise FileDamaged(f"{path} is not executed: {error.detail}", "vrs check tells its mistakes") from None
            mark(variant, model, model)  # fill caches (of physics models) before processes fork, so that all share them

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle only the folder, so that another process reads the exercise again."""
        return _grader_of, (self.exercise.folder,)

    def runs(self, submission: Submission) -> tuple[Grading, tuple[Evidence | None, ...]]:
        """Run a submission in all variants, each in an empty subfolder of the current folder, and mark the runs.

        Also return the evidence of each run, or None for a run that did not start.
        """
        grading = lost_grading(submission, submission.unread)
        marks, evidences = list[VariantMarks](), list[Evidence | None]()
        if not submission.unread:
            runs = SubmissionRuns(submission, self._checkers)
            for number, variant in enumerate(self._variants):
                os.mkdir(folder := f"variant{number}")
                with chdir(folder):
                    found, evidence = self._mark_variant(variant, runs)
                marks.append(found)
                evidences.append(evidence)
                if found.limited:
                    break
        return structs.replace(grading, variants=tuple(marks)), tuple(evidences)

    def _mark_variant(self, variant: Exercise, runs: SubmissionRuns) -> tuple[VariantMarks, Evidence | None]:
        """Run a submission in one variant, and mark the run."""
        try:
            evidence = runs.run(variant)
        except NotExecuted as error:
            why = error.detail[:MAX_REASON_CHARS]
            nothing = (
                Mark(one.name, 0.0, one.points, "not executed", None, one.hint, one.hidden) for one in variant.checks
            )
            return VariantMarks(variant.seed, tuple(nothing), f"not executed: {why}"), None
        marks = tuple(
            structs.replace(one, reason=one.reason[:MAX_REASON_CHARS])
            for one in mark(variant, evidence, self.models.get(variant.seed) if variant.needs_model else None)
        )
        fault = evidence.fault
        if fault is None:
            return VariantMarks(variant.seed, marks), evidence
        why = f"{fault.message}: {runs.mistake}" if fault.code == ProgramNotExecutable.code else fault.message
        stopped = f"{f'line {fault.line}: ' if fault.line else ''}{why}"[:MAX_REASON_CHARS]
        return VariantMarks(variant.seed, marks, stopped, fault.code == LimitReached.code), evidence


def _grader_of(folder: str) -> Grader:
    return Grader(read_exercise(folder))


def lost_grading(submission: Submission, why: str) -> Grading:
    """Return the grading of a submission that was not graded, with the reason."""
    digest = hashlib.sha256(submission.text.encode(errors="surrogatepass")).hexdigest()
    return Grading(submission.student, submission.file, digest, why)


def total_of(exercise: Exercise) -> float:
    return round_to(sum(one.points for one in exercise.checks), POINT_STEP)


def by_student(gradings: Sequence[Grading]) -> tuple[Grading, ...]:
    """Return gradings sorted by the names of their students."""
    return tuple(sorted(gradings, key=lambda one: (one.student.casefold(), one.student)))


POINT_STEP = 0.01


class Mark(Struct, frozen=True):
    """The mark of one check. `points`: the points earned; `of`: the maximum; `reason`: why the check earned these
    points. `at`: the time in the run at which the reason can be seen [s]; None if there is no single time. `hint`:
    empty if all points were earned."""

    name: str
    points: float
    of: float
    reason: str
    at: float | None = None
    hint: str = ""
    hidden: bool = False

    @property
    def passed(self) -> bool:
        """Return whether all points were earned."""
        return self.points == self.of


JUDGES = {kind.check: kind.judge for kind in KINDS.values()}


def mark(exercise: Exercise, evidence: Evidence, model: Evidence | None = None) -> tuple[Mark, ...]:
    """Return the marks of a run in the order of the checks of an exercise or a variant. `model`: the evidence of the
    model solution in the same variant, if `exercise.needs_model`."""
    return mark_checks(exercise.checks, evidence, Basis(exercise.rounding, exercise.locations, model))


def mark_checks(wanted: Sequence[checks.AnyCheck], evidence: Evidence, basis: Basis) -> tuple[Mark, ...]:
    """Return the marks of some checks. While the run goes on, a condition that is not yet met counts as failed."""
    run = JudgedRun(evidence, basis)
    verdicts = {check.name.lower(): _verdict(check, run) for check in wanted}
    marks = []
    for check in wanted:
        verdict = verdicts[check.name.lower()]
        missing = [name for name in check.needs if name.lower() in verdicts and verdicts[name.lower()].share <= 0.0]
        if missing and verdict.share > 0.0:
            verdict = Verdict(0.0, f"it does not count while {missing[0]!r} earns nothing ({verdict.reason})")
        share = verdict.share if check.partial or verdict.share >= 1.0 else 0.0
        points = check.points if share >= 1.0 else min(round_to(check.points * share, POINT_STEP), check.points)
        at = None if verdict.at is None else round_to(verdict.at, basis.rounding.s)
        hint = check.hint if share < 1.0 else ""
        marks.append(Mark(check.name, points, check.points, verdict.reason, at, hint, check.hidden))
    return tuple(marks)


def _verdict(check: checks.AnyCheck, run: JudgedRun) -> Verdict:
    try:
        return JUDGES[type(check)](check, run)
    except (ValueError, VrsError) as error:
        return Verdict(0.0, f"it cannot be checked: {error}")

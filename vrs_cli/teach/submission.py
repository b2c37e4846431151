"""A submission, and its run in an exercise."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.errors import EndOfInput, ProgramNotExecutable, VrsError
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.dialogue import Notes, at_once
from vrs_cli.interfaces.station.loaded_file import LoadedFile
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.isolation import Isolation
from vrs_cli.language.words.values import key_of
from vrs_cli.teach.evidence import Evidence, evidence_of
from vrs_cli.teach.exercise import Exercise
from vrs_cli.values.diagnostics import Severity, ordered
from vrs_cli.values.numbers import count
from vrs_cli.values.questions import LineWanted, Question

if TYPE_CHECKING:
    from vrs_cli.contacts.checker import Checker

MAX_LINES = 2000  # of a program file: to read so many takes a fifth of a second


class Submission(Struct, frozen=True):
    """What a student handed in. `file`: the name of the file; `text`: the program. `unread`: why there is none."""

    student: str
    file: str
    text: str
    unread: str = ""


class NotExecuted(VrsError, text="Not executed"):
    """A submission holds no program that can be executed."""


class SubmissionRuns:
    """The runs of one submission, one for each variant of an exercise: what is the same in all is done once.
    `checkers`: of contacts, by the seeds of the variants; the first runs put them there.
    """

    def __init__(self, submission: Submission, checkers: dict[int | None, Checker | None] | None = None) -> None:
        self._checkers = {} if checkers is None else checkers
        self._text, self._lines = submission.text, submission.text.count("\n")
        self._loaded: LoadedFile | None = None

    def run(self, exercise: Exercise) -> Evidence:
        """Run it in a variant, within the limits of the exercise, with its files in the current folder alone. An error
        of the program is in the evidence. Raises NotExecuted.
        """
        if self._lines > MAX_LINES:
            raise NotExecuted(f"the file has {self._lines} lines, and {MAX_LINES} are allowed")
        station = _station(exercise)
        station.contacts.prepare(self._checkers.get(exercise.seed))
        with Isolation():
            exercise.give(station)
            if self._loaded is None:
                self._loaded = at_once(station.loaded(self._text))
            station.take(self._loaded)
            exercise.give(station)
            name = self._program(exercise, station, self._loaded)
            try:
                result = station.execute(name, all_tasks=True)
            except ProgramNotExecutable as error:
                raise NotExecuted(self._mistake(self._loaded) or f"{error.title} {error.detail}") from None
            self._checkers.setdefault(exercise.seed, station.contacts.checker)
            return evidence_of(station, result, given=exercise.given_programs)

    @property
    def mistake(self) -> str:
        """Return the first mistake in the file that was loaded, with its line; "" where there is none."""
        return "" if self._loaded is None else self._mistake(self._loaded)

    def _program(self, exercise: Exercise, station: Station, loaded: LoadedFile) -> str:
        """The program that is executed. Raises NotExecuted."""
        names = [one.program.name for one in loaded.programs]
        if exercise.program is None:
            if not names:
                raise NotExecuted(self._mistake(loaded) or "the file holds no program: a program begins with .PROGRAM")
            return names[0]
        if key_of(exercise.program) in station.programs:
            return exercise.program
        holds = f"; it holds {', '.join(names)[:200]}" if names else ""
        raise NotExecuted(self._mistake(loaded) or f"the file holds no program {exercise.program}{holds}")

    def _mistake(self, loaded: LoadedFile) -> str:
        """The first mistake in the file with its line, and how many more there are; "" where there is none."""
        wrong = ordered(one for one in loaded.diagnostics if one.severity is Severity.ERROR)
        if not wrong:
            return ""
        more = f" (and {count(len(wrong) - 1, 'more mistake')})" if len(wrong) > 1 else ""
        return f"line {wrong[0].span.line}: {wrong[0].message}{more}"


def _station(exercise: Exercise) -> Station:
    """A robot in the surroundings of a variant, at whose terminal nobody is."""
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
    station.driver.inputs = exercise.inputs
    return station


def _nobody(question: Question) -> None:
    """Raises EndOfInput for PROMPT; other questions get no answer."""
    if isinstance(question, LineWanted):
        raise EndOfInput("PROMPT has nothing to read", "nobody types while a program is graded")

"""Runs of submissions for tests of exercises."""

from __future__ import annotations

from pathlib import Path

from vrs_cli.errors import EndOfInput
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.station.station import Station
from vrs_cli.teach.evidence import Evidence, evidence_of
from vrs_cli.teach.exercise import Exercise
from vrs_cli.values.questions import Answer, Question
from vrs_cli.values.replies import Reply

PICK = Path(__file__).parent / "pick"


class SilentTerminal:
    """Shows nothing, and has no answers."""

    attended = False

    def progress(self, doing: Running | Reading) -> None: ...

    def type(self, text: str, newline: bool) -> None: ...

    def show(self, reply: Reply) -> None: ...

    def ask(self, question: Question) -> Answer:  # noqa: ARG002
        raise EndOfInput("nobody answers")


def evidence(exercise: Exercise, text: str) -> Evidence:
    """Run a submission for an exercise, or for a variant of it."""
    station = Station(SilentTerminal(), exercise.robot, limits=exercise.limits)
    station.dialect = exercise.dialect
    station.driver.surround(exercise.cell)
    station.driver.inputs = exercise.inputs
    exercise.give(station)
    station.load_text(text)
    exercise.give(station)
    name = exercise.program or next(
        one.name for key, one in station.programs.items() if key not in exercise.given_programs
    )
    result = station.execute(name, all_tasks=True)
    return evidence_of(station, result, given=exercise.given_programs)

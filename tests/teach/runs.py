"""Runs of submissions, and marks of single checks, for tests of exercises."""

from __future__ import annotations

from pathlib import Path

from vrs_cli.errors import EndOfInput
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.run.signals import NO_CELL, NO_INPUTS, Cell, Inputs
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.exercise_text import ExerciseText
from vrs_cli.teach.grading import Mark, mark_checks
from vrs_cli.teach.judging.basis import Basis, Evidence, Rounding, evidence_of
from vrs_cli.teach.kinds import read_checks
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


def run(steps: str, cell: Cell = NO_CELL, inputs: Inputs = NO_INPUTS) -> Evidence:
    """Run a program of these steps, one a line."""
    station = Station(SilentTerminal(), load_robot("puma560"))
    station.driver.surround(cell)
    station.driver.inputs = inputs
    station.load_text(f".PROGRAM test\n{steps}\n.END\n")
    return evidence_of(station, station.execute("test", all_tasks=True))


def mark_of(check: str, ran: Evidence, model: Evidence | None = None, parts: tuple[str, ...] = ()) -> Mark:
    """Mark a run by the first check of a text, as checks.toml has it below [[check]]."""
    text = f"[[check]]\n{check}"
    links = tuple(f"link {i}" for i in range(1, 7))
    reader = ExerciseText("checks.toml", text)
    reader.parts, reader.bodies = parts, (*parts, "floor", "base", *links, "hand")
    checks = read_checks(reader)
    assert reader.wrong == []
    return mark_checks(checks, ran, Basis(Rounding(), {}, model))[0]

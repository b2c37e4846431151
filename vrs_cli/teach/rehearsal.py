"""A rehearsal of a lesson: each step is tried with nothing done, with its wrong lines, and with its model lines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from random import Random

from msgspec import Struct, structs

from vrs_cli.interfaces.dialogue import Notes
from vrs_cli.net.delay_line import Delays
from vrs_cli.teach.classroom import Classroom
from vrs_cli.teach.evidence import evidence_of
from vrs_cli.teach.learn import marks_of
from vrs_cli.teach.lessons import Lesson, LessonStep
from vrs_cli.teach.marking import Mark

HURRY = 4.0  # times as fast as in a lesson: a robot behind a delay, and its delays


class Hurried(Struct, frozen=True):
    """Delays of a line on which all is HURRY times as fast."""

    delays: Delays

    def source(self, random: Random) -> Callable[[float], float]:
        """Return a function from the time something is sent [s] to its delay [s]."""
        slow = self.delays.source(random)
        return lambda t: slow(t * HURRY) / HURRY


def faults(lesson: Lesson) -> Iterator[str]:
    """Yield what is wrong with the steps of a lesson: file, line, what would be right."""
    if lesson.delays is not None:
        forward, backward = lesson.delays
        lesson = structs.replace(lesson, delays=(Hurried(forward), Hurried(backward)))
    before = list[str]()
    for number, step in enumerate(lesson.steps):
        for what, hint in _faults_of_step(lesson, step, before):
            yield f"{lesson.checks_file}:{step.line}: step {number + 1}, {step.name}: {what} ({hint})"
        before += step.model


def _faults_of_step(lesson: Lesson, step: LessonStep, before: list[str]) -> Iterator[tuple[str, str]]:
    start, *after = _tried(lesson, step, before, [(), step.model, *step.wrong])
    if not _failed(start):
        hint = "let a check ask for something that is not so yet"
        yield "it is passed before anything is done: all its checks hold when it begins", hint
        return
    if failed := _failed(after[0]):
        said = "; ".join(f"{one.name}: {one.reason}" for one in failed)
        yield f"its model lines do not pass it: {said}", "mend model, or the check"
    for lines, marks in zip(step.wrong, after[1:], strict=True):
        if not _failed(marks):
            yield (
                f"wrong lines pass it: {list(lines)}",
                "let a check tell them from the model, or take them out of wrong",
            )


def _failed(marks: Iterable[Mark]) -> list[Mark]:
    return [one for one in marks if not one.passed]


def _tried(
    lesson: Lesson, step: LessonStep, before: list[str], tries: Iterable[tuple[str, ...]]
) -> Iterator[tuple[Mark, ...]]:
    """Yield the marks of a step after the lines of each try; before it stand the model lines of all earlier steps."""
    for lines in tries:
        with ExitStack() as stack:
            rate = HURRY if lesson.delays is not None else 1.0
            room = Classroom(lesson, stack, lambda _text: None, rate=rate)
            front_end = room.front_end(Notes())
            stack.callback(front_end.closing)
            front_end.opening()
            for line in before:
                front_end.take(line)
            started = room.look(lambda session: session.engine.now)
            for line in lines:
                front_end.take(line)
            yield marks_of(lesson, step, room.look(evidence_of), started)

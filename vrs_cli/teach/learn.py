"""Guide a learner at the prompt: check the current step after each line, and execute HINT and the other words of
lessons.

The robot may run in this process, on a server, or on a server with a delayed connection; `AskRobot` hides the
difference.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from itertools import dropwhile, islice
from pathlib import Path
from typing import Any, Protocol, TypeVar

from msgspec import Struct, structs

from vrs_cli.errors import FileDamaged, FileError, VrsError
from vrs_cli.files.atomic import write_atomically
from vrs_cli.files.opening import text_at
from vrs_cli.interfaces.dialogue import Notes, Terminal, internal_error
from vrs_cli.interfaces.session.session import Session
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.teach.checks import VariableCheck
from vrs_cli.teach.grading import Mark, mark_checks
from vrs_cli.teach.judging.basis import Basis, Evidence, evidence_of
from vrs_cli.teach.lessons import Lesson, LessonStep, chosen_folder, progress_key
from vrs_cli.values.questions import PromptStatus
from vrs_cli.values.replies import Farewell

T = TypeVar("T")
WORDS = (
    "HINT gives a hint, AGAIN shows the step again, SKIP does it for you, BACK goes back one step, LESSONS lists all "
    "lessons. EXIT leaves; `vrs learn` continues from there."
)


class AskRobot(Protocol):
    """A function that calls `ask` with the session of a lesson's robot, between two actions of the robot."""

    def __call__(self, ask: Callable[[Session], T]) -> T: ...


class LessonPrompt(Protocol):
    """The prompt at which a learner types: the prompt of a shell, or of a robot that is served to browsers."""

    terminal: Terminal

    def take(self, text: str) -> None:
        """Send a line to the robot, and return when the robot has executed it."""

    def status(self) -> PromptStatus:
        """Return the state shown around the input line."""


# --- progress of learners ---------------------------------------------------------------------------------------------


class LessonStanding(Struct, frozen=True):
    """The progress of a learner in a lesson: `passed` steps of `of`."""

    passed: int = 0
    of: int = 0

    @property
    def is_finished(self) -> bool:
        return bool(self.of) and self.passed >= self.of

    def summary(self) -> str:
        """Return the progress in a few words; "" if no step is passed."""
        return "done" if self.is_finished else f"{self.passed} of {self.of}" if self.passed else ""


class LearnerRecord:
    """The progress of a user, kept in a JSON file: {"latest": NAME, "lessons": {NAME: {"passed": 2, "of": 6}}}.

    Several shells may write the file; each changes only its own lesson. Without a path nothing is saved. Raises
    FileDamaged for a file with other contents, and FileError.
    """

    def __init__(self, path: Path | None) -> None:
        self._path, self._kept = path, dict[str, LessonStanding]()
        self.latest = ""
        self._read()

    def _read(self) -> None:
        if self._path is None or not self._path.exists():
            return
        try:
            found = json.loads(text_at(str(self._path), 1_000_000))
        except (ValueError, RecursionError):
            found = None
        lessons = found.get("lessons") if isinstance(found, dict) else None
        if not isinstance(lessons, dict) or not all(map(_is_standing, lessons.values())):
            raise FileDamaged(f"{self._path} is no record of lessons", "vrs learn --reset begins a new one")
        self._kept = {name: LessonStanding(one["passed"], one["of"]) for name, one in lessons.items()}
        latest = found.get("latest")
        self.latest = latest if isinstance(latest, str) else ""

    def of(self, lesson: str) -> LessonStanding:
        """Return the progress of the learner in a lesson."""
        return self._kept.get(lesson, LessonStanding())

    def keep(self, lesson: str, standing: LessonStanding) -> None:
        """Save the progress of the learner. Raises FileError."""
        if self._path is None:
            return
        try:
            self._read()
        except FileDamaged:
            return  # another program has replaced the file: do not overwrite it
        self.latest, self._kept[lesson] = lesson, standing
        lessons = {name: {"passed": one.passed, "of": one.of} for name, one in self._kept.items()}
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_atomically(self._path, json.dumps({"latest": lesson, "lessons": lessons}, indent=1) + "\n")
        except OSError as error:
            raise FileError(f"{self._path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _is_standing(found: Any) -> bool:
    return isinstance(found, dict) and all(
        type(found.get(key)) is int and 0 <= found[key] <= 10_000 for key in ("passed", "of")
    )


# --- the learner ------------------------------------------------------------------------------------------------------


class Learner:
    """The code that leads a user through a lesson. `show` displays Markdown. `course`: the folders and titles of all
    lessons. `wanted`: the folder of the lesson that the user chose to start next, for which the shell ends."""

    def __init__(
        self,
        lesson: Lesson,
        look: AskRobot,
        show: Callable[[str], None],
        progress: LearnerRecord,
        course: Mapping[Path, str],
        at: int = 0,
    ) -> None:
        self.lesson = lesson
        self.wanted: Path | None = None
        self._look, self._show, self._progress, self._course = look, show, progress, course
        self._at, self._hints = min(at, len(lesson.steps)), 0
        self._started, self._shown_missing = 0.0, ""
        self._seen: object = None  # version of the timeline, and whether a program runs, at the last check
        self._busy = False  # whether the lesson itself is sending lines
        self._front_end: LessonPrompt
        self._words: Mapping[str, Callable[[], None]] = {
            "HINT": self._hint,
            "AGAIN": self._task,
            "SKIP": self._skip,
            "BACK": self._back,
            "LESSONS": self._list,
        }

    @property
    def standing(self) -> LessonStanding:
        return LessonStanding(self._at, len(self.lesson.steps))

    def attach(self, front_end: FrontEnd) -> None:
        """Connect the lesson to a shell: check the step after each finished line, and execute the words of the
        lesson."""
        self._front_end, opening = front_end, front_end.opening

        def begin() -> None:
            opening()
            self._begin()

        front_end.own_lines.insert(0, self.take)
        front_end.opening, front_end.taken, front_end.kept_up = begin, self.look, self._look_again

    def join(self, prompt: LessonPrompt) -> None:
        """Start the lesson at a prompt. The code that runs the prompt must call `look` after each line has finished."""
        self._front_end = prompt
        self._begin()

    # --- words of the lesson ------------------------------------------------------------------------------------------

    def take(self, text: str) -> bool:
        """Execute a line and return True if the line is a word of the lesson; otherwise return False."""
        words = text.partition(";")[0].split()
        match [words[0].upper() if words else "", *words[1:]]:
            case ["LESSON", *rest]:
                self._go(" ".join(rest))
            case [word] if word in self._words:
                self._words[word]()
            case _:
                return False
        return True

    def _hint(self) -> None:
        """Show the next hint: first the nudge, then the idea, then the model lines."""
        step = self._step
        if step is None:
            self._show("Nothing is left to do here.")
            return
        lines = f"{'This line passes' if len(step.model) == 1 else 'These lines pass'} the step:\n\n{_code(step.model)}"
        hint = (step.nudge, step.idea, lines)[min(self._hints, 2)]
        self._show(f"{hint}\n\nSo far: {_missing(self._marks(step))}.")
        self._hints += 1

    def _skip(self) -> None:
        """Execute the model lines of the step, and continue with the next step."""
        step = self._step
        if step is None:
            self._show("Nothing is left to skip.")
            return
        if self._typing:
            return
        self._show(f"Done for you:\n\n{_code(step.model)}")
        self._carry_out(step.model)
        self._advance(skipped=not all(one.passed for one in self._marks(step)))

    def _back(self) -> None:
        if self._typing:
            return
        self._at = max(self._at - 1, 0)
        self._present()

    def _list(self) -> None:
        rows = list[str]()
        for number, (folder, title) in enumerate(self._course.items(), 1):
            here = progress_key(folder) == self.lesson.key
            standing = self.standing if here else self._progress.of(progress_key(folder))
            row = f"    {number:2}  {title:40} {standing.summary()}{' (you are here)' if here else ''}"
            rows.append(row.rstrip())
        self._show("\n".join(rows) + "\n\nLESSON and a number goes there.")

    def _go(self, word: str) -> None:
        """Exit this shell and start the lesson selected by `word`; "" selects the next lesson."""
        if self._typing:
            return
        try:
            self.wanted = chosen_folder(word, tuple(self._course)) if word else self._next_lesson
        except VrsError as error:
            self._show(f"{error}.")
            return
        if self.wanted is None:
            self._show("This is the last lesson. LESSONS lists all; LESSON and a number goes there.")
        else:
            self._front_end.terminal.show(Farewell())

    @property
    def _typing(self) -> bool:
        """Return whether the user is typing a program; if so, say that the program must be ended first."""
        if self._front_end.status().in_program:
            self._show("A program is being typed: end it first, with .END (or E in EDIT).")
            return True
        return False

    # --- steps --------------------------------------------------------------------------------------------------------

    @property
    def _step(self) -> LessonStep | None:
        """Return the current step; None if all are passed."""
        return self.lesson.steps[self._at] if self._at < len(self.lesson.steps) else None

    def _begin(self) -> None:
        """Show the introduction, and bring the robot to the state after the steps that the learner has passed."""
        lesson = self.lesson
        number = f"Lesson {lesson.number}: " if lesson.number else ""
        self._show(f"# {number}{lesson.title}\n\n{lesson.intro}\n\n{WORDS}")
        if self._at:
            # Notes collects the replies of these lines instead of showing them
            terminal, self._front_end.terminal = self._front_end.terminal, Notes()
            try:
                self._carry_out([line for step in lesson.steps[: self._at] for line in step.model])
            finally:
                self._front_end.terminal = terminal
            self._show(f"You go on at step {self._at + 1}. What the steps before it ask for is done.")
        self._keep()
        self._present()

    def _present(self) -> None:
        """Show the task of the current step, and start the step."""
        self._hints, self._started = 0, self._look(lambda session: session.engine.now)
        self._task()
        self._shown_missing = "" if self._step is None else _missing(self._marks(self._step))

    def _task(self) -> None:
        step, of, folder = self._step, len(self.lesson.steps), self._next_lesson
        if step is not None:
            self._show(f"## Step {self._at + 1} of {of}: {step.name}\n\n{step.task}")
        elif folder is not None:
            self._show(f"That was the lesson. LESSON goes on with the next one, {self._course[folder]}; EXIT leaves.")
        else:
            self._show("That was the lesson. LESSONS lists all lessons, EXIT leaves.")

    @property
    def _next_lesson(self) -> Path | None:
        """Return the folder of the lesson after this one; None for the last lesson."""
        rest = dropwhile(lambda folder: progress_key(folder) != self.lesson.key, self._course)
        return next(islice(rest, 1, None), None)

    def look(self) -> None:
        """Check the current step after a line. While the checked step passes, continue with the next step."""
        try:
            while not (self._busy or self._front_end.status().in_program) and (step := self._step):
                marks = self._marks(step)
                if not all(one.passed for one in marks):
                    self._tell(step, marks)
                    break
                self._advance()
        except Exception as error:
            self._front_end.terminal.show(internal_error(error))

    def _look_again(self) -> None:
        """Check the step again if something other than a line of this prompt, such as a program or the page, changed
        the robot."""
        seen = self._look(lambda session: (session.engine.timeline.version, session.running))
        if seen != self._seen:
            self._seen = seen
            self.look()

    def _marks(self, step: LessonStep) -> tuple[Mark, ...]:
        """Return the current marks of a step."""
        evidence = self._look(evidence_of)
        # an UNDO may have set the clock back to before the start of the step
        self._started = min(self._started, evidence.clock)
        return marks_of(self.lesson, step, evidence, self._started)

    def _tell(self, step: LessonStep, marks: tuple[Mark, ...]) -> None:
        """Show why checks of the step fail, if other checks pass or if the learner gave a wrong answer. Do
        not repeat the last message."""
        values = {one.name: one.of.items[0] for one in step.checks if isinstance(one, VariableCheck)}
        given = self._look(lambda session: session.environment.values())
        answered = any(values.get(one.name) in given for one in marks if not one.passed)
        missing, before = _missing(marks), self._shown_missing
        if missing != before and (answered or any(one.passed for one in marks)):
            self._shown_missing = missing
            self._show(f"Not yet: {missing}.")

    def _advance(self, *, skipped: bool = False) -> None:
        if not skipped:
            self._show(f"**Done.** {self.lesson.steps[self._at].passed}")
        self._at += 1
        self._keep()
        self._present()

    def _keep(self) -> None:
        """Save the progress; a finished lesson stays finished. If saving fails, warn once and stop saving."""
        before = self._progress.of(self.lesson.key)
        try:
            self._progress.keep(self.lesson.key, before if before.is_finished else self.standing)
        except FileError as error:
            self._progress = LearnerRecord(None)
            self._show(f"Your progress is not kept: {error.detail}.")

    # --- lines of the lesson ------------------------------------------------------------------------------------------

    def _carry_out(self, lines: tuple[str, ...] | list[str]) -> None:
        self._busy = True
        try:
            for line in lines:
                self._front_end.take(line)
        finally:
            self._busy = False


def marks_of(lesson: Lesson, step: LessonStep, evidence: Evidence, started: float) -> tuple[Mark, ...]:
    """Return the marks of a step. `started`: the robot's clock when the step began [s]."""
    return mark_checks(step.checks, structs.replace(evidence, started=started), Basis(locations=lesson.locations))


def _missing(marks: tuple[Mark, ...]) -> str:
    """Return the reasons of the failed checks."""
    return "; ".join(one.reason for one in marks if not one.passed)


def _code(lines: tuple[str, ...]) -> str:
    return "\n".join(f"    {line}" for line in lines)

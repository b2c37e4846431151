"""Carry out `vrs learn`: lead a learner through lessons at the prompt."""

from __future__ import annotations

import os
import sys
from argparse import Namespace
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import teller
from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.render.console import draw_lesson_text
from vrs_cli.repl import config, shell
from vrs_cli.teach import lessons
from vrs_cli.teach.learn import Learner, LearnerRecord, LessonStanding

if TYPE_CHECKING:
    from vrs_cli.net.local_server import PagePlace

OK, FAILED = 0, 1


def learn(options: Namespace) -> int:
    """Lead a learner through lessons until the learner leaves; return the exit status. Raises VrsError."""
    if options.check is not None:
        return _check(Path(options.check))
    file = None  # the file that stores the learner's progress; None: it is not stored
    with suppress(RuntimeError):  # the user has no home folder
        file = config.state_folder(os.environ) / "learn.json"
    course = _Course(options.lesson, file)
    if options.reset:
        course.reset()
        return OK
    if options.list:
        course.list()
        return OK
    return course.run(options)


class _Course:
    """The lessons that the command line names: the lessons of vrs, or those of a folder."""

    def __init__(self, word: str | None, progress_file: Path | None) -> None:
        self._file = progress_file
        self._page: PagePlace | None = None  # the page of the last lesson, kept for the next one
        folder = None if word is None or not Path(word).is_dir() else Path(word)
        if folder is not None and (folder / "lesson.md").exists():
            self.folders: tuple[Path, ...] = (folder,)
        else:
            self.folders = lessons.lesson_folders(folder or lessons.lessons_folder())
        if not self.folders:
            raise NonexistentFile(f"{folder} has no lessons", "a lesson is a folder, as 01_first: docs/learn.md")
        self._asked = None if word is None or folder is not None else lessons.chosen_folder(word, self.folders)

    def reset(self) -> None:
        """Delete the learner's progress."""
        if self._file is None or not self._file.exists():
            print("There is nothing to forget")
        elif self._asked is None:
            self._file.unlink()
            print("All lessons begin anew")
        else:
            LearnerRecord(self._file).keep(lessons.progress_key(self._asked), LessonStanding())
            print(f"{self._asked.name} begins anew")

    def list(self) -> None:
        """Print the lessons, with the learner's progress in each."""
        progress = self._progress()
        for number, lesson in enumerate(map(lessons.read_lesson, self.folders), 1):
            print(f"{number:3}  {lesson.title:40} {progress.of(lesson.key).summary():>8}  {lesson.summary}")

    def run(self, options: Namespace) -> int:
        """Lead the learner through lessons until the learner leaves; return the exit status."""
        progress = self._progress()
        # continue with an unfinished lesson: search from the latest lesson on, then from the first
        keys = [lessons.progress_key(folder) for folder in self.folders]
        start = keys.index(progress.latest) if progress.latest in keys else 0
        order = [*zip(keys, self.folders, strict=True)]
        unfinished = next((one for key, one in order[start:] + order[:start] if not progress.of(key).is_finished), None)
        folder, first, status = self._asked or unfinished, True, OK
        if folder is None:
            print("All lessons are done. vrs learn 1 begins the first again, vrs learn --list shows them")
            return OK
        while folder is not None:
            status, folder = self._lesson(options, lessons.read_lesson(folder), progress, first=first)
            first = False
        return status

    def _progress(self) -> LearnerRecord:
        """Read the learner's progress. If the file is not a valid record of progress, report this and leave it
        unchanged."""
        try:
            return LearnerRecord(self._file)
        except FileError as error:
            teller("vrs learn")(f"{error}; until then nothing is kept")
            return LearnerRecord(None)

    def _lesson(
        self, options: Namespace, lesson: lessons.Lesson, progress: LearnerRecord, *, first: bool
    ) -> tuple[int, Path | None]:
        """Lead the learner through one lesson. Return the exit status, and the next lesson that the learner has
        chosen."""
        from vrs_cli.teach.classroom import Classroom, LessonPlace

        tell, attended = teller(options.prog), shell.on_terminal()
        standing = progress.of(lesson.key)
        with ExitStack() as stack:
            if options.view and self._page is None:
                from vrs_cli.cli.view import page_place

                options.host = "127.0.0.1"
                self._page = page_place(options)
            classroom = Classroom(lesson, stack, tell, page=self._page, attended=attended)
            begin = 0 if standing.is_finished else standing.passed
            course = {folder: _title(folder) for folder in self.folders}
            show = draw_lesson_text if attended else partial(print, end="\n\n", flush=True)
            learner = Learner(lesson, classroom.look, show, progress, course, begin)
            if self._page is not None and classroom.local_robot is not None:
                self._page = self._page.at_port(classroom.local_robot.port)  # later lessons use the same port
                if first:
                    from vrs_cli.cli.view import tell_page

                    tell_page(options, classroom.local_robot.page(classroom.local_robot.name))
            shell.at(LessonPlace(classroom, learner, first=first))
        if learner.standing.is_finished or learner.wanted is not None:
            return OK, learner.wanted
        if not attended:
            passed, of = learner.standing.passed, learner.standing.of
            tell(f"{lesson.title}: {passed} of {of} steps are passed; the next is {lesson.steps[passed].name}")
        return OK if attended else FAILED, None


def _title(folder: Path) -> str:
    try:
        return lessons.sections((folder / "lesson.md").read_text(encoding="utf-8"))[0]
    except (OSError, UnicodeError):
        return folder.name


def _check(folder: Path) -> int:
    """Report the mistakes of a lesson, or of all lessons in a folder; return the exit status."""
    from vrs_cli.teach.classroom import faults

    if not folder.is_dir():
        raise NonexistentFile(str(folder), "name the folder of a lesson, or of several")
    several: Sequence[Path] = () if (folder / "checks.toml").exists() else lessons.lesson_folders(folder)
    found = 0
    for one in several or (folder,):
        try:
            lesson = lessons.read_lesson(one)
            wrong = list(faults(lesson))
        except FileDamaged as error:
            wrong, lesson = error.detail.splitlines(), None
        for line in wrong:
            print(line)
        found += len(wrong)
        if not wrong and lesson is not None:
            print(f"{one.name}: {len(lesson.steps)} steps, each passed by its model lines, and not before")
    sys.stdout.flush()
    return FAILED if found else OK

"""Read a lesson: its steps, each with a task, checks, hints and model lines.

NN_name/lesson.md: the title, the introduction, and the task of each step below a heading with ##. checks.toml: summary,
robot, dialect, [delay], [[step]], [[step.check]]. cell.toml: the cell around the robot (optional). given.v2: given
locations and programs (optional).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path

from msgspec import Struct, structs

from vrs_cli.errors import FileDamaged, NonexistentFile, VrsError, did_you_mean
from vrs_cli.extras import shipped_folder
from vrs_cli.files.cell_text import CellEntry
from vrs_cli.files.opening import text_at
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.loaded_file import LoadedFile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.run.signals import Cell
from vrs_cli.language.run.variables import Item
from vrs_cli.net.delay_line import Delays, parse_delays
from vrs_cli.teach.checks import AnyCheck
from vrs_cli.teach.exercise_text import ExerciseText, SurroundingsReader
from vrs_cli.teach.kinds import read_check
from vrs_cli.values.diagnostics import Dialect
from vrs_cli.values.numbers import Value

MAX_CHARS = 200_000
KEYS = ("summary", "robot", "dialect", "delay", "step")
STEP_KEYS = ("name", "nudge", "idea", "model", "wrong", "passed", "check")
_NUMBER = re.compile(r"(\d+)[_-]")
_TITLE = re.compile(r"# +(.+?)\s*$")
_TASK = re.compile(r"## +(.+?)\s*$")


class LessonStep(Struct, frozen=True):
    """A step of a lesson. `task`: its text in Markdown. `nudge`, `idea`: the first two hints. `model`: the lines of the
    model solution, which pass the step. `wrong`: lines that do not pass it. `passed`: the message when the step is
    passed. `line`: the first line of the step in checks.toml."""

    name: str
    task: str
    nudge: str
    idea: str
    model: tuple[str, ...]
    wrong: tuple[tuple[str, ...], ...]
    passed: str
    checks: tuple[AnyCheck, ...]
    line: int


class Lesson(Struct, frozen=True):
    """A lesson. `name`: the name of its folder. `number`: its position in a course; 0 outside of courses. `delays`: the
    delays of commands and answers, if the lesson uses a real-time robot over a delayed connection; None if the robot
    runs in the shell's process."""

    name: str
    number: int
    folder: str
    title: str
    summary: str
    intro: str
    robot: RobotModel
    dialect: Dialect
    cell: Cell
    cell_file: str | None
    given: LoadedFile | None
    locations: Mapping[Item, Value]
    delays: tuple[Delays, Delays] | None
    steps: tuple[LessonStep, ...]

    def give(self, session: Session) -> None:
        """Prepare a session for the lesson: set its dialect, and give it the programs and locations of the lesson."""
        session.dialect = self.dialect
        session.unstored.asked_about = False
        if self.given is not None:
            session.take(self.given)

    @property
    def checks_file(self) -> str:
        return str(Path(self.folder) / "checks.toml")

    @property
    def key(self) -> str:
        """Return the key of the lesson in the learner's progress."""
        return progress_key(Path(self.folder))


def lessons_folder() -> Path:
    return Path(shipped_folder("programs"), "lessons")


def lesson_folders(folder: Path) -> tuple[Path, ...]:
    """Return the folders of the lessons of a course, in order."""
    found = [one for one in folder.iterdir() if _NUMBER.match(one.name) and one.is_dir()]
    return tuple(sorted(found, key=lambda one: number_of(one.name)))


def number_of(name: str) -> int:
    """Return the number at the start of a folder's name; 0 if there is none."""
    found = _NUMBER.match(name)
    return 0 if found is None else int(found[1])


def progress_key(folder: Path) -> str:
    """Return the key of a lesson in a user's progress: the name of a shipped lesson, or the path of any other
    lesson."""
    found = folder.resolve()
    return found.name if found.parent == lessons_folder().resolve() else str(found)


def chosen_folder(word: str, folders: tuple[Path, ...]) -> Path:
    """Return the folder of the lesson with a number, a name, or a part of a name. Raises NonexistentFile."""
    if word.isdigit():
        found = tuple(one for one in folders if number_of(one.name) == int(word))
    else:
        names = {one.name.lower(): one for one in folders}
        key = word.lower().replace(" ", "_").replace("-", "_")
        found = tuple([names[key]] if key in names else [one for name, one in names.items() if key in name])
    if len(found) == 1:
        return found[0]
    if found:
        raise NonexistentFile(f"{word} may be {' or '.join(one.name for one in found)}", "say more of the name")
    titles = [re.sub(_NUMBER, "", one.name) for one in folders]
    known = f"there are 1 to {len(folders)}: vrs learn --list" if folders else "the course has none"
    raise NonexistentFile(f"there is no lesson {word}", did_you_mean(word.lower(), titles, known))


def read_lesson(folder: str | Path) -> Lesson:
    """Read a lesson. Raises NonexistentFile, or FileDamaged with all mistakes at once, each with its file, its line and
    the correction."""
    return _LessonReader(Path(folder)).read()


def sections(text: str) -> tuple[str, str, dict[str, tuple[int, str]]]:
    """Return the title and the introduction of a lesson.md, and a dict from the name of each step to its line and
    task."""
    title, parts, name = "", list[str](), ""
    found = dict[str, tuple[int, list[str]]]()
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        fenced ^= line.startswith("```")
        if not fenced and (head := _TASK.match(line)):
            name = head[1]
            found[name] = number, []
        elif not fenced and not title and not found and (head := _TITLE.match(line)):
            title = head[1]
        else:
            (found[name][1] if found else parts).append(line)
    tasks = {name: (number, "\n".join(lines).strip()) for name, (number, lines) in found.items()}
    return title, "\n".join(parts).strip(), tasks


class _LessonReader(SurroundingsReader):
    """A reader of the files of a lesson, which collects their mistakes."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.folder = folder
        self.text_file = folder / "lesson.md"

    def read(self) -> Lesson:
        """Read all files of the lesson. Raises the errors of `read_lesson`."""
        path = self.folder / "checks.toml"
        if not path.is_file() or not self.text_file.is_file():
            missing = self.text_file if path.is_file() else path
            hint = "a lesson is a folder with lesson.md and checks.toml: docs/learn.md describes them"
            raise NonexistentFile(f"{self.folder} is no lesson: it has no {missing.name}", hint)
        reader = ExerciseText(str(path), text_at(str(path), MAX_CHARS))
        whole, table = reader.whole, reader.table
        reader.check_keys(whole, KEYS)
        robot = self.robot(reader)
        dialect = reader.dialect(whole, "dialect") if "dialect" in table else Dialect.VPLUS
        cell = self.cell()
        given = None if robot is None else self.read_given(robot, dialect)
        locations = {} if given is None else given.variables.values()
        reader.locations = frozenset(locations)
        reader.parts = tuple(one.name for one in cell.scene.parts)
        reader.bodies = (*reader.parts, *(one.name for one in cell.scene.fixtures))
        title, intro, tasks = sections(text_at(str(self.text_file), MAX_CHARS))
        if not title:
            self.wrong.append(f"{self.text_file}:1: the lesson has no title: begin with a line `# Title`")
        summary = reader.text(whole, "summary") if "summary" in table else title
        delays = self._delays(reader)
        steps = tuple(self._steps(reader, tasks))
        self.wrong = [*reader.wrong, *self.wrong]
        if self.wrong or robot is None:
            raise FileDamaged("\n".join(self.wrong), "docs/learn.md describes the files of a lesson")
        folder = self.folder.resolve()
        cell_file = self.folder / "cell.toml"
        cell_path = str(cell_file) if cell_file.exists() else None
        return Lesson(
            folder.name,
            number_of(folder.name),
            str(self.folder),
            title,
            summary,
            intro,
            robot,
            dialect,
            cell,
            cell_path,
            given,
            locations,
            delays,
            steps,
        )

    # --- checks.toml ---

    def _delays(self, reader: ExerciseText) -> tuple[Delays, Delays] | None:
        ways, found = ("forward", "backward"), list[Delays]()
        entry = reader.optional_table("delay", ways, 'forward = "300ms" and backward = "300ms"')
        if entry is None:
            return None
        for key in ways:
            try:
                found.append(parse_delays(reader.text(entry, key) or "0"))
            except VrsError as error:
                reader.fault(entry, key, f"{error.detail} ({error.hint})" if error.hint else error.detail)
        return (found[0], found[1]) if len(found) == 2 else None

    def _steps(self, reader: ExerciseText, tasks: Mapping[str, tuple[int, str]]) -> Iterator[LessonStep]:
        """Read each [[step]]. The task of a step is in lesson.md, below a heading with the name of the step."""
        given = reader.table.get("step", [])
        if not given:
            reader.fault(reader.whole, "step", "there is none: write [[step]], and below it name = ...")
        steps = list(reader.entries("step", given, STEP_KEYS))
        checks = self._checks(reader, steps)
        names = list[str]()
        for entry, own in zip(steps, checks, strict=True):
            name = reader.text(entry, "name").strip()
            if name in names:
                reader.fault(entry, "name", f"{name} is the name of another step: give each a name of its own")
            names.append(name)
            if name and name not in tasks:
                near = did_you_mean(name, tasks, f"write a heading `## {name}` there, and the task below it")
                reader.fault(entry, "name", f"{self.text_file.name} has no step {name}; {near}")
            elif name and not tasks[name][1]:
                self.wrong.append(f"{self.text_file}:{tasks[name][0]}: there is no task below ## {name}")
            model = reader.texts(entry, "model")
            yield LessonStep(
                name,
                tasks.get(name, (0, ""))[1],
                reader.text(entry, "nudge"),
                reader.text(entry, "idea"),
                model,
                self._wrong_lines(reader, entry),
                reader.text(entry, "passed"),
                own,
                entry.lines.start + 1,
            )
        for name, (number, _) in tasks.items():
            if given and name not in names:
                what = f"there is no step {name} in checks.toml: write [[step]], and below it name = "
                self.wrong.append(f'{self.text_file}:{number}: {what}"{name}"')

    def _checks(self, reader: ExerciseText, steps: list[CellEntry]) -> list[tuple[AnyCheck, ...]]:
        """Read the checks of each step."""
        tables = [entry.given.get("check", []) for entry in steps]
        sound = [isinstance(own, list) and own and all(isinstance(one, dict) for one in own) for own in tables]
        known = [one for own, right in zip(tables, sound, strict=True) if right for one in own]
        entries = reader.entries(r"step\.check", known, None)
        found = list[tuple[AnyCheck, ...]]()
        for entry, own, right in zip(steps, tables, sound, strict=True):
            if not right:
                what = "there is none: write [[step.check]] below the step, and below it kind = ..."
                reader.fault(entry, "check", what)
            named = (check._replace(name=f"{entry.name}check: ") for check in islice(entries, len(own) if right else 0))
            read = [check for one in named if (check := read_check(reader, one)) is not None]
            names = [check.name for check in read]
            counts = [names[: k + 1].count(name) for k, name in enumerate(names)]
            found.append(
                tuple(
                    # add a number to checks that share a name: `joints`, `joints 2`
                    check if n == 1 else structs.replace(check, name=f"{check.name} {n}")
                    for check, n in zip(read, counts, strict=True)
                )
            )
        return found

    def _wrong_lines(self, reader: ExerciseText, entry: CellEntry) -> tuple[tuple[str, ...], ...]:
        if "wrong" not in entry.given:
            return ()
        found = reader.list_of(entry, "wrong", 'lists of lines that do not pass, such as [["DRIVE 1, 5"], ["READY"]]')
        if not all(isinstance(one, list) and one and all(isinstance(line, str) for line in one) for one in found):
            reader.fault(entry, "wrong", 'each is a list of lines, such as [["DRIVE 1, 5"], ["READY", "UNDO"]]')
            return ()
        return tuple(tuple(lines) for lines in found)

"""Read an exercise: the files for students, the files for grading, and its variants.

NAME/exercise has the files for students. text.md: the task. cell.toml: the cell around the robot (optional). given.v2:
given locations and programs (optional). signals.csv: when inputs change, as for `vrs run --signals` (optional).
start.v2: a skeleton program (optional).

NAME/teacher has the files for grading. checks.toml: title, robot, program, limits, rounding, checks, variants.
model.v2: the model solution. wrong/*.v2: typical wrong submissions, with `; fails: NAME OF CHECK` above the first
program.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import takewhile
from pathlib import Path
from typing import Any

from msgspec import Struct, structs

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.files.opening import text_at
from vrs_cli.files.timed_lines import read_signals
from vrs_cli.interfaces.station.loaded_file import LoadedFile
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.run.signals import NO_INPUTS, Cell, Inputs
from vrs_cli.language.run.variables import Item
from vrs_cli.teach.checks import AnyCheck
from vrs_cli.teach.exercise_text import ExerciseText, SurroundingsReader, program_text
from vrs_cli.teach.judging.basis import Rounding
from vrs_cli.teach.kinds import read_checks
from vrs_cli.teach.variants import Situation, Variant, move, read_variants
from vrs_cli.values.diagnostics import Dialect
from vrs_cli.values.numbers import Value

KEYS = (
    *("title", "robot", "dialect", "program", "limits", "rounding_mm", "rounding_deg", "rounding_s"),
    *("check", "variant", "similar"),
)
LIMITS: Mapping[str, tuple[str, float]] = {  # key in checks.toml: field of Limits, and maximum value
    "time": ("max_time", 86_400.0),
    "steps": ("max_steps", 100_000_000),
    "elements": ("max_elements", 100_000_000),
    "output": ("max_output", 100_000_000),
    "disk": ("max_disk", 1_000_000_000),
}
USUAL_LIMITS = Limits(max_time=600.0, max_steps=10_000, max_elements=30_000, max_output=20_000, max_disk=100_000)
_FAILS = re.compile(r"(?i)\s*;\s*fails\s*:\s*(.+?)\s*$")


class WrongSubmission(Struct, frozen=True):
    """A typical wrong submission. `fails`: names of the checks that must fail. `text`: the source of the program."""

    path: str
    fails: tuple[str, ...]
    text: str


class Exercise(Struct, frozen=True):
    """An exercise, or a variant of it.

    `seed`: the seed of the variant; None for the unchanged exercise. `robot`: the model of the robot. `program`: the
    program to run; None: the first program of a submission. `cell`, `inputs`, `given`: the cell, the timed changes of
    inputs, and the given programs and values of this variant. `solution`: the text of the model solution. `similar`:
    the minimum similarity (0 to 1) of submissions that are listed as similar; None: no submissions are listed.
    """

    name: str
    folder: str
    title: str
    robot: RobotModel
    dialect: Dialect
    program: str | None
    limits: Limits
    rounding: Rounding
    cell: Cell
    inputs: Inputs
    given: LoadedFile | None
    solution: str
    wrong: tuple[WrongSubmission, ...]
    checks: tuple[AnyCheck, ...]
    variants: tuple[Variant, ...] = ()
    similar: float | None = None
    seed: int | None = None

    @property
    def seeds(self) -> tuple[int | None, ...]:
        """Return the seeds of all variants in which a submission is graded; the first is None, for the unchanged
        exercise."""
        return (None, *(variant.seed for variant in self.variants))

    @property
    def locations(self) -> Mapping[Item, Value]:
        """Return the given variables with their values in this variant."""
        return {} if self.given is None else self.given.variables.values()

    @property
    def given_programs(self) -> frozenset[str]:
        return frozenset() if self.given is None else frozenset(one.program.key for one in self.given.programs)

    @property
    def needs_model(self) -> bool:
        """Return whether a check compares the run with the run of the model solution, so that `mark` needs the evidence
        of both runs."""
        return any(check.needs_model for check in self.checks)

    def variant(self, seed: int | None) -> Exercise:
        """Return the variant with a seed; for None, return the exercise unchanged. Raises KeyError for an unknown
        seed."""
        if seed is None:
            return self
        variant = next((one for one in self.variants if one.seed == seed), None)
        if variant is None:
            raise KeyError(seed)
        around = move(Situation(self.cell, self.inputs, self.given), variant)
        return structs.replace(self, cell=around.cell, inputs=around.inputs, given=around.given, seed=seed)

    def give(self, station: Station) -> None:
        """Put the given programs and values into the memory of a station, replacing those with the same names.

        Call it before a submission is loaded, so that the analyzer knows them, and again afterwards, so that the
        submission cannot replace them. Raises ProgramInterlocked.
        """
        if self.given is not None:
            station.take(self.given)


def read_exercise(folder: str | Path) -> Exercise:
    """Read an exercise. Raises NonexistentFile, or FileDamaged with all mistakes at once, each with its file, its line
    and the correction."""
    return _ExerciseReader(Path(folder)).read()


class _ExerciseReader(SurroundingsReader):
    """A reader of the files of an exercise, which collects their mistakes."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder / "exercise")
        self.folder, self.teacher = folder, folder / "teacher"

    def read(self) -> Exercise:
        """Read all files of the exercise. Raises the errors of `read_exercise`."""
        if not self.teacher.is_dir():
            hint = "an exercise is a folder with the folders exercise and teacher; vrs grade --new NAME makes one"
            raise NonexistentFile(f"{self.folder} is no exercise: it has no folder teacher", hint)
        path = str(self.teacher / "checks.toml")
        reader = ExerciseText(path, text_at(path, 200_000))
        whole, table = reader.whole, reader.table
        reader.check_keys(whole, KEYS)
        robot = self.robot(reader)
        cell, inputs = self.cell(), self._inputs()
        dialect = reader.dialect(whole, "dialect") if "dialect" in table else Dialect.VPLUS
        given = None if robot is None else self.read_given(robot, dialect)
        if given is not None:
            reader.locations = frozenset(given.variables.values())
        parts, fixtures = (tuple(one.name for one in rows) for rows in (cell.scene.parts, cell.scene.fixtures))
        links = () if robot is None else tuple(f"link {i}" for i in range(1, robot.joint_count + 1))
        reader.parts, reader.bodies = parts, (*parts, *fixtures, "floor", "base", *links, "hand")
        checks = read_checks(reader)
        variants = read_variants(reader, Situation(cell, inputs, given))
        limits = self._limits(reader)
        steps = {unit: f"rounding_{unit}" for unit in Rounding.__struct_fields__}
        rounding = Rounding(
            **{unit: reader.number(whole, key, 1e-6, 10.0, unit) for unit, key in steps.items() if key in table}
        )
        alike = reader.optional_table("similar", ("least",), "least = 0.8")
        similar = None if alike is None else reader.number(alike, "least", 0.0, 1.0)
        program = reader.text(whole, "program") if "program" in table else None
        title = reader.text(whole, "title") if "title" in table else self.folder.name
        self.wrong = [*reader.wrong, *self.wrong]
        solution = self.read_file(self.teacher / "model.v2", program_text, "", required=True)
        wrong = self._wrong_submissions(table.get("check", []))
        if self.wrong or robot is None:
            raise FileDamaged("\n".join(self.wrong), "docs/exercises.md describes the files of an exercise")
        return Exercise(
            self.folder.resolve().name,
            str(self.folder),
            title,
            robot,
            dialect,
            program,
            limits,
            rounding,
            cell,
            inputs,
            given,
            solution,
            wrong,
            checks,
            variants,
            similar,
        )

    def _limits(self, reader: ExerciseText) -> Limits:
        entry = reader.optional_table("limits", LIMITS, "time = 60")
        if entry is None:
            return USUAL_LIMITS
        fields = ((key, *row) for key, row in LIMITS.items() if key in entry.given)
        numbers = {field: reader.number(entry, key, 1.0, most) for key, field, most in fields}
        counts = {field: int(number) for field, number in numbers.items() if field != "max_time"}
        return structs.replace(USUAL_LIMITS, **numbers | counts)

    # --- the other files ---

    def _inputs(self) -> Inputs:
        path = self.around / "signals.csv"
        try:
            return read_signals(str(path)) if path.exists() else NO_INPUTS
        except FileError as error:
            self.wrong.append(f"{error.detail} ({error.hint})" if error.hint else error.detail)
            return NO_INPUTS

    def _wrong_submissions(self, checks: Any) -> tuple[WrongSubmission, ...]:
        """Read the wrong submissions, wrong/*.v2. `checks`: the tables of all checks, including those with mistakes."""
        rows = [row for row in checks if isinstance(row, dict)] if isinstance(checks, list) else []
        names = (row.get("name", row.get("kind")) for row in rows)
        found, known = [], {name.lower(): name for name in names if isinstance(name, str)}
        for path in sorted((self.teacher / "wrong").glob("*.v2")):
            text = self.read_file(path, program_text, "", required=True)
            heading = takewhile(lambda line: not line.strip() or line.lstrip().startswith(";"), text.splitlines())
            said = [(number, match[1]) for number, line in enumerate(heading, 1) if (match := _FAILS.match(line))]
            for number, name in said:
                if known and name.lower() not in known:
                    there = ", ".join(known.values())
                    self.wrong.append(f"{path}:{number}: no check is called {name[:80]}; the checks are {there}")
            if not said:
                hint = "write `; fails: NAME OF CHECK` above the first program"
                self.wrong.append(f"{path}:1: it does not say which checks it fails; {hint}")
            fails = (known[name.lower()] for _, name in said if name.lower() in known)
            found.append(WrongSubmission(str(path), tuple(dict.fromkeys(fails)), text))
        return tuple(found)

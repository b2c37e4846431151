"""Propose an exercise from a solution.

Measured results become checks with tolerances; the teacher then removes unwanted checks.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import chdir
from importlib.util import find_spec
from itertools import islice, pairwise
from math import ceil, degrees, dist, hypot
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import NamedTuple

from vrs_cli.engine.position import position_at
from vrs_cli.errors import FileDamaged, FileExists, VrsError
from vrs_cli.files.opening import FREE
from vrs_cli.files.program_file import cell_of_program, find_program_file, read_program_file
from vrs_cli.kinematics.transform import Transform, Vector, angle_between, length, position, vector_difference
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import named_above, parse_file
from vrs_cli.language.text.printer import print_file
from vrs_cli.language.words.values import numbers_of
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.findings import item_text, mutants_of
from vrs_cli.teach.grading import Grader, Submission, SubmissionRuns, mark
from vrs_cli.teach.judging.basis import Basis, Evidence, JudgedRun
from vrs_cli.teach.judging.outcomes import final_part, output_changes, words_of
from vrs_cli.teach.tip import greatest
from vrs_cli.trajectory.segment import JointPath
from vrs_cli.values.diagnostics import Dialect
from vrs_cli.values.numbers import count
from vrs_cli.values.scene import Fixture
from vrs_cli.world.settings import WorldSettings

NEAR = 1e-4  # [m] maximum distance between the tool and a location that counts as reached
MOVABLE = 0.4  # [m] maximum size of a fixture that variants move; a larger fixture is assumed to be a table
CLOSE = 0.06  # [m] maximum distance between a location and the part to which it belongs
OVER = 0.25  # [m] maximum height above a fixture at which a location belongs to the fixture
MAX_PLACES, MAX_PATHS, MAX_LINES, MAX_CHANGES, MAX_WRONG = 12, 6, 50, 20, 5
SPARE_SPEED, SPARE_TIME = 1.1, 1.25  # ratio of a proposed limit to the measured value
# words that a proposed check requires if the solution uses them
NOTABLE = ("FRAME", "REACT", "REACTI", "WAIT", "CALL", "SHIFT", "FOR", "WHILE", "CASE")
STEPS = (
    "[30, 30, 0]\nturn = 15",
    "[10, 10, 0]\nturn = 5",
)  # shifts and turns of a variant, in the order in which they are tried
SEEDS = (1, 2, 3)
NUMBER = r"\s*-?\d+(\.\d+)?"  # pattern of a number, with the blanks before it


class Proposed(NamedTuple):
    """A proposed check: its name, the comment above it, and the lines below `[[check]]`."""

    name: str
    comment: str
    lines: tuple[str, ...]

    def text(self) -> str:
        """Return the entry of checks.toml."""
        return "\n".join((f"# {self.comment}", "[[check]]", f"name = {_quote(self.name)}", *self.lines, ""))


def propose(name: str, solution: str, cell: str | None = None) -> tuple[Path, list[str]]:
    """Write the exercise `name` (a new folder) from a solution; return the folder, and messages for the teacher.

    Raises FileExists, NonexistentFile, FileError, and FileDamaged if the solution has mistakes or stops with an error.
    """
    target = Path(name)
    if target.exists() or target.is_symlink():
        raise FileExists(f"{target} is there already", "give another name: nothing is overwritten")
    if not target.parent.is_dir():
        raise FileDamaged(f"{target.parent} is no folder", "make it first")
    path = Path(find_program_file(solution))
    text = read_program_file(path)
    draft = Path(mkdtemp(prefix=".vrs-new-", dir=target.parent.resolve()))
    try:
        proposed = _Proposal(draft, target.name, path, text, cell).write()
        os.rename(draft, target)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    target.chmod(0o755)
    return target, proposed


class _Proposal:
    """An exercise that is being written into a folder."""

    def __init__(self, folder: Path, name: str, path: Path, text: str, cell: str | None) -> None:
        self.folder, self.name, self.path, self.text = folder, name, path, text
        self.exercise_folder, self.teacher = folder / "exercise", folder / "teacher"
        named = (cell, "--cell") if cell is not None else cell_of_program(text, str(path), FREE)
        self.cell = None if named is None else Path(named[0])
        self.robot, _ = named_above(text, "robot") or ("puma560", None)
        word, _ = named_above(text, "dialect") or (Dialect.VPLUS.value, None)
        self.dialect = next((one for one in Dialect if one.value == word.lower()), Dialect.VPLUS)
        self.file, wrong = parse_file(text, self.dialect)
        if wrong:
            more = f" (and {count(len(wrong) - 1, 'more mistake')})" if len(wrong) > 1 else ""
            raise FileDamaged(f"{path}:{wrong[0].span.line}: {wrong[0].message}{more}", "vrs check tells all mistakes")
        self.programs = [part for part in self.file.parts if isinstance(part, ast.Program)]
        if not self.programs:
            raise FileDamaged(f"{path} holds no program", "a program begins with .PROGRAM name")

    def write(self) -> list[str]:
        """Write all files. Return messages for the teacher."""
        for folder in (self.exercise_folder, self.teacher / "wrong"):
            folder.mkdir(parents=True)
        self._split()
        self._copy_cell()
        self._write_checks((NO_ERROR,), "")
        exercise = self._read()
        run = self._run(exercise, exercise.solution)
        if run.fault is not None:
            where = f"{self.path}: step {run.fault.step} of {run.fault.program}"
            raise FileDamaged(f"{where}: {run.fault.message}", "propose from a solution that runs to its end")
        checks = tuple(proposed_checks(exercise, run))
        groups = tuple(groups_of(exercise, run, self.programs))
        self._write_checks(checks, "")
        checks, wrong = self._deciding_checks(checks)
        variants = self._variants(checks, groups)
        self._write_checks(checks, variants)
        for number, (what, text) in enumerate(wrong, 1):
            if lost := self._failed_checks(text):
                fails = "".join(f"; fails: {name}\n" for name in lost)
                self._put(self.teacher / "wrong" / f"mistake_{number}.v2", f"; The solution {what}.\n{fails}{text}")
        self._write_text(self._read())
        return [
            f"{count(len(checks), 'check')} proposed: remove those that are not wanted from teacher/checks.toml",
            f"{count(len(SEEDS), 'variant')} move {', '.join(name for group in groups for name in group)}"
            if variants
            else "no variants: the solution fails when what it uses is moved, or there is nothing to move",
            *(f"{one} is set by the program: give it in .LOCATIONS if variants are to move it" for one in self._set()),
        ]

    def _read(self) -> Exercise:
        return read_exercise(self.folder)

    def _split(self) -> None:
        """Write the programs of the file as the model solution, and its values as given.v2."""
        given = [part for part in self.file.parts if isinstance(part, ast.Section)]
        solution = [part for part in self.file.parts if not isinstance(part, ast.Section)]
        self._put(self.teacher / "model.v2", print_file(ast.File(tuple(solution))))
        values = print_file(ast.File(tuple(given))) if given else ""
        if given:
            self._put(self.exercise_folder / "given.v2", values)
        begin = f"; {self.name}: your program.\n.PROGRAM {self.programs[0].name}()\n    ; your steps\n.END\n"
        self._put(self.exercise_folder / "start.v2", begin + values)

    def _copy_cell(self) -> None:
        if self.cell is None:
            return
        text = self.cell.read_text(encoding="utf-8")
        self._put(self.exercise_folder / "cell.toml", text)
        for mesh in set(re.findall(r'(?m)^\s*file\s*=\s*["\']([^"\']+)["\']', text)):
            source = self.cell.parent / mesh
            if source.is_file() and Path(mesh).name == mesh:
                shutil.copyfile(source, self.exercise_folder / mesh)

    def _write_checks(self, checks: Sequence[Proposed], variants: str) -> None:
        head = [
            "# Proposed from a solution: remove checks that you do not want, and change names, points and tolerances.",
            f"title = {_quote(self.name)}",
            f"robot = {_quote(self.robot)}",
            f"dialect = {_quote(self.dialect.value)}",
            f"program = {_quote(self.programs[0].name)}",
            "",
        ]
        self._put(
            self.teacher / "checks.toml", "\n".join(head) + "\n" + "\n".join(one.text() for one in checks) + variants
        )

    def _run(self, exercise: Exercise, text: str) -> Evidence:
        with TemporaryDirectory(prefix="vrs-new-") as folder, chdir(folder):
            return SubmissionRuns(Submission("", "model.v2", text)).run(exercise)

    def _deciding_checks(self, checks: Sequence[Proposed]) -> tuple[tuple[Proposed, ...], list[tuple[str, str]]]:
        """Return the checks that the solution passes and at least one mutant fails, and the mutants (description, text)
        that fail these checks."""
        exercise = self._read()
        model = self._run(exercise, exercise.solution)
        passed = {one.name for one in mark(exercise, model, model) if one.passed}
        waiting, found, wrong = set(passed), set[str](), list[tuple[str, str]]()
        for mutant in mutants_of(exercise.solution, exercise.dialect, exercise.locations):
            try:
                run = self._run(exercise, mutant.text)
            except VrsError:
                continue
            failed = {one.name for one in mark(exercise, run, model) if not one.passed}
            if failed & waiting and len(wrong) < MAX_WRONG:
                wrong.append((mutant.what, mutant.text))
            found |= failed
            waiting -= failed
            if not waiting:
                break
        return tuple(one for one in checks if one.name in passed & found), wrong

    def _variants(self, checks: Sequence[Proposed], groups: Sequence[Sequence[str]]) -> str:
        """Return the entries of variants in which the solution passes all checks; "" if no variants were found."""
        for step in STEPS if groups else ():
            rows = [f"[[variant.group]]\nmove = [{', '.join(map(_quote, names))}]\nby = {step}\n" for names in groups]
            text = "\n# What belongs together moves together, so that copied numbers fail.\n[[variant]]\n"
            text += f"seed = [{', '.join(map(str, SEEDS))}]\n" + "".join(rows)
            self._write_checks(checks, text)
            try:
                lost = self._failed_checks(self._read().solution)
            except VrsError:
                continue
            if not lost:
                return text
        return ""

    def _failed_checks(self, text: str) -> list[str]:
        """Return the checks that a submission fails in any variant."""
        with TemporaryDirectory(prefix="vrs-new-") as folder, chdir(folder):
            grading, _ = Grader(self._read()).runs(Submission("", "student.v2", text))
        return [one.name for _, one in grading.marks if not one.passed]

    def _write_text(self, exercise: Exercise) -> None:
        rows = [
            f"| `{item_text(item)}` | ... | {_numbers(value)} |"
            for item, value in exercise.locations.items()
            if isinstance(value, Transform)
        ]
        signals = [f"| {number} | {name} |" for number, name in sorted(exercise.cell.names.items())]
        marked = [f"| {check.name} | {check.points:g} |" for check in exercise.checks if not check.hidden]
        parts = [
            f"# {self.name}\n\nDescribe the task here.\n",
            "## What is given\n",
            "`cell.toml` describes the cell around the robot.\n" if self.cell is not None else "",
            "\n".join(("| name | what it is | X, Y, Z, O, A, T [mm, deg] |", "|---|---|---|", *rows, ""))
            if rows
            else "",
            "\n".join(("| signal | name |", "|---|---|", *signals, "")) if signals else "",
            "Use the names, not the numbers: your program will also run with other numbers.\n",
            f"## What to do\n\nWrite a program `{self.programs[0].name}` that ...\n",
            "## What is marked\n",
            "\n".join(("| | points |", "|---|---|", *marked, "")),
        ]
        self._put(self.exercise_folder / "text.md", "\n".join(part for part in parts if part))

    def _set(self) -> Iterator[str]:
        """Yield the locations to which programs assign numbers."""
        lines = self.text.split("\n")
        for statement in (one for program in self.programs for one in program.statements):
            if not isinstance(statement, ast.BadLine):
                line = lines[statement.span.line - 1]
                if found := re.match(r"(?i)\s*SET\s+(#?[a-z][\w.]*)\s*=\s*TRANS\s*\(\s*-?\d", line):
                    yield found[1]

    def _put(self, path: Path, text: str) -> None:
        path.write_text(text, encoding="utf-8", newline="\n")


# --- what the solution did -------------------------------------------------------------------------------------------

NO_ERROR = Proposed("no error", "The program ends without an error.", ('kind = "no_error"',))


def proposed_checks(exercise: Exercise, run: Evidence) -> Iterator[Proposed]:
    """Yield checks that the run of the solution passes. Their limits are its measured values plus a tolerance."""
    judged = JudgedRun(run, Basis(exercise.rounding, exercise.locations, run))
    passed = list(_passed_places(exercise, run))
    names = list(dict.fromkeys(name for name, _ in passed))[:MAX_PLACES]
    needs: tuple[str, ...] = ()
    if names:
        first = "the tool goes to the given places"
        needs = (f"needs = [{_quote(first)}]",)
        listed = ", ".join(map(_quote, names))
        yield Proposed(
            first,
            "The tool passes these places in order. A program that goes nowhere gets no points where they are needed.",
            ('kind = "places"', f"places = [{listed}]", "mm = 1"),
        )
    straight = {(a, b): None for (a, _), (b, is_straight) in pairwise(passed) if is_straight and a != b}
    for a, b in islice(straight, MAX_PATHS):
        yield Proposed(
            f"it goes straight from {a} to {b}",
            "The solution goes there on a straight line.",
            ('kind = "path"', f"from = {_quote(a)}", f"to = {_quote(b)}", "mm = 1"),
        )
    if run.course is None or not _moved_parts(run):
        yield Proposed(
            "it goes the way of the solution",
            "The tool goes where it goes in the solution: remove it where other ways are right too.",
            ('kind = "like_model"', "mm = 2", "points = 2"),
        )
    yield from _ends(run, needs)
    if not exercise.cell.scene.empty and find_spec("mujoco") is not None and not run.contacts:
        yield Proposed("nothing is touched", "Nothing touched anything in the solution.", ('kind = "contact"', *needs))
    yield from _outputs(judged)
    yield from _typed_lines(run)
    statements = [one for program in run.programs for one in program.statements if not isinstance(one, ast.BadLine)]
    found = {word for one in statements for word in words_of(one)}
    used = [word for word in NOTABLE if word in found]
    if used:
        listed = ", ".join(map(_quote, used))
        yield Proposed(
            f"it uses {', '.join(used)}",
            "Words of the solution: keep those that the task is about, if any.",
            ('kind = "words"', f"use = [{listed}]", *needs),
        )
    yield from _rates(judged, needs)
    yield NO_ERROR._replace(lines=(*NO_ERROR.lines, *needs))


def _passed_places(exercise: Exercise, run: Evidence) -> Iterator[tuple[str, bool]]:
    """Yield the given places at which motions ended, in order, each with whether the motion was straight."""
    last = ""
    for one in run.commands:
        if one.end is None or one.end <= one.executed:
            continue
        place = position(_tool(run, one.end))
        near = (
            item_text(item)
            for item, value in exercise.locations.items()
            if isinstance(value, Transform) and dist(position(value), place) <= NEAR
        )
        name = next(near, last)
        if name != last:
            segment, _ = run.timeline.locate(one.end - 1e-6)
            yield name, not isinstance(segment.path, JointPath)
            last = name


def _tool(run: Evidence, t: float) -> Transform:
    return position_at(run.arm, run.timeline, t).T_world_tool


def _moved_parts(run: Evidence) -> list[tuple[str, Transform]]:
    """Return the final poses of parts that moved, or that were not in the cell at the start."""
    course, found = run.course, list[tuple[str, Transform]]()
    for name in () if course is None else course.parts():
        state = final_part(run, name)
        if course is None or state is None or not state.exists:
            continue
        before = course.state(name, run.started)
        turned = degrees(angle_between(before.pose, state.pose))
        if not before.exists or dist(position(before.pose), position(state.pose)) > 1e-3 or turned > 1.0:
            found.append((name, state.pose))
    return found


def _ends(run: Evidence, needs: tuple[str, ...]) -> Iterator[Proposed]:
    """Yield checks of the final poses of parts and tool. `needs`: the lines of TOML that name the checks they need."""
    moved = _moved_parts(run)
    for name, pose in moved:
        lines = ('kind = "part_at"', f"part = {_quote(name)}", 'at = "model"', "mm = 2", "deg = 2", "points = 2")
        yield Proposed(f"{name} is in its place", f"It ended at {_numbers(pose)}.", lines)
    if moved and run.course is not None:
        held = run.course.held_part(run.end)
        said = "the hand is empty" if held is None else f"the hand holds {held}"
        line = () if held is None else (f"part = {_quote(held)}",)
        yield Proposed(said, "What the hand holds in the end.", ('kind = "held"', *line, *needs))
    yield Proposed(
        "the tool ends where it should",
        f"It ended at {_numbers(_tool(run, run.end))}.",
        ('kind = "tool_at"', 'at = "model"', "mm = 1", "deg = 1", *needs),
    )


def _outputs(judged: JudgedRun) -> Iterator[Proposed]:
    changes = output_changes(judged)[:MAX_CHANGES]
    if changes:
        times = ", ".join(f"{one.t:.2f} s" for one in changes)
        lines = ('kind = "signals"', f"changes = [{', '.join(str(one.signal) for one in changes)}]")
        yield Proposed("the outputs change in order", f"They changed at {times}.", lines)


def _typed_lines(run: Evidence) -> Iterator[Proposed]:
    lines = [line.text for line in run.typed if line.text.strip()][:MAX_LINES]
    if lines:
        listed = "".join(f"    {_typed_line(line)},\n" for line in lines)
        what = "What the program types. Numbers may differ: write a line as a text where it has to be this one."
        yield Proposed("the lines are typed", what, ('kind = "typed"', f"lines = [\n{listed}]"))


def _typed_line(line: str) -> str:
    """Return a typed line as a check requires it: as an exact text, or as a pattern if it contains numbers."""
    # the strings between the numbers; split also returns the matches of NUMBER's group
    words = re.split(NUMBER, line)[::2]
    # escape like re.escape, but not blanks, so that the pattern stays readable
    escaped = (re.sub(r"([\\^$.|?*+()\[\]{}])", r"\\\1", one) for one in words)
    return f"{{pattern = {_quote(NUMBER.join(escaped))}}}" if len(words) > 1 else _quote(line)


def _rates(judged: JudgedRun, needs: tuple[str, ...]) -> Iterator[Proposed]:
    """Yield checks that limit speed, acceleration and time. `needs`: the lines of TOML that name the checks they
    need."""
    rows = (
        ("the speed of the tool", "speed", "mm_s", judged.velocity, 10),
        ("the acceleration of the tool", "acceleration", "mm_s2", judged.acceleration, 100),
    )
    for name, kind, key, pieces, step in rows:
        if not pieces:
            continue
        most = 1000.0 * greatest(pieces, length, judged.precision).value
        limit = step * ceil(SPARE_SPEED * most / step)
        what = f"The solution reached {most:.0f} {key.replace('mm_', 'mm/')}; a tenth more is allowed."
        yield Proposed(name, what, (f'kind = "{kind}"', f"{key} = {max(limit, step)}", *needs))
    run = judged.evidence
    took = run.end - run.started
    what = f"The solution took {took:.2f} s; a quarter more is allowed."
    most = 0.5 * ceil(2.0 * SPARE_TIME * took)
    yield Proposed("the time", what, ('kind = "cycle_time"', f"most = {max(most, 0.5):g}", *needs))


# --- what a variant moves together -----------------------------------------------------------------------------------


def groups_of(exercise: Exercise, run: Evidence, programs: Iterable[ast.Program]) -> Iterator[tuple[str, ...]]:
    """Yield groups of names of locations, parts and small fixtures that a variant moves together: things at one place,
    and the points of one FRAME."""
    text = "\n".join(print_file(ast.File((program,))) for program in programs)
    tools = {word.lower() for word in re.findall(r"(?im)^\s*(?:\d+\s+)?(?:TOOL|BASE)\s+([a-z][\w.]*)", text)}
    relative = {word.lower() for word in re.findall(r"(?i):\s*([a-z][\w.]*)", text)}
    places = {
        item_text(item): position(value)
        for item, value in exercise.locations.items()
        if isinstance(value, Transform) and item[0] not in tools | relative and item[1] is None
    }
    scene = exercise.cell.scene
    parts = {one.name: position(one.T_world_part) for one in scene.parts}
    settings = WorldSettings(run.arm, run.cell)
    # [m] size of each fixture, by name
    radii = {one.name: max(solid.radius for solid in settings.solids[one.name]) for one in scene.fixtures}
    fixtures = [one for one in scene.fixtures if 2.0 * radii[one.name] <= MOVABLE]
    together = {name: name for name in (*places, *parts, *(one.name for one in fixtures))}

    def root(name: str) -> str:
        while together[name] != name:
            name = together[name]
        return name

    def is_over(place: Vector, fixture: Fixture) -> bool:
        x, y, z = vector_difference(place, position(fixture.T_world_fixture))
        return hypot(x, y) <= radii[fixture.name] and -radii[fixture.name] <= z <= OVER

    things = (*places.items(), *parts.items())
    frames = (
        [word.strip().lower() for word in points.split(",") if word.strip().lower() in places]
        for points in re.findall(r"(?i)FRAME\s*\(([^()]*)\)", text)
    )
    pairs = (
        *((name, one.name) for one in fixtures for name, place in things if is_over(place, one)),
        *((name, part) for part, at in parts.items() for name, place in things if dist(place, at) <= CLOSE),
        *((one[0], name) for one in (*frames, *(feeder.parts for feeder in scene.feeders)) for name in one[1:]),
    )
    for a, b in pairs:
        together[root(b)] = root(a)
    groups: dict[str, list[str]] = {}
    for name in together:
        groups.setdefault(root(name), []).append(name)
    for names in groups.values():
        if any(name in places for name in names):
            yield tuple(names)


# --- texts -----------------------------------------------------------------------------------------------------------


def _numbers(T: Transform) -> str:
    return ", ".join(f"{number:.1f}".replace("-0.0", "0.0").removesuffix(".0") for number in numbers_of(T))


def _quote(text: str) -> str:
    """Return a string as TOML writes it, in quotes."""
    if "'" not in text and text.isprintable() and ('"' in text or "\\" in text):
        return f"'{text}'"
    plain = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(one if one.isprintable() else f"\\u{ord(one):04x}" for one in plain) + '"'

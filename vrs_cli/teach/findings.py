"""Find faults of an exercise by running its model solution, its wrong submissions, and mutants (programs with one
mistake)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import combinations, islice
from math import dist
from pathlib import Path
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.errors import MotionError, VrsError
from vrs_cli.files.opening import text_at
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import levers
from vrs_cli.kinematics.transform import Transform, compose, inverse, position
from vrs_cli.language.run.variables import Item, subscript
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.words.values import numbers_of, plain
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.exercise_text import ExerciseText, FixedPlace, GivenPlace, ModelPlace
from vrs_cli.teach.grading import Mark, mark
from vrs_cli.teach.judging.basis import Basis, Evidence
from vrs_cli.values.commands import Frames
from vrs_cli.values.diagnostics import Dialect
from vrs_cli.values.numbers import Value
from vrs_cli.world.settings import WorldSettings
from vrs_cli.world.solids import overlap_by

Run = Callable[[Exercise, str], Evidence]  # runs a submission in a variant; raises VrsError if it cannot run
TOOL_REACH = 0.5  # [m] assumed length of a long tool; places beyond the arm's reach plus this are reported
OVERLAP = 2e-3  # [m] maximum overlap of bodies that count as only touching each other


class Finding(Struct, frozen=True):
    """A fault of an exercise: `where` it is (file and line), `what` it is, and the remedy. `doubtful`: the teacher may
    have intended it."""

    where: str
    what: str
    remedy: str
    doubtful: bool = False

    @property
    def text(self) -> str:
        return f"{self.where}: {'warning: ' if self.doubtful else ''}{self.what} ({self.remedy})"


def findings_of(exercise: Exercise, run: Run) -> Iterator[Finding]:
    """Yield all faults of an exercise as they are found."""
    yield from _Inspection(exercise, run).findings()


class _Inspection:
    """The inspection of one exercise. It keeps the runs of the model solution, with which it compares other runs."""

    def __init__(self, exercise: Exercise, run: Run) -> None:
        self.exercise, self._run = exercise, run
        self.path = str(Path(exercise.folder, "teacher", "checks.toml"))
        reader = ExerciseText(self.path, text_at(self.path))
        entries = reader.entries("check", reader.table.get("check", []), None)
        self._lines = {
            str(one.given.get("name", one.given.get("kind"))).lower(): one.lines.start + 1 for one in entries
        }
        self.variants = [exercise.variant(seed) for seed in exercise.seeds]
        self.models: dict[int | None, Evidence] = {}
        self.failed = dict[str, str]()  # maps the name of a check to a file whose run fails the check
        self.sound = True  # whether the model solution passes all checks

    def findings(self) -> Iterator[Finding]:
        yield from self._texts()
        yield from self._places()
        for variant in self.variants:
            yield from self._soundness(variant)
        for variant in self.variants:
            yield from self._model(variant)
            if not self.models:
                break  # stop, because the model solution cannot run in the other variants either
        if not self.sound:
            return  # stop, because nothing else can be judged if the model solution fails
        yield from self._wrong_submissions()
        yield from self._numbers_copied()
        yield from self._mutants()

    def _at(self, name: str) -> str:
        """Return the file and the line at which a check is written, given its name."""
        return f"{self.path}:{self._lines.get(name.lower(), 1)}"

    def _texts(self) -> Iterator[Finding]:
        exercise = self.exercise
        text = Path(exercise.folder, "exercise", "text.md")
        if not text.is_file():
            yield Finding(str(text), "there is no text for students", "write what they are to do")
        for name in (check.name for check in exercise.checks if check.points <= 0.0):
            yield Finding(self._at(name), f"{name}: its weight is 0", "give it points, or remove it")
        if not exercise.wrong:
            where = str(Path(exercise.folder, "teacher", "wrong"))
            yield Finding(where, "there are no wrong submissions", "add typical ones, such as wrong/no_tool.v2", True)
        if not exercise.variants:
            remedy = "[[variant]] moves parts and locations together, so that copied numbers fail"
            yield Finding(self.path, "there are no variants", remedy, True)

    # --- places and scenes ---

    def _places(self) -> Iterator[Finding]:
        """Find places of checks that the arm cannot reach, even with a long tool."""
        centre, (reach, *_) = levers(self.exercise.robot)
        for variant in self.variants:
            basis = Basis(variant.rounding, variant.locations)
            for check in variant.checks:
                for place in (one for one in check.all_places() if not isinstance(one, ModelPlace)):
                    beyond = dist(basis.point(place), centre) - reach - TOOL_REACH
                    if beyond > 0.0:
                        said = f"is {1000.0 * beyond:.0f} mm farther away than the arm and a long tool reach"
                        yield Finding(
                            self._at(check.name),
                            f"{check.name}: {_place_label(place)} {said}{_of(variant)}",
                            "give a place that can be reached",
                        )

    def _soundness(self, variant: Exercise) -> Iterator[Finding]:
        """Find parts that lose their support or overlap other bodies in a variant."""
        arm, scene = arm_for(variant.robot), variant.cell.scene
        if scene.empty:
            return
        now, base = WorldSettings(arm, variant.cell), WorldSettings(arm, self.exercise.cell)
        for name in (part.name for part in scene.parts if part.name not in now.fed):
            before, after = base.stood_on(name), now.stood_on(name)
            if before != after:
                what = f"{name} stands on {after or 'nothing'}{_of(variant)}, and on {before or 'nothing'} in the cell"
                yield Finding(self.path, what, "move it less, or together with what it stands on")
        bodies = [(one.name, one.T_world_part) for one in scene.parts if one.name not in now.fed]
        fixed = [(one.name, one.T_world_fixture) for one in scene.fixtures]
        pairs = (*combinations(bodies, 2), *((body, fixture) for body in bodies for fixture in fixed))
        for (name, T), (other, U) in pairs:
            if overlap_by(now.solids[name], T, now.solids[other], U, OVERLAP):
                yield Finding(self.path, f"{name} is in {other}{_of(variant)}", "move them apart, or move them less")

    # --- runs ---

    def _marks(self, variant: Exercise, text: str) -> tuple[Mark, ...] | str:
        """Return the marks of a submission, or the reason why it did not run."""
        try:
            evidence = self._run(variant, text)
        except VrsError as error:
            return str(error)
        return mark(variant, evidence, self.models[variant.seed])

    def _model(self, variant: Exercise) -> Iterator[Finding]:
        """Run the model solution, and find checks that it fails."""
        path = str(Path(variant.folder, "teacher", "model.v2"))
        try:
            evidence = self.models[variant.seed] = self._run(variant, variant.solution)
        except VrsError as error:
            self.sound = False
            yield Finding(path, f"the model is not executed{_of(variant)}: {error}", "correct it")
            return
        for one in mark(variant, evidence, evidence):
            if not one.passed and one.name not in self.failed:  # report each check once
                self.sound, self.failed[one.name] = False, path
                remedy = "correct the check or the model" if variant.seed is None else "move what belongs together"
                yield Finding(self._at(one.name), f"{one.name}: the model fails it{_of(variant)}: {one.reason}", remedy)
        yield from self._unreachable(variant, evidence)

    def _unreachable(self, variant: Exercise, evidence: Evidence) -> Iterator[Finding]:
        """Find given locations that the tools of the model solution reach in the exercise but not in a variant."""
        if variant.seed is None:
            return
        frames = tuple(dict.fromkeys(segment.motion.frames for segment in evidence.timeline))
        for item, value in variant.locations.items():
            other = self.exercise.locations[item]
            if not isinstance(value, Transform) or not isinstance(other, Transform) or value == other:
                continue
            if _reachable(evidence, other, frames) and not _reachable(evidence, value, frames):
                yield Finding(
                    self.path, f"{item_text(item)} cannot be reached{_of(variant)}", "move it less", doubtful=True
                )

    def _wrong_submissions(self) -> Iterator[Finding]:
        """Run the wrong submissions. Each must fail exactly the checks that it lists, each of them in at least one
        variant."""
        for wrong in self.exercise.wrong:
            failed = dict[str, str]()
            for variant in self.variants:
                marks = self._marks(variant, wrong.text)
                if isinstance(marks, str):
                    failed |= {check.name: marks for check in self.exercise.checks}
                    continue
                failed |= {one.name: f"{one.reason}{_of(variant)}" for one in marks if not one.passed} | failed
            self.failed = dict.fromkeys(failed, wrong.path) | self.failed
            for name in (one for one in wrong.fails if one not in failed):
                what = f"it passes {name!r}, which it says that it fails"
                yield Finding(f"{wrong.path}:1", what, "make the check stricter, or mend its comment")
            for name in (one for one in failed if one not in wrong.fails):
                what = f"it fails {name!r} too: {failed[name]}"
                yield Finding(f"{wrong.path}:1", what, f"write `; fails: {name}` above the first program")

    def _numbers_copied(self) -> Iterator[Finding]:
        """Check that a program with copied numbers fails in each variant that moves locations."""
        exercise = self.exercise
        mutant = copied_numbers(exercise.solution, exercise.dialect, exercise.locations)
        for variant in self.variants[1:]:
            if mutant is None or variant.locations == exercise.locations:
                continue
            marks = self._marks(variant, mutant.text)
            if not isinstance(marks, str) and all(one.passed for one in marks):
                what = f"the model passes everything {mutant.what}{_of(variant)}"
                yield Finding(self.path, what, "move parts together with their locations, or farther", doubtful=True)

    def _mutants(self) -> Iterator[Finding]:
        """Find checks that no wrong submission and no mutant of the model solution fails."""
        exercise = self.exercise
        wanted = {check.name for check in exercise.checks if check.points} - self.failed.keys()
        for mutant in mutants_of(exercise.solution, exercise.dialect, exercise.locations) if wanted else ():
            marks = self._marks(exercise, mutant.text)
            if not isinstance(marks, str):
                wanted -= {one.name for one in marks if not one.passed}
            if not wanted:
                return
        for name in (check.name for check in exercise.checks if check.name in wanted):
            what = f"{name}: nothing fails it, no wrong submission and no mutant of the model"
            yield Finding(self._at(name), what, "make it stricter, or add a wrong submission that fails it")


def _of(variant: Exercise) -> str:
    return "" if variant.seed is None else f" in variant {variant.seed}"


def _place_label(place: FixedPlace | GivenPlace) -> str:
    if isinstance(place, GivenPlace):
        return place.text
    x, y, z = (1000.0 * one for one in position(place.T))
    return f"[{x:.1f}, {y:.1f}, {z:.1f}]"


def item_text(item: Item) -> str:
    """Return a variable as it is written in programs: `corner` or `slot[2,1]`."""
    name, index = item
    return name if index is None else f"{name}[{subscript(index)}]"


def _reachable(evidence: Evidence, T_world_tool: Transform, frames: Sequence[Frames]) -> bool:
    """Return whether the arm reaches a place with any of these tools and base frames."""
    return any(_usable(evidence, compose(one.base, compose(T_world_tool, inverse(one.tool)))) for one in frames)


def _usable(evidence: Evidence, T_robot_flange: Transform) -> bool:
    try:
        return any(solution.usable for solution in evidence.arm.inverse_all(T_robot_flange))
    except (MotionError, NotImplementedError):
        return False


MAX_MUTANTS = 80
SHIFT_MM = 50  # [mm] displacement of a location in a mutant
MOTIONS = ("MOVE", "MOVES", "APPRO", "APPROS", "DEPART", "DEPARTS", "DRIVE", "READY")
OTHER_WORD = {"MOVES": "MOVE", "MOVE": "MOVES", "APPROS": "APPRO", "APPRO": "APPROS", "DEPARTS": "DEPART"}
# a motion to a location that no arm reaches, so that the mutant stops with an error
UNREACHABLE_MOTION = "MOVE TRANS(99999)"


class Mutant(NamedTuple):
    """A program with one mistake. `what`: the mistake in words."""

    what: str
    text: str


def mutants_of(text: str, dialect: Dialect, locations: Mapping[Item, Value]) -> list[Mutant]:
    """Return at most MAX_MUTANTS mutants of the programs in a file. `locations`: given locations; each is shifted in
    one mutant."""
    file, _ = parse_file(text, dialect)
    programs = [part for part in file.parts if isinstance(part, ast.Program)]
    if not programs:
        return []
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    whole = (*_at_end(lines, programs[0]), *_at_start(lines, programs[0], locations), *_with_breaks(lines, programs))
    found = [*whole, *(mutant for program in programs for step in program.steps for mutant in _in_step(lines, step))]
    if len(found) > MAX_MUTANTS:  # pick mutants evenly from the whole list
        found = [found[k * len(found) // MAX_MUTANTS] for k in range(MAX_MUTANTS)]
    return found


def _in_step(lines: Sequence[str], step: ast.Step) -> Iterator[Mutant]:
    """Yield mutants of one line."""
    it, number = step.statement, step.span.line
    word = it.word if isinstance(it, ast.Instruction) else ""
    if not isinstance(it, ast.Instruction | ast.Assignment) or word in ("AUTO", "LOCAL", "GLOBAL"):
        return
    source = lines[number - 1].split(";")[0].strip()
    label = f"{step.label} " if step.label is not None else ""
    yield Mutant(f"without line {number}, {source}", _with_line(lines, number, label))
    if (other := OTHER_WORD.get(word)) is not None:
        changed = re.sub(r"(?i)\b[A-Z.]+\b", other, source.removeprefix(label), count=1)
        yield Mutant(f"with {changed} in line {number}", _with_line(lines, number, label + changed))
    if word == "SIGNAL":
        pattern = re.compile(r"(-?)\s*\b(\d+)\b")
        other_state = pattern.sub(lambda found: f"{'' if found[1] else '-'}{found[2]}", source, count=1)
        yield Mutant(f"with SIGNAL reversed in line {number}", _with_line(lines, number, other_state))


def _at_start(lines: Sequence[str], main: ast.Program, locations: Mapping[Item, Value]) -> Iterator[Mutant]:
    """Yield mutants with a change at the start of the program: a shifted location, or another speed."""
    first = main.span.line
    for item, value in locations.items():
        if isinstance(value, Transform):
            place = item_text(item)
            line = f"SET {place} = SHIFT({place} BY {SHIFT_MM}, 0, 0)"
            yield Mutant(f"with {place} shifted by {SHIFT_MM} mm", _after(lines, first, line))
    for line in ("SPEED 5 ALWAYS", "SPEED 100 ALWAYS", "PARAMETER HAND.TIME = 3"):
        yield Mutant(f"with {line} at the beginning", _after(lines, first, line))
    without = [line for line in lines if not re.match(r"(?i)\s*SPEED\b", line)]
    if len(without) < len(lines):
        yield Mutant("without any SPEED", "\n".join(without))
    slower = [re.sub(r"(?i)^(\s*SPEED\s+)[\d.]+", r"\g<1>7", line) for line in lines]
    faster = [re.sub(r"(?i)^(\s*SPEED\s+)[\d.]+(?!.*(?:MMPS|IPS))", r"\g<1>100", line) for line in lines]
    quick = [re.sub(r"(?i)^(\s*SPEED\s+)([\d.]+)(?=.*(?:MMPS|IPS))", r"\g<1>3*\g<2>", line) for line in faster]
    for what, changed in (("7 %", slower), ("its most", quick)):
        if changed != list(lines):
            yield Mutant(f"with SPEED {what} throughout", "\n".join(changed))


def _at_end(lines: Sequence[str], main: ast.Program) -> Iterator[Mutant]:
    """Yield mutants with an added line, one at the beginning of the program and the others at its end, and a mutant
    without any step."""
    last = max((step.span.line for step in main.steps), default=main.span.line)
    for what, line in (
        ("a motion out of reach", UNREACHABLE_MOTION),
        ("a pause of 20 s", "TIMER 1 = 0\nWAIT TIMER(1) > 20"),
        ("one more motion", "DEPART 30"),
        ("the hand opened", "OPENI"),
        ("the hand closed", "CLOSEI"),
        ("one more line", 'TYPE "more"'),
        ("a word of V+", "x = 2**3"),
        ("all outputs switched off", "RESET"),
        ("outputs 1 to 3 switched on", "SIGNAL 1, 2, 3"),
    ):
        yield Mutant(f"with {what} at the end", _after(lines, last, line))
    yield Mutant("with a motion out of reach at the beginning", _after(lines, main.span.line, UNREACHABLE_MOTION))
    kept = [line for number, line in enumerate(lines, 1) if not main.span.line < number <= last]
    yield Mutant("without a step", "\n".join(kept))


def _with_breaks(lines: Sequence[str], programs: Iterable[ast.Program]) -> Iterator[Mutant]:
    """Yield mutants with BREAK after each motion, without any BREAK, and with another kind of motion."""
    motions = {
        step.span.line
        for program in programs
        for step in program.steps
        if isinstance(step.statement, ast.Instruction) and step.statement.word in MOTIONS
    }
    stopped = [f"{line}\nBREAK" if number in motions else line for number, line in enumerate(lines, 1)]
    yield Mutant("with BREAK after each motion", "\n".join(stopped))
    without = [line for line in lines if not re.match(r"(?i)\s*BREAK\b", line)]
    if len(without) < len(lines):
        yield Mutant("without any BREAK", "\n".join(without))
    for word, other in (("S", ""), ("", "S")):
        pattern = re.compile(rf"(?i)^(\s*(?:\d+\s+)?(?:MOVE|APPRO|DEPART)){word}\b")
        changed = [pattern.sub(rf"\g<1>{other}", line) for line in lines]
        if changed != list(lines):
            yield Mutant(f"with all motions {'straight' if other else 'joint-interpolated'}", "\n".join(changed))


def copied_numbers(text: str, dialect: Dialect, locations: Mapping[Item, Value]) -> Mutant | None:
    """Return the program with the numbers of given locations copied into it; None if it has no program."""
    file, _ = parse_file(text, dialect)
    main = next((part for part in file.parts if isinstance(part, ast.Program)), None)
    if main is None:
        return None
    copies = [
        f"SET {item_text(item)} = TRANS({', '.join(map(plain, numbers_of(value)))})"
        for item, value in locations.items()
        if isinstance(value, Transform)
    ]
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return Mutant("with the numbers of the given locations copied", _after(lines, main.span.line, "\n".join(copies)))


def _after(lines: Sequence[str], number: int, more: str) -> str:
    """Return a file's text with lines inserted after line `number`, counted from 1."""
    return "\n".join([*lines[:number], more, *lines[number:]])


def _with_line(lines: Sequence[str], number: int, other: str) -> str:
    """Return a file's text with line `number` replaced."""
    return "\n".join([*lines[: number - 1], other, *islice(lines, number, None)])

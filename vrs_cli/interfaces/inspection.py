"""Find all mistakes in a program file without running it, for `vrs check` and the language server."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

from msgspec import Struct

from vrs_cli.engine import settings, targets
from vrs_cli.errors import IllegalValue, LocationOutOfRange, MotionError, WithoutEffect
from vrs_cli.interfaces.station.loaded_file import NO_PROGRAMS, variables_of
from vrs_cli.kinematics import joints, transform
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.analysis import analyzer, structure
from vrs_cli.language.analysis.names import Analysis
from vrs_cli.language.run import memory, operations, signals
from vrs_cli.language.run.constants import Constants
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.text import ast, parser
from vrs_cli.values.diagnostics import Diagnostic, Dialect, Severity, Span, in_order, warning

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine

# motions whose first argument is the target location; those in IN_FRONT stop at a distance in front of it
TO_PLACE = frozenset({"MOVE", "MOVES", "MOVET", "MOVEST"})
IN_FRONT = frozenset({"APPRO", "APPROS"})
# these instructions change frames: afterwards only a run can check the reach
CHANGING_FRAMES = frozenset({"TOOL", "BASE"})


def inspect(
    text: str, model: RobotModel, dialect: Dialect = Dialect.VPLUS, cell: signals.Cell = signals.NO_CELL, name: str = ""
) -> tuple[Diagnostic, ...]:
    """Find all mistakes in a single file: those that LOAD would find with an empty memory, steps that cannot be
    reached, constants that fail in every run, and constant locations that this robot cannot reach. Return the findings
    in the order of the lines. Variables that `cell` sets count as having values. `name`: the name of the file, which
    names a program that has no .PROGRAM heading."""
    inspector = Inspector(model, dialect, cell)
    return inspector.inspect(inspector.read(text, name))


Parts = tuple[parser.Placed, ...]


class Beside(Struct, frozen=True):
    """The contents of the other files in the name space of a file: `programs` by key, and their `sections` of
    variables. `first`: the keys of the programs in files that are loaded before it. `elsewhere`: the keys of programs
    in nearby files, which may be called although they are in another name space."""

    programs: Mapping[str, ast.Program] = NO_PROGRAMS
    sections: tuple[ast.Section, ...] = ()
    first: frozenset[str] = frozenset()
    elsewhere: Container[str] = frozenset()


ALONE = Beside()


def beside_each(files: Sequence[Parts]) -> Iterator[Beside]:
    """Yield, for each file of a name space, the contents of the other files."""
    programs = [{program.key: program for _, program in parser.programs_of(parts)} for parts in files]
    sections = [tuple(one.part.node for one in parts if isinstance(one.part.node, ast.Section)) for parts in files]
    first = frozenset[str]()
    for at in range(len(files)):
        others = {key: it for place, its in enumerate(programs) if place != at for key, it in its.items()}
        more = tuple(it for place, its in enumerate(sections) if place != at for it in its)
        yield Beside(others, more, first)
        first |= programs[at].keys()


class _Robot:
    """A robot that makes its engine only when more than the model is needed. Many files need no engine, and importing
    its modules takes a tenth of the time of `vrs check`."""

    def __init__(self, model: RobotModel) -> None:
        self.model = model

    @cached_property
    def engine(self) -> Engine:
        from vrs_cli.engine.engine import Engine

        return Engine(self.model)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the engine, which is made if necessary."""
        return getattr(self.engine, name)


_Basis = tuple[object, ...]


class _Inspected(Struct, frozen=True, eq=False):
    """The findings in one program. `basis`: all data outside the program on which the findings depend; they are valid
    while it stays equal. `of_running`: findings about steps that cannot be reached or that always fail."""

    basis: _Basis
    analysis: Analysis
    of_running: tuple[Diagnostic, ...]


class Inspector:
    """The checker of successive versions of one file. It keeps the findings for programs and sections that have not
    changed between two versions."""

    def __init__(
        self, model: RobotModel, dialect: Dialect = Dialect.VPLUS, cell: signals.Cell = signals.NO_CELL
    ) -> None:
        self._dialect, self._cell = dialect, cell
        self._robot, self._constants = _Robot(model), _constants(model)
        self._known: dict[tuple[str, ...], parser.Part] = {}
        self._inspected: dict[parser.Part, _Inspected] = {}
        self._motions: dict[parser.Part, tuple[_MotionTo, ...]] = {}

    def read(self, text: str, name: str = "") -> Parts:
        """Return the parts (programs and sections) of the current version of the file. `name`: the name of the file,
        which names a program that has no .PROGRAM heading."""
        parts = parser.parts_of(text, self._known, self._dialect, name)
        self._known = {placed.part.lines: placed.part for placed in parts}
        return parts

    def inspect(self, parts: Parts, beside: Beside = ALONE) -> tuple[Diagnostic, ...]:
        """Return all mistakes in the parts of a file. `beside`: the contents of the other files in its name space."""
        lines = tuple(line for placed in parts for line in placed.part.lines)
        foreign = parser.foreign_file("\n".join(lines))
        if foreign is not None and not parser.has_program("\n".join(lines)):
            return (foreign,)
        environment = Environment(units=self._robot.model.units)
        self._cell.fill(environment)
        for section in beside.sections:
            environment.take(variables_of(section, environment.units)[0])
        found = [] if foreign is None else [foreign]
        found += [one for placed in parts for one in placed.translate(placed.part.diagnostics)]
        found += parser.repeated_programs((program, placed.above) for placed, program in parser.programs_of(parts))
        found += [
            parser.duplicate_name(program, placed.above, parser.IN_ANOTHER_FILE)
            for placed, program in parser.programs_of(parts)
            if program.key in beside.first
        ]
        for placed in parts:
            if isinstance(placed.part.node, ast.Section):
                variables, refused = variables_of(placed.part.node, environment.units)
                environment.take(variables)
                found += placed.translate(refused)
        programs = {program.key: placed for placed, program in parser.programs_of(parts)}
        for placed, inspected in self._analyse_programs(environment, programs, beside):
            found += placed.translate((*inspected.analysis.diagnostics, *inspected.of_running))
        found += self._out_of_reach(environment, tuple(parser.programs_of(programs.values())), beside)
        idle = set[str]()
        for placed, program in parser.programs_of(programs.values()):
            found += placed.translate(_settings_of(program, idle))
        return parser.drop_suppressed(lines, in_order(found))

    # --- analysis ---

    def _analyse_programs(
        self, environment: Environment, programs: Mapping[str, parser.Placed], beside: Beside
    ) -> tuple[tuple[parser.Placed, _Inspected], ...]:
        trees = {**beside.programs, **{program.key: program for _, program in parser.programs_of(programs.values())}}
        around = analyzer.Surroundings(dict(environment.kinds), trees, beside.elsewhere)
        before, self._inspected = self._inspected, {}
        for key, placed in programs.items():
            if (one := before.get(placed.part)) is None or one.basis != _basis(around, one.analysis):
                analysis, of_running = analyzer.analyze_among(around, trees[key]), tuple[Diagnostic, ...]()
                if analysis.executable:
                    of_running = (*_warn_of_steps(analysis), *self._constants.findings(trees[key]))
                one = _Inspected(_basis(around, analysis), analysis, of_running)
            self._inspected[placed.part] = one
        return tuple((placed, self._inspected[placed.part]) for placed in programs.values())

    # --- reach ---

    def _out_of_reach(
        self, environment: Environment, programs: tuple[tuple[parser.Placed, ast.Program], ...], beside: Beside
    ) -> Iterator[Diagnostic]:
        """Yield a warning for each motion to a location that the robot cannot reach, if the file defines the location
        and no instruction changes it."""
        self._motions = {
            placed.part: self._motions.get(placed.part) or _motions(program) for placed, program in programs
        }
        others = tuple(beside.programs.values())
        if any(_CHANGES_FRAMES in motions for motions in (*self._motions.values(), *map(_motions, others))):
            return
        changed = frozenset[str]().union(
            *(analyzer.names_given_in(it) for it in (*others, *(it for _, it in programs)))
        )
        for placed, program in programs:
            own = changed | {parameter.key for parameter in program.parameters}
            motions = (motion for motion in self._motions[placed.part] if motion.key not in own)
            for target, refusal in ((motion.target, _refusal(motion, environment, self._robot)) for motion in motions):
                if refusal is not None:
                    named = f"{target.sigil}{target.name}: " if isinstance(target, ast.Variable) else ""
                    what = named + refusal.detail
                    yield from placed.translate(
                        [Diagnostic(Severity.WARNING, refusal.code, refusal.title, what, refusal.hint, target.span)]
                    )


def _basis(around: analyzer.Surroundings, analysis: Analysis) -> _Basis:
    """Return everything outside a program's text on which the findings in the program depend: the variables and
    programs that it uses."""
    programs = (around.programs.get(key) for key in sorted(analysis.calls))
    called = tuple(it and (it.name, tuple((one.sigil, one.name) for one in it.parameters)) for it in programs)
    names = around.program_keys if None in called else ()
    asked = analysis.needs | analysis.functions | analysis.alone
    elsewhere = frozenset(key for key in asked if around.given_elsewhere(key, analysis.program))
    near = frozenset(key for key in analysis.calls if key in around.elsewhere)
    named = frozenset(key for key in analysis.alone if around.named_elsewhere(key, analysis.program))
    return (
        around.known,
        called,
        names,
        near,
        elsewhere,
        named,
        around.given_keys if analysis.needs - elsewhere else None,
    )


# --- before a run ------------------------------------------------------------------------------------------------


def warnings_before_run(programs: Sequence[memory.StoredProgram], model: RobotModel) -> tuple[Diagnostic, ...]:
    """Return the warnings about steps that a run would skip or carry out without a message. Other findings are shown
    elsewhere: LOAD shows the warnings of the analysis, and the run reports failing steps and locations out of reach.
    `programs`: the programs of one file, without errors."""
    found, constants, idle = list[Diagnostic](), _constants(model), set[str]()
    for one in programs:
        found += _warn_of_steps(one.analysis)
        found += constants.above_full_speed(one.program)
        found += _settings_of(one.program, idle)
    return parser.drop_suppressed(programs[0].lines, in_order(found)) if found else ()


def _warn_of_steps(analysis: Analysis) -> Iterator[Diagnostic]:
    """Yield warnings about steps that cannot be reached, and about a DELAY that the author may have mistaken for a
    pause of the program."""
    yield from structure.unreachable(analysis.program, analysis.blocks, analysis.labels)
    yield from analyzer.delays(analysis.program)


def _constants(model: RobotModel) -> Constants:
    """Return an evaluator of constant expressions. The evaluator has its own robot, because evaluating an expression
    may change settings."""
    return Constants(memory.Context(Environment(units=model.units), cast("Engine", _Robot(model))))


# --- switches and parameters ------------------------------------------------------------------------------------


def _settings_of(program: ast.Program, idle: set[str]) -> Iterator[Diagnostic]:
    """Yield a warning at the first use of each switch and parameter that has no effect on a virtual robot. `idle`: the
    names that have already been reported; new ones are added."""
    named = (
        (word, settings.idle_of(_SETTING[it.word], word.text))
        for it in (step.statement for step in program.steps)
        if isinstance(it, ast.Instruction) and it.word in _SETTING
        for word in it.arguments
        if isinstance(word, ast.BareWord)
    )
    for word, row in named:
        if row is not None and row.name not in idle:
            idle.add(row.name)
            yield warning(WithoutEffect, word.span, f"{row.name}: {row.summary}", "it may be set and read")


_SETTING: Mapping[str, Mapping[str, settings.Idle]] = {
    **dict.fromkeys(("ENABLE", "DISABLE", "SWITCH"), settings.IDLE_SWITCHES),
    "PARAMETER": settings.IDLE_PARAMETERS,
}


# --- reach -----------------------------------------------------------------------------------------------------


class _MotionTo(Struct, frozen=True):
    """A motion to a location. `target`: the location; `distance`: how far in front of it the motion ends [m]."""

    target: ast.Variable | ast.Call
    distance: float

    @property
    def key(self) -> str:
        """The key of the variable that is the target; "" if numbers give the target."""
        return self.target.key if isinstance(self.target, ast.Variable) else ""


# stands for an instruction that changes TOOL or BASE
_CHANGES_FRAMES = _MotionTo(ast.Variable("", "", None, span=Span(0, 0, 0)), 0.0)


def _motions(program: ast.Program) -> tuple[_MotionTo, ...]:
    """Return the motions of a program to named locations, and to locations given by numbers."""
    return tuple(
        motion
        for step in program.steps
        if isinstance(step.statement, ast.Instruction) and (motion := _motion(step.statement)) is not None
    )


def _motion(statement: ast.Instruction) -> _MotionTo | None:
    if statement.word in CHANGING_FRAMES:
        return _CHANGES_FRAMES
    target, distance = (*statement.arguments, None, None)[:2]
    if isinstance(target, ast.Variable) or (isinstance(target, ast.Call) and _numbers(target) is not None):
        if statement.word in TO_PLACE:
            return _MotionTo(target, 0.0)
        if statement.word in IN_FRONT and isinstance(distance, ast.Number):
            return _MotionTo(target, distance.value / 1000.0)
    return None


def _numbers(place: ast.Call) -> tuple[float | None, ...] | None:
    """Return the arguments of a call of TRANS, #PPOINT or NULL if all are numbers; None if only a run can compute
    them."""
    numbers = tuple(map(ast.plain_number, place.arguments))
    missing = any(at is None and given is not None for at, given in zip(numbers, place.arguments, strict=True))
    return (
        None
        if place.name not in ("TRANS", "#PPOINT", "NULL") or missing or len(numbers) > parser.JOINTS_HIGH
        else numbers
    )


def _place_of_numbers(place: ast.Call, joint_count: int) -> transform.Transform | tuple[float, ...]:
    """Return the location that a call with numbers describes: a transformation, or joints for #PPOINT. Missing
    arguments have the default of TRANS or #PPOINT."""
    numbers = (*(_numbers(place) or ()), *(None,) * parser.JOINTS_HIGH)
    if place.name == "#PPOINT":
        return joints.TURNING.read(number or 0.0 for number in numbers[:joint_count])
    return operations.trans(*numbers[:6])


def _refusal(motion: _MotionTo, environment: Environment, robot: _Robot) -> MotionError | IllegalValue | None:
    """Return why no configuration of the arm reaches the location of a motion; None if a configuration reaches it, or
    if the value of the location is unknown."""
    target, distance, count = motion.target, motion.distance, robot.model.joint_count
    place = _value(environment, target) if isinstance(target, ast.Variable) else _place_of_numbers(target, count)
    try:
        if isinstance(place, transform.Transform):
            pose = transform.compose(place, transform.translation(0.0, 0.0, -distance))
            if not any(solution.usable for solution in robot.engine.arm.inverse_all(pose)):
                robot.engine.joints_for(pose)
        elif place is not None and not distance:
            targets.check_joint_limits(robot.model, place)
    except LocationOutOfRange as refusal:
        return targets.naming_null(refusal, place) if isinstance(place, transform.Transform) else refusal
    except (MotionError, IllegalValue) as refusal:
        return refusal
    return None


def _value(environment: Environment, target: ast.Variable) -> transform.Transform | tuple[float, ...] | None:
    numbers = [index.value for index in target.indexes or () if isinstance(index, ast.Number)]
    if target.indexes is not None and (not numbers or len(numbers) != len(target.indexes)):
        return None
    whole = tuple(map(round, numbers))
    index = None if not whole else whole[0] if len(whole) == 1 else whole
    reference = environment.reference(target.sigil + target.name, index)
    if not reference.has_value():
        return None
    value = reference.value()
    return None if isinstance(value, float | int | str) else value

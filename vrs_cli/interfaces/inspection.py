"""All that can be said of a program file without running it: `vrs check` and the language server ask here."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.targets import check_joint_limits
from vrs_cli.errors import EndOfInput, JointOutOfRange, MotionError
from vrs_cli.interfaces.replies import Reply
from vrs_cli.interfaces.session import Session
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, compose, translation
from vrs_cli.language import ast
from vrs_cli.language.analyzer import Analysis, names_given_by
from vrs_cli.language.diagnostics import Diagnostic, Severity
from vrs_cli.language.reachability import unreachable

# the motions whose first argument is where they go; those of the second row stop at a distance in front of it
TO_PLACE = frozenset({"MOVE", "MOVES", "MOVET", "MOVEST"})
IN_FRONT = frozenset({"APPRO", "APPROS"})
CHANGING_FRAMES = frozenset({"TOOL", "BASE"})  # with one of them in the file, nobody knows where a location is


class Nobody:
    """A terminal without a user: nothing is shown, nothing is answered."""

    def type(self, text: str, newline: bool) -> None:
        """Nothing."""

    def show(self, reply: Reply) -> None:
        """Nothing."""

    def ask(self, prompt: str) -> str:
        """Raises EndOfInput."""
        raise EndOfInput(f"PROMPT {prompt!r} has nothing to read")

    def confirm(self, question: str) -> bool:  # noqa: ARG002 (of the Terminal protocol)
        """No."""
        return False


def inspect(text: str, model: RobotModel) -> tuple[Diagnostic, ...]:
    """Everything that is wrong with a file by itself, as LOAD into an empty memory finds it; steps that nothing
    leads to; constant locations that this robot cannot reach. In the order of the lines.
    """
    session = Session(Nobody(), model)
    found = list(session.load_text(text))
    analyses = [stored.analysis for stored in session.environment.programs.values()]
    for analysis in analyses:
        if analysis.executable:
            found += unreachable(analysis.program, analysis.blocks, analysis.labels)
    found += _out_of_reach(session, analyses)
    return tuple(sorted(found, key=lambda one: (one.span.line, one.span.column)))


# --- reach -----------------------------------------------------------------------------------------------------


def _out_of_reach(session: Session, analyses: list[Analysis]) -> Iterator[Diagnostic]:
    """A warning at each motion to a location of the file that no instruction changes."""
    programs = [analysis.program for analysis in analyses]
    if any(_changes_frames(program) for program in programs):
        return
    changed = frozenset[str]().union(*map(names_given_by, programs))
    places = _Places(session)
    for program in programs:
        own = changed | {parameter.key for parameter in program.parameters}
        for step in program.steps:
            if isinstance(step.statement, ast.Instruction):
                yield from _unreached(step.statement, own, places)


def _changes_frames(program: ast.Program) -> bool:
    return any(
        isinstance(step.statement, ast.Instruction) and step.statement.word in CHANGING_FRAMES for step in program.steps
    )


def _unreached(statement: ast.Instruction, changed: frozenset[str], places: _Places) -> Iterator[Diagnostic]:
    target = statement.arguments[0] if statement.arguments else None
    distance = _distance(statement)
    if distance is None or not isinstance(target, ast.Variable) or target.key in changed:
        return
    refusal = places.refusal(target, distance)
    if refusal is not None:
        detail = f"{target.sigil}{target.name}: {refusal.detail}"
        yield Diagnostic(Severity.WARNING, refusal.code, _text(refusal), detail, refusal.hint, target.span)


def _text(refusal: MotionError) -> str:
    return f"Joint {refusal.joint} out of range" if isinstance(refusal, JointOutOfRange) else refusal.text


def _distance(statement: ast.Instruction) -> float | None:
    """How far in front of its location a motion ends [m]; None for what goes to no place that can be known."""
    if statement.word in TO_PLACE:
        return 0.0
    distance = statement.arguments[1] if statement.word in IN_FRONT and len(statement.arguments) > 1 else None
    return distance.value / 1000.0 if isinstance(distance, ast.Number) else None


@dataclass(frozen=True)
class _Places:
    """The locations that the file defines, and the arm that is to reach them."""

    session: Session

    def refusal(self, target: ast.Variable, distance: float) -> MotionError | None:
        """Why no configuration of the arm reaches a place; None where one does, or where it has no value."""
        place = self._value(target)
        engine = self.session.engine
        try:
            if isinstance(place, Transform):
                self._try(engine, compose(place, translation(0.0, 0.0, -distance)))
            elif place is not None and len(place) == engine.model.joint_count and not distance:
                check_joint_limits(engine.model, place)
        except MotionError as refusal:
            return refusal
        return None

    def _try(self, engine: Engine, T_world_tool: Transform) -> None:
        if not any(solution.usable for solution in engine.arm.inverse_all(T_world_tool)):
            engine.joints_for(T_world_tool)

    def _value(self, target: ast.Variable) -> Transform | tuple[float, ...] | None:
        numbers = [index.value for index in target.indexes or () if isinstance(index, ast.Number)]
        if target.indexes is not None and (not numbers or len(numbers) != len(target.indexes)):
            return None
        whole = tuple(map(round, numbers))
        index = None if not whole else whole[0] if len(whole) == 1 else whole
        reference = self.session.environment.reference(target.sigil + target.name, index)
        if not reference.defined():
            return None
        value = reference.value()
        return None if isinstance(value, float | int | str) else value

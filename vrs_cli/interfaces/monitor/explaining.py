"""EXPLAIN describes motions before they are made, locations, and the last change of the timeline. It changes nothing. A
separate engine (`Engine.aside`) plans the motion: the request goes through the same code as a real one, and only the
book of that engine keeps the result.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import cast

from msgspec.structs import replace

from vrs_cli.engine.book import displacement
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.explaining import inverse_report, motion_plan, splice
from vrs_cli.engine.targets import check_joint_count
from vrs_cli.errors import TypeMismatch, VrsError
from vrs_cli.interfaces.dialogue import Dialogue, beside
from vrs_cli.interfaces.station.operands import evaluator
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.performing import by_robot_clock
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import link_pose
from vrs_cli.kinematics.transform import IDENTITY, POLE, Transform, compose, inverse, oat_turns, to_oat
from vrs_cli.language.run.effects import Failed, ProgramCompleted
from vrs_cli.language.run.runtime import statement_task
from vrs_cli.language.text.ast import Binary, ExplainCommand, Expression, Show, Statement
from vrs_cli.language.text.printer import expression_text, statement_text
from vrs_cli.language.words.monitor import EXPLAINED_ALL
from vrs_cli.language.words.values import kind_of_value
from vrs_cli.values import results
from vrs_cli.values.commands import PoseTarget, Request
from vrs_cli.values.replies import Message


def explain(station: Station, it: ExplainCommand) -> Dialogue[None]:
    """Yield the explanation. Raises VrsError if a value is missing or of the wrong kind."""
    asked = it.statement
    if it.topic == "SPLICE":
        yield splice(station.engine.book)
    elif asked is None:
        yield results.ExplainOverview(tuple(results.Explainable(row.form, row.summary) for row in EXPLAINED_ALL))
    elif not isinstance(asked, Show):
        yield (yield from _motion(station, asked))
    elif it.topic == "OAT":
        yield _angles(expression_text(asked.expression), _pose(station, asked.expression, "OAT"))
    elif it.topic == "IK":
        yield (yield from _inverse(station, asked.expression))
    else:
        yield _chain(station, asked.expression)


# --- a motion --------------------------------------------------------------------------------------------------------


def _motion(station: Station, statement: Statement) -> Dialogue[results.MotionReport | Message]:
    engine, text = station.engine, statement_text(statement)
    aside, before = engine.aside(), engine.timeline
    requests = tuple(_requests(station, aside, statement))
    notes = list[str]()
    aside.postponed.append(lambda one: notes.append(one.sentence))

    def plan_motion() -> results.MotionPlan | None:
        for request in requests:
            aside.begin(by_robot_clock(request, station.user_state.times), program=False)
        deltas = aside.book.deltas
        return motion_plan(engine.arm, before, deltas[-1]) if len(deltas) else None

    try:
        plan = yield from beside(plan_motion)
        if plan is None:
            return Message(f"{text} moves nothing")
        delta = aside.book.deltas[-1]
        if engine.settings.switch("COLLISION"):
            station.contacts.check(before, delta, engine.settings)
        contact, later = station.contacts.of_change(before, delta, engine.settings)
    except VrsError as error:
        return results.MotionReport(text, engine.now, None, str(error), station.units)
    if contact is not None:
        notes.append(f"{contact.describe()}{later}")
    plan = replace(plan, displaced=displacement(aside.book, before), contact=contact, notes=tuple(notes))
    return results.MotionReport(text, engine.now, plan, units=station.units)


def _requests(station: Station, aside: Engine, statement: Statement) -> Iterator[Request]:
    """Yield the requests of a motion instruction. Raises VrsError for arguments without a value."""
    memory = station.environment
    # restored afterwards: the motion itself must get the same random numbers
    kept = memory.random.getstate(), memory.last_error
    try:
        task = statement_task(memory, aside, statement)
        event = task.resume()
        while not isinstance(event, ProgramCompleted):
            if isinstance(event, Failed):
                raise event.error
            if isinstance(event, Request):
                yield event
            event = task.resume()
    finally:
        memory.random.setstate(kept[0])
        memory.last_error = kept[1]


# --- locations -------------------------------------------------------------------------------------------------------


def _pose(station: Station, expression: Expression, topic: str) -> Transform:
    """Return the value of an expression, a transformation. Raises TypeMismatch for any other value."""
    found = evaluator(station, expression)()
    if isinstance(found, Transform):
        return found
    text, kind = expression_text(expression), kind_of_value(found).value
    raise TypeMismatch(f"{text} is a {kind}", f"EXPLAIN {topic} explains a transformation, as TRANS or a compound")


def _angles(text: str, T: Transform) -> results.AnglesReport:
    angles = to_oat(T)
    return results.AnglesReport(text, T, angles, oat_turns(*angles), vertical=T.ax * T.ax + T.ay * T.ay < POLE * POLE)


def _inverse(station: Station, expression: Expression) -> Dialogue[results.InverseReport]:
    T, stand, text = _pose(station, expression, "IK"), station.engine.standpoint, expression_text(expression)
    return (yield from beside(lambda: inverse_report(stand, PoseTarget(T), text)))


def _chain(station: Station, expression: Expression) -> results.ChainReport:
    engine, text = station.engine, expression_text(expression)
    found, frames = evaluator(station, expression)(), engine.frames
    if not isinstance(found, tuple):
        raise TypeMismatch(f"{text} is a {kind_of_value(found).value}", "EXPLAIN explains a location, or a motion")
    if not isinstance(found, Transform):
        check_joint_count(engine.model, found)
        return results.ChainReport(text, _links(engine, found), (), found, station.units)
    named = ((expression_text(part), cast(Transform, evaluator(station, part)())) for part in _factors(expression))
    factors = _multiply("world", [(name, name, T) for name, T in named])
    goal = ("BASE", "world", frames.base), (text, "tool", found), ("TOOL^-1", "flange", inverse(frames.tool))
    return results.ChainReport(text, factors, _multiply("robot", goal), units=station.units)


def _factors(expression: Expression) -> Iterator[Expression]:
    """Yield the factors of a compound transformation, from the left."""
    if isinstance(expression, Binary) and expression.operator == ":":
        yield from _factors(expression.left)
        yield from _factors(expression.right)
    else:
        yield expression


def _multiply(outer: str, parts: Sequence[tuple[str, str, Transform]]) -> tuple[results.Factor, ...]:
    """Return factors with their products, each from the frame before it: name, inner frame, and transformation."""
    product, found = IDENTITY, list[results.Factor]()
    for name, inner, T in parts:
        product = compose(product, T) if found else T
        found.append(results.Factor(name, outer, inner, T, product))
        outer = inner
    return tuple(found)


def _links(engine: Engine, q: Joints) -> tuple[results.Factor, ...]:
    """Return the transformations of the links of the arm at these joints, with BASE before and TOOL after them."""
    frames, model, count = engine.frames, engine.model, len(q)
    links = [(f"A{i}", f"frame {i}" if i < count else "flange", link_pose(model, i, x)) for i, x in enumerate(q, 1)]
    base = [("base of the arm", "frame 0", model.base)] if model.base != IDENTITY else []
    return _multiply(
        "world", [("BASE^-1", "robot", inverse(frames.base)), *base, *links, ("TOOL", "tool", frames.tool)]
    )

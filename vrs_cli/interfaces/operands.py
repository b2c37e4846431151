"""Operands of monitor commands: expressions, as they are typed at the prompt."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vrs_cli.errors import TypeMismatch
from vrs_cli.language.ast import Expression
from vrs_cli.language.values import Value, kind_of_value

if TYPE_CHECKING:
    from vrs_cli.interfaces.session import Session


def value(session: Session, expression: Expression) -> Value:
    """What an expression is now. Raises ProgramError."""
    from vrs_cli.language.prompt import evaluate

    return evaluate(session.environment, session.robot, expression)


def real(session: Session, expression: Expression) -> float:
    """A real. Raises TypeMismatch for another kind of value."""
    found = value(session, expression)
    if not isinstance(found, float):
        raise TypeMismatch(f"a {kind_of_value(found).value}", "a real is wanted here")
    return found

"""Who may say what, and when: the role that a line needs, and what goes beside a program, from the tables of words."""

from __future__ import annotations

from vrs_cli.errors import RoleWanted, UsageError
from vrs_cli.language.text.ast import Assignment, DoInstruction, Instruction, Show, Statement
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import BESIDE, COMMANDS
from vrs_cli.language.words.word import Role


def check_role(statement: Statement, role: Role) -> None:
    """Raises RoleWanted, which names the word, for a line that its sender may not send."""
    said, wanted = _needed(statement)
    if wanted not in role:
        raise RoleWanted(f"{said} is for {wanted.spoken}", f"you are {role.spoken}")


def check_beside(statement: Statement) -> None:
    """Raises UsageError for a line that waits until the robot program has stopped."""
    said, role = _needed(statement)
    if not (isinstance(_inner(statement), Assignment) or said in BESIDE or role is Role.OBSERVER):
        raise UsageError(f"{said} has to wait until the program stops", "ABORT stops it")


def _needed(statement: Statement) -> tuple[str, Role]:
    """What a line is called, and the role that it needs."""
    statement = _inner(statement)
    if isinstance(statement, Show):
        return "a look at a value", Role.OBSERVER
    if isinstance(statement, Instruction):
        row = COMMANDS.get(statement.word) or INSTRUCTIONS[statement.word]
        return statement.word, row.role
    return "a change of a variable or a program", Role.SUPERVISOR


def _inner(statement: Statement) -> Statement:
    """What DO does."""
    return statement.statement or statement if isinstance(statement, DoInstruction) else statement

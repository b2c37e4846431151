"""The rights of users: the role that a line needs, and what goes beside a program, from the tables of words."""

from __future__ import annotations

from vrs_cli.errors import RoleWanted, UsageError
from vrs_cli.language.text.ast import Assignment, DoInstruction, ExplainCommand, Instruction, Show, Statement
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import BESIDE, COMMANDS, ON_BRANCH
from vrs_cli.language.words.word import Role

CHANGE = "a change of a variable"
STOPPING = ("ABORT",)  # commands that overtake all others


def check_may(said: str, wanted: Role, role: Role) -> None:
    """Check that a role includes the one that is wanted. Raises RoleWanted."""
    if wanted not in role:
        raise RoleWanted(f"{said} is for {wanted.title_with_article}", f"you are {role.title_with_article}")


def may_all(said: str, wanted: Role) -> bool:
    """Return whether users who do not drive may do it too: look, and stop."""
    return wanted is Role.OBSERVER or said in STOPPING


def must_drive(said: str, wanted: Role, role: Role) -> bool:
    """Return whether only the user who drives may do it. Everybody may look, and a supervisor may stop every other
    user.
    """
    return not may_all(said, wanted) or (said in STOPPING and Role.SUPERVISOR not in role)


def check_beside(statement: Statement, *, elsewhere: bool) -> None:
    """Check that a line need not wait until the program stops. `elsewhere`: the program runs on another branch than
    that of the user. Raises UsageError.
    """
    said, role = need_of(statement)
    check_goes_beside(CHANGE if isinstance(_inner(statement), Assignment) else said, role, elsewhere=elsewhere)


def check_goes_beside(said: str, role: Role, *, elsewhere: bool) -> None:
    """Check that a request of this name and role need not wait until the program stops. Raises UsageError."""
    if elsewhere and said in ON_BRANCH:
        raise UsageError(f"{said} has to wait until the program on another branch stops", "{ABORT} stops it")
    if not (said == CHANGE or said in BESIDE or role is Role.OBSERVER):
        raise UsageError(f"{said} has to wait until the program stops", "{ABORT} stops it")


def role_of(word: str) -> Role:
    """Return the role that a word needs."""
    return (COMMANDS.get(word) or INSTRUCTIONS[word]).role


def need_of(statement: Statement) -> tuple[str, Role]:
    """Return the name of a line in messages, and the role that it needs."""
    statement = _inner(statement)
    if isinstance(statement, Show):
        return "a look at a value", Role.OBSERVER
    if isinstance(statement, ExplainCommand):
        return "EXPLAIN", role_of("EXPLAIN")
    if isinstance(statement, Instruction):
        return statement.word, role_of(statement.word)
    return "a change of a variable or a program", Role.SUPERVISOR


def _inner(statement: Statement) -> Statement:
    """Return the statement that DO carries out."""
    return statement.statement or statement if isinstance(statement, DoInstruction) else statement

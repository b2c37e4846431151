"""Which requests may change the timeline of the robot that they are for, as whoever sends them knows them. Pure."""

from __future__ import annotations

from vrs_cli.interfaces.rights import needed
from vrs_cli.language.text.ast import ProgramHeader
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.net.messages import Abort, At, Line, Request
from vrs_cli.values.acts import Execute, Redo, Say, Undo
from vrs_cli.values.diagnostics import LineRefused

CHANGING = frozenset(  # words of the monitor, beside all motions
    ("ABORT", "BRANCH", "COMMANDS", "EXECUTE", "LOAD", "MERGE", "NEXT", "PROCEED", "REDO", "RETRY", "UNDO", "XSTEP")
)


def changing(request: Request) -> str | None:
    """What is asked for, as it would be typed; None for what moves nothing."""
    match request:
        case Line(text=text) | At(act=Say(line=text)):
            return text.strip() if _moves(text) else None
        case At(act=Undo()):
            return "UNDO"
        case At(act=Redo()):
            return "REDO"
        case At(act=Execute(program)):
            return f"EXECUTE {program}"
        case Abort():
            return "ABORT"
    return None


def _moves(text: str) -> bool:
    """Whether a line may move the robot; of a text that was pasted, its first one."""
    try:
        statement = parse_prompt(text.strip().partition("\n")[0])
    except LineRefused:
        return False
    if statement is None or isinstance(statement, ProgramHeader):
        return False
    word, role = needed(statement)
    return role is Role.DESIGNER or word in CHANGING

"""What whoever types does that is no line, as values: they go over a connection as lines do."""

from __future__ import annotations

from vrs_cli.dialogue.spoken import Act
from vrs_cli.interfaces.editor.screen import Findings, KeepDraft, Kept, ReadDraft
from vrs_cli.interfaces.jog.jogger import Brake, Look, Press, Seen


class Attend(Act[None], frozen=True):
    """Put the questions that programs have to whoever types."""


class LeaveEntry(Act[None], frozen=True):
    """What is typed of a program is forgotten; `why` is said of it."""

    why: str = ""


class StopProgram(Act[None], frozen=True):
    """Stop the program that runs beside an empty line."""


DeskAct = Attend | LeaveEntry | StopProgram | ReadDraft | KeepDraft | Press | Brake | Look
DeskFound = Findings | Kept | Seen

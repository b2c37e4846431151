"""The monitor commands: who carries out which, from a checked instruction to replies. Nothing is printed here.

One that asks questions between its replies is a generator: each reply is shown before the next question.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from vrs_cli.dialogue.replies import Reply
from vrs_cli.interfaces.jog.jogger import jog
from vrs_cli.interfaces.monitor.clock import clock
from vrs_cli.interfaces.monitor.consent import leaving
from vrs_cli.interfaces.monitor.files import FILES
from vrs_cli.interfaces.monitor.locations import LOCATIONS
from vrs_cli.interfaces.monitor.operands import Handler
from vrs_cli.interfaces.monitor.programs import PROGRAMS
from vrs_cli.interfaces.monitor.running import RUNNING
from vrs_cli.interfaces.monitor.settings import SETTINGS
from vrs_cli.interfaces.monitor.state import STATE
from vrs_cli.interfaces.monitor.stepping import STEPPING
from vrs_cli.interfaces.monitor.timeline import TIMELINE
from vrs_cli.interfaces.monitor.variables import VARIABLES
from vrs_cli.language.text.ast import Instruction

if TYPE_CHECKING:
    from vrs_cli.interfaces.session.session import Session


def _leave(session: Session, _it: Instruction) -> Iterator[Reply]:
    yield from leaving(session)


MONITOR: Mapping[str, Handler] = {
    **LOCATIONS,
    **VARIABLES,
    **PROGRAMS,
    **FILES,
    **RUNNING,
    **STEPPING,
    **SETTINGS,
    **STATE,
    **TIMELINE,
    "CLOCK": clock,
    "JOG": jog,
    "EXIT": _leave,
    "QUIT": _leave,
}

"""Who carries out which instruction: functions from evaluated operands to what the program asks for.

What needs neither robot nor terminal (variables, signals, timers) an instruction does by itself, at its own instant of
the program.
"""

from __future__ import annotations

from collections.abc import Mapping

from vrs_cli.language.run.operands import Handler
from vrs_cli.language.run.semantics.assignments import ASSIGNMENTS
from vrs_cli.language.run.semantics.input_output import INPUT_OUTPUT
from vrs_cli.language.run.semantics.motions import MOTIONS
from vrs_cli.language.run.semantics.settings import SETTINGS
from vrs_cli.language.run.semantics.signals import SIGNALS
from vrs_cli.language.run.semantics.tasks import TASKS

HANDLERS: Mapping[str, Handler] = {**MOTIONS, **SETTINGS, **ASSIGNMENTS, **SIGNALS, **INPUT_OUTPUT, **TASKS}

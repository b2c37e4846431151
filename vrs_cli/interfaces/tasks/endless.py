"""Waits that nothing can end. In virtual time nobody comes in between: where all tasks wait for what none of them, no
input to come and no clock changes, time would pass for ever.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from vrs_cli.errors import EndlessWait, VrsError
from vrs_cli.interfaces.tasks.tasks import Track
from vrs_cli.language.run.effects import AttachRobot, Wait, WaitEvent
from vrs_cli.language.text.ast import Call, Expression, Instruction, channel, nodes, plain_number
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.functions import BY_TIME
from vrs_cli.language.words.values import INPUTS

UNTIMED = (Wait, WaitEvent, AttachRobot)  # what may be waited for in vain


def in_vain(tracks: Iterable[Track], now: float) -> bool:
    """Return whether all of them wait for what stays as it is while time goes on."""
    return all(track.wake > now and not track.reacts and _stays(track) for track in tracks)


def _stays(track: Track) -> bool:
    pending = track.pending
    if isinstance(pending, Wait):
        condition = _condition(track)
        changes = any(isinstance(node, Call) and node.name in BY_TIME for node in nodes(condition))
        return condition is not None and not changes and not _holds(pending)
    return isinstance(pending, AttachRobot) or (isinstance(pending, WaitEvent) and pending.seconds is None)


def _condition(track: Track) -> Expression | None:
    """Return the condition of the WAIT that a task stands at."""
    it = track.task.statement
    return it.arguments[0] if isinstance(it, Instruction) and it.word == "WAIT" and it.arguments else None


def _holds(wait: Wait) -> bool:
    try:
        return wait.condition()
    except VrsError:  # the task is told of it when it looks
        return True


def endless(track: Track, help_: str, said: Callable[[str], str] = str) -> EndlessWait:
    """The error for a task that waits in vain. `help_`: what lets an input change here; "" at a prompt, where SIGNAL
    does, and RETRY goes on. `said`: a condition with the names of its signals."""
    if isinstance(track.pending, AttachRobot):
        return EndlessWait("waits for the robot, which another task keeps", "DETACH there, or ABORT it")
    if isinstance(track.pending, WaitEvent):
        return EndlessWait("waits for its event, which no task here sets", "SET.EVENT of another task sets it")
    condition = _condition(track)
    signal = _signal(condition)
    what = "makes true" if signal is None else "turns on" if signal > 0 else "turns off"
    change = "change that" if signal is None else f"SIGNAL {signal}"
    hint = f"{change} first" if track.at_prompt else f"{change}, then RETRY"
    if help_:
        hint = help_ if signal is not None and abs(signal) in INPUTS else ""
    awaited = "" if condition is None else said(expression_text(condition))
    return EndlessWait(f"waits for {awaited}, which nothing here {what}", hint)


def _signal(condition: Expression | None) -> int | None:
    """The one signal that is waited for: WAIT SIG(1003), or WAIT 3 as in VAL."""
    if condition is not None and (asked := channel(condition)) is not None:
        return asked
    if not isinstance(condition, Call) or condition.name != "SIG" or len(condition.arguments) != 1:
        return None
    number = plain_number(condition.arguments[0])
    return None if number is None else round(number)

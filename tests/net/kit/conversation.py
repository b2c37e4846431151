"""A conversation of a client with a robot: what comes to the client, what it has to send, and what it has to
know then. docs/protocol.md describes the steps.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterator, Mapping
from math import isfinite
from typing import Any

import msgspec

FORMAT = "vrs kit 1"
PASSED_OVER = ("ping",)  # messages that a client may send at any time

Step = dict[str, Any]
Message = dict[str, Any]
Client = Callable[[Step], Mapping[str, Any]]  # takes a step, and answers what it sends and what it was asked


class Conversation(msgspec.Struct, frozen=True):
    """`needs`: what a client has to compute beside the connection."""

    name: str
    about: str
    needs: tuple[str, ...]
    steps: tuple[Step, ...]
    format: str = FORMAT

    def to_json(self) -> str:
        """One step a line, so that a difference can be read."""
        head = {"format": self.format, "name": self.name, "about": self.about, "needs": self.needs}
        steps = ",\n".join(json.dumps(step, ensure_ascii=False, separators=(",", ":")) for step in self.steps)
        return f'{json.dumps(head, ensure_ascii=False)[:-1]}, "steps": [\n{steps}\n]}}\n'


def faults(conversation: Conversation, client: Client) -> Iterator[str]:
    """Yield what a client does otherwise than it should; nothing where it passes. After a wrong message it ends."""
    names: dict[str, int] = {}  # the numbers that the client has chosen
    sent: list[Message] = []
    for number, step in enumerate(conversation.steps, 1):
        where = f"{conversation.name}, step {number}"
        if (pattern := step.get("sent")) is not None:
            while sent and sent[0].get("type") in PASSED_OVER and pattern.get("type") not in PASSED_OVER:
                del sent[0]
            if not sent:
                yield f"{where}: the client has to send {_short(pattern)}, and sends nothing"
                return
            wrong = _difference(pattern, sent.pop(0), names)
            if wrong:
                yield f"{where}: {wrong}"
                return
            continue
        kind = next(iter(step))
        unasked = [one for one in sent if one.get("type") not in PASSED_OVER]
        if unasked:
            yield f"{where}: the client sends {_short(unasked[0])}, which nobody expects"
            return
        if "as" in step:
            names.pop(step["as"], None)
        try:
            answer = client(_asked(step, names))
            sent += [_message(one) for one in answer.get("send", ())]
            wrong = _compared(kind, step[kind], answer.get(kind), names)
        except (KeyError, TypeError, ValueError, AttributeError, msgspec.MsgspecError) as error:
            yield f"{where}: the answer of the client cannot be read: {error!r}"
            return
        if wrong:
            yield f"{where}: {wrong}"


EXPECTED = {
    "joints": "joints",
    "tools": "tools",
    "values": "values",
    "now": "now",
}  # left out of what the client is asked


def _asked(step: Step, names: Mapping[str, int]) -> Step:
    """What the client gets of a step: numbers in place of names, without what is expected of it."""
    kind = next(iter(step))
    if kind == "received" and step.get("binary"):
        return {kind: {"base64": base64.b64encode(msgspec.msgpack.encode(_filled(step[kind], names))).decode()}}
    if kind == "received":
        return {kind: _filled(step[kind], names)}
    if kind in EXPECTED:
        return {kind: {key: value for key, value in step[kind].items() if key not in (EXPECTED[kind], "within")}}
    if kind in ("ends", "asked"):
        return {kind: True}
    return {kind: step[kind]}


def _compared(kind: str, wanted: Any, found: Any, names: Mapping[str, int]) -> str:
    """Compare the answer to a question; return what is wrong, or nothing."""
    if kind == "ends":
        known = {name: found.get(str(names[name])) for name in wanted}
        return "" if known == wanted else f"commands have ended as {wanted}, the client says {known}"
    if kind == "asked":
        return "" if sorted(found) == sorted(wanted) else f"the questions {wanted} are open, the client says {found}"
    if kind not in EXPECTED:
        return ""
    times = wanted.get("times", wanted.get("walls"))
    for t, expected, given in zip(times, wanted[EXPECTED[kind]], found, strict=True):
        rows = (expected, given) if isinstance(expected, list) else ([expected], [given])
        far = max(abs(b - a) if isfinite(b) else float("inf") for a, b in zip(*rows, strict=True))
        if far > wanted["within"]:
            return f"{kind} at {t!r} are {expected}, the client says {given}: {far:g} off, at most {wanted['within']:g}"
    return ""


def _message(one: Message) -> Message:
    message = msgspec.msgpack.decode(base64.b64decode(one["base64"])) if "base64" in one else one
    if not isinstance(message, dict):
        raise TypeError("a message is an object")
    return message


def _filled(value: Any, names: Mapping[str, int]) -> Any:
    """Put numbers in the place of names."""
    if isinstance(value, str) and value.startswith("$"):
        return names[value[1:]]
    if isinstance(value, dict):
        return {key: _filled(one, names) for key, one in value.items()}
    return [_filled(one, names) for one in value] if isinstance(value, list) else value


def _difference(pattern: Any, found: Any, names: dict[str, int], at: str = "the message") -> str:
    """Return how a message differs from what is wanted, or nothing. A new name takes the number that it meets."""
    if isinstance(pattern, dict) and isinstance(found, dict):
        for key, one in pattern.items():
            if one is None and found.get(key) is None:
                continue
            if key not in found:
                return f"{at} has no {key!r}: {_short(found)}"
            if wrong := _difference(one, found[key], names, f"{key!r} of {at}"):
                return wrong
        return ""
    if isinstance(pattern, list) and isinstance(found, list) and len(pattern) == len(found):
        return next(filter(None, (_difference(a, b, names, at) for a, b in zip(pattern, found, strict=True))), "")
    if isinstance(pattern, str) and pattern.startswith("$"):
        if type(found) is not int:
            return f"{at} is {_short(found)}, not a whole number"
        pattern = names.setdefault(pattern[1:], found)
    return "" if pattern == found else f"{at} is {_short(found)}, not {_short(pattern)}"


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 200 else f"{text[:200]}..."

"""Our own client passes the conformance kit, and clients that are wrong do not."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import pytest

from tests.net.kit.conversation import Conversation, Message, Step, faults
from tests.net.kit.conversations import conversations
from tests.net.kit.reference import Reference

ROBOTS = ("puma560", "cobra600", "planar2", "planar3", "panda", "so100")
NAMES = (
    *("commands", "later-server", "resumed", "lost", "forgotten", "after", "questions", "clock", "body"),
    *("window", "older", "gap", "branches", "msgpack", "steered-lspb", "steered-scurve", "steered-full"),
    *(name for robot in ROBOTS for name in (robot, f"{robot}-pieces")),
)
EXAMPLE = Path(__file__).parents[2] / "examples" / "client" / "client.py"


@cache
def recorded() -> dict[str, Conversation]:
    """Return all conversations by their names. Recording takes two seconds, so the collection of tests does without."""
    return {one.name: one for one in conversations()}


@pytest.mark.parametrize("name", NAMES)
def test_our_own_client_passes(name: str) -> None:
    assert list(faults(recorded()[name], Reference())) == []


@pytest.mark.long
def test_a_client_written_from_the_docs_alone_passes() -> None:
    """Without the laws of S-curves, the rule of steady arms and MessagePack, which it does not know."""
    options = "--without", "scurve,steady,msgpack"
    command = [sys.executable, "-m", "tests.net.kit", "run", *options, sys.executable, str(EXAMPLE)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert len(ran.stdout.splitlines()) == len(
        [one for one in recorded().values() if not {"scurve", "steady", "msgpack"} & {*one.needs}]
    )
    assert "import vrs" not in EXAMPLE.read_text()


def test_the_recordings_are_the_same_each_time() -> None:
    assert tuple(recorded()) == NAMES
    assert [one.to_json() for one in conversations()] == [one.to_json() for one in recorded().values()]
    for one in recorded().values():
        assert msgspec.json.decode(one.to_json(), type=Conversation).steps == one.steps


class Wrong(Reference):
    """Our client with a fault."""

    def __init__(self, fault: Callable[[Step], Step | None], answers: Callable[[Message], None]) -> None:
        super().__init__()
        self._fault, self._changed = fault, answers

    def __call__(self, step: Step) -> Message:
        heard = self._fault(step)
        answer = {"send": []} if heard is None else super().__call__(heard)
        self._changed(answer)
        return answer


def without_shift(step: Step) -> Step:
    """Parts behind a change do not move."""
    delta = step["received"].get("delta", {}) if isinstance(step.get("received"), dict) else {}
    return {"received": {**step["received"], "delta": {**delta, "shift": 0.0}}} if delta.get("shift") else step


def without_events(step: Step) -> Step:
    """Events stay as they were in the snapshot."""
    delta = step["received"].get("delta", {}) if isinstance(step.get("received"), dict) else {}
    return {"received": {**step["received"], "delta": {**delta, "events": None}}} if "events" in delta else step


def forget_fates(step: Step) -> Step:
    return {"received": {**step["received"], "fates": []}} if "fates" in step.get("received", ()) else step


def answer_nothing(_step: Step) -> Step | None:
    return None


def ask_for_more(answer: Message) -> None:
    answer["send"] += [{"type": "who", "id": 77}]


def joints_are_off(answer: Message) -> None:
    for row in answer.get("joints") or ():
        row[0] += 2e-3


def no_resume(answer: Message) -> None:
    for one in answer["send"]:
        one.pop("resume", None)


def as_it_is(value: Any) -> Any:
    return value


@pytest.mark.parametrize(
    ("name", "fault", "answers", "told"),
    [
        ("puma560", without_shift, as_it_is, "joints at"),
        ("puma560", without_events, as_it_is, "values at"),
        ("resumed", forget_fates, as_it_is, "commands have ended as"),
        ("clock", answer_nothing, as_it_is, "and sends nothing"),
        ("gap", as_it_is, ask_for_more, "the client sends"),
        ("so100-pieces", as_it_is, joints_are_off, "0.002 off, at most 0.001"),
        ("after", as_it_is, no_resume, "has no 'resume'"),
        ("lost", as_it_is, lambda answer: answer.pop("send"), "and sends nothing"),
    ],
)
def test_a_client_with_a_fault_fails(name: str, fault: Any, answers: Any, told: str) -> None:
    wrong = list(faults(recorded()[name], Wrong(fault, answers)))
    assert wrong
    assert told in wrong[0]

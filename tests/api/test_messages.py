"""Test that errors in Python name methods instead of words of the shell, here and at a served robot."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import vrs_cli as vrs
from tests.net.serving import serving
from vrs_cli import errors
from vrs_cli.errors import METHODS, LeaseHeld, NotPossible, PowerOff, UsageError
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS

New = Callable[[], vrs.Robot]
DOWN = (0, -45, 180, 0, 45, 0)
PART = vrs.trans(300, 450, -200, 90, 90, 0)
FAR = vrs.trans(2000, 0, 0, 90, 90, 0)
PICK = "programs/pick_and_place.v2"
OF_PROGRAMS = {  # messages about the text of a program
    "a program with mistakes",
    "a question without an answer",
    "an argument that is left out",
}
WORDS = COMMANDS.keys() | INSTRUCTIONS.keys()


def after(r: vrs.Robot, *lines: str) -> vrs.Robot:
    for line in lines:
        r.do(line)
    return r


def paused(r: vrs.Robot) -> vrs.Robot:
    r.define(".PROGRAM stops()\n PAUSE\n.END")
    r.execute("stops", check=False)
    return r


def tried(r: vrs.Robot, name: str) -> vrs.Robot:
    with r.what_if(name):
        r.move(PART)
    return r


def asking(r: vrs.Robot) -> vrs.Robot:
    r.define('.PROGRAM asks()\n PROMPT "How many? ", n\n.END')
    return r


def wants(r: vrs.Robot) -> vrs.Robot:
    r.define(".PROGRAM twice(x)\n y = 2*x\n.END")
    return r


MISTAKES: dict[str, Callable[[vrs.Robot], object]] = {
    "joint out of range": lambda r: r.move(200, 0, 0, 0, 0, 0),
    "location too far": lambda r: r.move(FAR),
    "line too far": lambda r: r.moves(FAR),
    "line past the wrist": lambda r: r.move(PART).moves(vrs.trans(-300, -450, -200, 90, 90, 0)),
    "line out of READY": lambda r: r.moves(vrs.trans(0, 149, 900, 90, -90, 0)),
    "time before the beginning": lambda r: r.move(PART, at=-1),
    "location too far, in the middle": lambda r: r.move(PART).move(FAR, at=0.3),
    "no power": lambda r: after(r, "DISABLE POWER").move(PART),
    "no power to steer": lambda r: after(r, "DISABLE POWER").steer(*DOWN),
    "no power to drag": lambda r: after(r, "DISABLE POWER").drag(PART),
    "steers out of range": lambda r: r.steer(200, 0, 0, 0, 0, 0),
    "speed 0": lambda r: setattr(r, "speed", 0),
    "speed beyond": lambda r: setattr(r, "speed", 1000),
    "undo of nothing": lambda r: r.undo(),
    "undo of too many": lambda r: r.move(PART).undo(5),
    "redo of nothing": lambda r: r.redo(),
    "redo of too many": lambda r: r.move(PART).undo().redo(3),
    "merge of no branch": lambda r: r.merge("none"),
    "merge of main": lambda r: r.merge("main"),
    "comparison of no branches": lambda r: r.compare("a", "b"),
    "merge of what was undone": lambda r: tried(r.move(PART), "x").move(PART).merge("x") and r.undo(9),
    "a program that is not there": lambda r: r.execute("none"),
    "a program of a file that is not there": lambda r: r.run(PICK, "none"),
    "a file that is not there": lambda r: r.run("none.v2"),
    "a program with mistakes": lambda r: r.define(".PROGRAM a()\n MOVEE b\n.END"),
    "a text that is no program": lambda r: r.define("hello"),
    "a program that is paused": lambda r: paused(r).define(".PROGRAM stops()\n TYPE 1\n.END"),
    "a question without an answer": lambda r: asking(r).execute("asks"),
    "an argument that is left out": lambda r: wants(r).execute("twice"),
    "an undefined variable": lambda r: r["nothing"],
    "a command as an expression": lambda r: r["MOVE part"],
    "an assignment to a sum": lambda r: r.__setitem__("a+1", 3),
    "a text for a number": lambda r: r.__setitem__("a", "text"),
    "a location for joints": lambda r: r.__setitem__("#a", PART),
    "a curve that is none": lambda r: r.move(PART).plot("foo"),
    "two scales": lambda r: r.move(PART).plot("velocity", "tool"),
    "a joint of the tool": lambda r: r.move(PART).plot("tool", 1),
    "a joint that is none": lambda r: r.move(PART).plot(9),
    "no motion to plot": lambda r: r.plot(),
    "no measured robot": lambda r: r.resync(),
    "samples that have passed": lambda r: r.follow([-2.0, -1.0], [DOWN, DOWN]),
    "samples in disorder": lambda r: r.follow([1.0, 0.5], [DOWN, DOWN]),
    "a folder that is not there": lambda r: r.save("/none/of/these.vrst"),
    "a rate of nothing": lambda r: next(r.watch(0)),
    "no file of a trajectory": lambda _: vrs.load("none.vrst"),
    "another file": lambda _: vrs.load(PICK),
    "no robot": lambda _: vrs.Robot("pumma"),
    "no start": lambda _: vrs.Robot(start=[200, 0, 0, 0, 0, 0]),
    "no address": lambda _: vrs.connect("http://example"),
    "signals that are none": lambda _: vrs.Robot(signals=[(0.5, 99999, True)]),
    "motors that are none": lambda _: vrs.LeRobotArm(vrs.Robot()),
}


def shell_words(message: str) -> set[str]:
    """Return words of the shell in the hint of a message, except those inside a call of `do`."""
    hint = message.rpartition(" (")[2] if message.endswith(")") else ""
    hint = re.sub(r"do\((['\"]).*?\1\)", "", message[message.find(hint) :] if hint else "")
    return set(re.findall(r"\b[A-Z]{2,}\b", hint)) & WORDS


@pytest.mark.parametrize("what", MISTAKES)
def test_no_word_of_the_shell_is_advised(what: str, new: New) -> None:
    with pytest.raises((vrs.VrsError, ValueError)) as caught:
        MISTAKES[what](new())
    message = str(caught.value)
    assert what in OF_PROGRAMS or not shell_words(message), message
    assert "Illegal monitor command" not in message


def test_hints_are_methods(new: New) -> None:
    r = new()
    with pytest.raises(PowerOff) as caught:
        after(r, "DISABLE POWER").move(PART)
    assert caught.value.hint == "do('ENABLE POWER')"
    with pytest.raises(NotPossible, match=r"Not possible\* there is no motion to undo"):
        r.undo(2)
    with pytest.raises(UsageError, match=r"redo\(\) follows undo\(\)"):
        r.redo()
    with pytest.raises(vrs.MotionError, match=r"\(use move there, or a via point"):
        new().move(PART).moves(vrs.trans(-300, -450, -200, 90, 90, 0))


def test_a_line_is_told_in_words_of_the_shell(new: New) -> None:
    with pytest.raises(UsageError, match=r"\*Illegal monitor command\* there is no motion to redo \(REDO follows UNDO"):
        new().do("REDO")
    with pytest.raises(PowerOff, match=r"\(ENABLE POWER\)"):
        after(new(), "DISABLE POWER").do("READY")


def test_the_lease_is_asked_for_and_given(tmp_path: Path) -> None:
    with (
        serving(tmp_path) as it,
        vrs.connect(it.address, name="ada") as ada,
        vrs.connect(it.address, name="bob") as bob,
    ):
        ada.move(*DOWN)
        with pytest.raises(LeaseHeld, match=r'ada drives \(lease\("ask"\) asks for it\)'):
            bob.move(*DOWN)
        bob.lease("ask")
        ada.lease("give", "bob")
        bob.move(PART)
        with pytest.raises(LeaseHeld, match="bob drives"):
            ada.steer(*DOWN)
        bob.lease("release")
        ada.drag(PART)
        with pytest.raises(ValueError, match="act: acquire, ask, give, release are known"):
            ada.lease("take")


@pytest.mark.parametrize(
    ("hint", "shell", "python"),
    [
        ("{ABORT} stops it", "ABORT stops it", "abort() stops it"),
        ("{CLOCK GO} lets it go on", "CLOCK GO lets it go on", "do('CLOCK GO') lets it go on"),
        ("at most {UNDO 3}", "at most UNDO 3", "at most undo(3)"),
        ("{AT 2}, or {IN 1}", "AT 2, or IN 1", "at=2, or at=now + 1"),
        ("{RESYNC STOP}", "RESYNC STOP", "resync(stop=True)"),
    ],
)
def test_a_hint_is_written_once(hint: str, shell: str, python: str) -> None:
    error = PowerOff("no", hint, joint=2)
    assert (error.hint, error.in_python) == (shell, python)
    assert (error.for_python().hint, error.for_python().joint) == (python, 2)
    assert error.reworded("yes").in_python == python
    plain = PowerOff("no", "sets {a} and {}")
    assert (plain.hint, plain.in_python, plain.for_python()) == ("sets {a} and {}", "", plain)


def test_every_method_that_hints_name_is_there() -> None:
    for form in METHODS.values():
        name = re.match(r"[a-z]+", form)
        assert name is not None
        assert name[0] in ("at", "do") or hasattr(vrs.Robot, name[0]), form
    assert issubclass(errors.NotPossible, UsageError)
    assert np.isfinite(errors.NotPossible.code)

"""Write docs/reference.md from the docstrings of what `import vrs_cli` gives.

python docs/make_reference.py
"""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

import vrs_cli as vrs

PAGE = Path(__file__).parent / "reference.md"
HEAD = """# Every name in Python

This page lists all public names of `import vrs_cli as vrs` with their methods, from their docstrings. [The robot in
Python](python.md) explains them in order, and [tasks](tasks.md) shows uses. (n,) is one row with a number for each
joint, (N, n) are N rows. Each name has an anchor, such as `reference.md#robot-move`. `python docs/make_reference.py`
makes this page.
"""
GROUPS = (
    ("Robots", ("Robot", "load", "connect", "robots", "Model")),
    ("Places", ("trans", "Location", "Posture", "Preview", "Ways", "Dragged", "Measured", "Change")),
    ("Answers", ("Replies", "Explanation", "Picture", "Scene", "Run", "Limits")),
    ("For other programs", ("LeRobotArm", "Predictor", "RemoteController")),
    (
        "Errors",
        (
            *("VrsError", "MotionError", "JointOutOfRange", "LocationOutOfRange", "TooLate"),
            *("ProgramError", "IllegalValue", "UndefinedName", "ProgramNotExecutable", "ProgramFailed"),
            *(
                "FileError",
                "NonexistentFile",
                "FileDamaged",
                "RequestRefused",
                "UsageError",
                "NotPossible",
                "LeaseHeld",
            ),
        ),
    ),
)
SPECIAL = ("__getitem__", "__setitem__", "__matmul__")  # methods that a table names by what is written
WRITTEN = {"__getitem__": "[...]", "__setitem__": "[...] = value", "__matmul__": "@"}
INSIDE = {"of", "seen", "rows"}  # of our own use
INHERITED = {*dir(Exception), *dir(tuple), *dir(object)}


def page() -> str:
    """Return the whole page."""
    parts = [HEAD]
    for title, names in GROUPS:
        parts += [f"## {title}", *("\n\n".join(_entry(name, getattr(vrs, name))) for name in names)]
    return "\n\n".join(part.rstrip() for part in parts) + "\n"


def _entry(name: str, it: object) -> Iterator[str]:
    yield f"### {name}"
    if not inspect.isclass(it):
        yield from _described(f"vrs.{name}", it)
        return
    if not issubclass(it, Exception) and name not in ("Replies", "Explanation", "Picture", "Run", "Scene"):
        yield _code(_shown(f"vrs.{name}", it))
    yield _text(it)
    for member in members(it) if it is vrs.VrsError or not issubclass(it, vrs.VrsError) else ():
        what = inspect.getattr_static(it, member)
        yield f'<a id="{name.lower()}-{member.strip("_")}"></a>'
        yield from _described(f"{name[0].lower()}.{member}" if member not in WRITTEN else member, what)


def members(it: type) -> list[str]:
    """Return the public methods and properties of a class and of our bases, in the order of the text."""
    found = dict[str, None]()
    for base in it.__mro__:
        if base.__module__.startswith("vrs_cli"):
            for name, what in vars(base).items():
                public = name in SPECIAL or not (name.startswith("_") or name in INSIDE)
                if public and name not in INHERITED - set(SPECIAL) and documented(what):
                    found[name] = None
    return list(found)


def documented(what: object) -> bool:
    """Return whether something is a method or a property, which has a docstring."""
    return isinstance(what, (property, cached_property, classmethod, staticmethod)) or inspect.isfunction(what)


def _described(name: str, what: object) -> Iterator[str]:
    if isinstance(what, (property, cached_property)):
        yield _code(name)
    elif isinstance(what, (classmethod, staticmethod)):
        yield _code(_shown(name, what.__func__))
    elif name in WRITTEN:
        yield _code(f"it{WRITTEN[name]}" if name != "__matmul__" else "a @ b")
    else:
        yield _code(_shown(name, what))
    yield _text(what)


def _shown(name: str, what: object) -> str:
    """Return a call with its parameters, without the types, which the text tells."""
    parameters = [one for one in inspect.signature(what).parameters.values() if one.name not in ("self", "cls")]  # type: ignore[arg-type]
    shown = str(inspect.Signature([one.replace(annotation=inspect.Parameter.empty) for one in parameters]))
    return name + re.sub(r"<function (\w+) at \w+>", r"\1", re.sub(r"<Units\.VAL: 'VAL'>", '"VAL"', shown))


def _code(text: str) -> str:
    lines = textwrap.wrap(text, 110, subsequent_indent="    ", break_long_words=False)
    return "```text\n" + "\n".join(lines) + "\n```"


def _text(what: object) -> str:
    """Return a docstring, one line a paragraph."""
    found = inspect.getdoc(what.__func__ if isinstance(what, (classmethod, staticmethod)) else what) or ""
    parts = (" ".join(part.split()) for part in found.split("\n\n"))
    return "\n\n".join(textwrap.fill(part, 130, break_long_words=False) for part in parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

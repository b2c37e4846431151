"""What all checks have in common, and how a kind of check is described: the rows of the table of kinds."""

from __future__ import annotations

from typing import Any, NamedTuple

from msgspec import Struct

from vrs_cli.teach.exercise_text import Read
from vrs_cli.teach.places import ModelPlace


class BaseCheck(Struct, frozen=True, kw_only=True):
    """A check of any kind. `points`: its weight. `hidden`: students see neither its name nor its reason. `needs`: names
    of checks that must earn something, or this one earns nothing.
    """

    name: str
    points: float = 1.0
    hint: str = ""
    hidden: bool = False
    partial: bool = True
    needs: tuple[str, ...] = ()

    @property
    def needs_model(self) -> bool:
        """Return whether it compares with the run of the model solution."""
        return any(isinstance(one, ModelPlace) for name in self.__struct_fields__ for one in _flat(getattr(self, name)))


def _flat(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else (value,)


class Key(NamedTuple):
    """A key of a kind: how its value is read, what it means; `default`: what holds without it, REQUIRED: it must be
    there. `field`: of the check, where that is called otherwise.
    """

    name: str
    read: Read
    what: str
    default: Any
    field: str = ""


class CheckKind(NamedTuple):
    """A kind of check. `what`: what it looks at. `partial`: how a part of the points is earned; "": all or nothing."""

    check: type[BaseCheck]
    what: str
    partial: str
    keys: tuple[Key, ...]


REQUIRED = "required"

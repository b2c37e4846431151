"""The kinds of values, and names: what of a name counts, and which kind its first character shows."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

NAME_LENGTH = 15  # characters of a name that count (V+ User's Guide p.99)


class Kind(Enum):
    """The type of a value."""

    REAL = "real"
    STRING = "string"
    LOCATION = "transformation"
    PRECISION = "precision point"

    __hash__ = object.__hash__  # there is one of each: that of Enum is slow, and every variable is found by its kind


SIGIL_KINDS: Mapping[str, Kind] = {"#": Kind.PRECISION, "$": Kind.STRING}


def kind_of_name(name: str) -> Kind:
    """The kind that a name shows; REAL for a bare one, which can be a transformation too."""
    return SIGIL_KINDS.get(name[:1], Kind.REAL)


def kinds_of_name(name: str) -> tuple[Kind, ...]:
    """The kinds that a variable of that name can have."""
    shown = SIGIL_KINDS.get(name[:1])
    return (Kind.REAL, Kind.LOCATION) if shown is None else (shown,)


def key_of(name: str) -> str:
    """The key of a name as typed, sigil included (`ast.Variable.key`)."""
    sigil = name[:1] if name[:1] in SIGIL_KINDS else ""
    return sigil + name[len(sigil) :].lower()[:NAME_LENGTH]

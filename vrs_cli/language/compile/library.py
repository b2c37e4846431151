"""What compiled programs call. The compiler knows the names; the run floor, above it, gives what they stand for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from msgspec import Struct


class Library(Struct, frozen=True):
    """`names`: the globals of every program. Functions of the language by name: those `of_values`, and those that take
    the context of the program as first argument. `handlers`: who carries out an instruction, by its word."""

    names: Mapping[str, object]
    of_values: Mapping[str, Callable[..., Any]]
    in_context: Mapping[str, Callable[..., Any]]
    handlers: Mapping[str, Callable[..., Any]]

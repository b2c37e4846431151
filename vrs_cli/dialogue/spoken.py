"""What is said between a robot and those who hold it, as values."""

from __future__ import annotations

from typing import Generic, TypeVar

from msgspec import Struct

T = TypeVar("T", covariant=True)


class Spoken(Struct, frozen=True, tag_field="kind", tag=True):
    """`kind`, the name of its class, tells a value from others where it leaves a process."""


class Act(Spoken, Generic[T], frozen=True):
    """Something to be done; what comes of it is a T."""

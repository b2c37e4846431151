"""What is said between a robot and those who hold it, as values."""

from __future__ import annotations

from msgspec import Struct


class Spoken(Struct, frozen=True, tag_field="kind", tag=True):
    """`kind`, the name of its class, tells a value from others where it leaves a process."""

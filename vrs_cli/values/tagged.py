"""Define base classes of values that leave a process; a tag names the class of a value."""

from __future__ import annotations

from typing import Generic, TypeVar

from msgspec import Struct

T = TypeVar("T", covariant=True)


class TaggedValue(Struct, frozen=True, tag_field="kind", tag=True):
    """A value that is sent between a robot and its clients. The tag `kind` is the name of its class."""


class Act(TaggedValue, Generic[T], frozen=True):
    """A request to a robot; T is the type of its result."""


class RobotAct(Act[T], Generic[T], frozen=True):
    """A request to the robot; `interfaces/session/acts.py` carries it out. It requires the role of the VAL-II word with
    the same effect.
    """


class UserAct(Act[T], Generic[T], frozen=True):
    """A request about the user's own question, editor or screen; `interfaces/conversation` carries it out."""

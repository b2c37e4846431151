"""What the compiler hands to the one who carries out an instruction."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from msgspec import Struct

from vrs_cli.errors import IllegalValue, TypeMismatch
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.effects import Event
from vrs_cli.language.words.values import Kind, plain
from vrs_cli.values.commands import Stamp


class Definable(Struct, frozen=True):
    """A location that an instruction defines: a variable, seen from the product of those before it in `a:b:c`."""

    reference: Reference
    T_world_before: Transform | None = None

    def define(self, value: Transform | Joints) -> None:
        """Raises TypeMismatch for a precision point after others, or where the name is of another kind."""
        if self.T_world_before is None:
            self.reference.assign(value)
        elif isinstance(value, Transform):
            self.reference.assign(compose(inverse(self.T_world_before), value))
        else:
            raise TypeMismatch("a precision point in a compound", "only transformations can be compounded")

    @property
    def precision(self) -> bool:
        """Whether it holds joints."""
        return self.reference.cells.kind is Kind.PRECISION


class Wording(Struct, frozen=True):
    """What an instruction has beside its operands. `text`: its canonical form; `value`: what followed `=`."""

    text: str
    value: Any = None  # of the kind that the table of instructions asks for
    stamp: Stamp | None = None
    always: bool = False
    unit: str | None = None


# Carries out an instruction with these operands: None for one that is left out, the last ones may be missing.
Handler = Callable[..., Iterable[Event]]
NOTHING: tuple[Event, ...] = ()


def transform(place: Transform | Joints) -> Transform:
    """Raises TypeMismatch for a precision point."""
    if not isinstance(place, Transform):
        raise TypeMismatch("a precision point", "a transformation is wanted here")
    return place


def stamp_of(at: float | None, within: float | None) -> Stamp | None:
    """`AT t` or `IN dt` of a motion. Raises IllegalValue for a time before 0."""
    seconds = within if at is None else at
    if seconds is None:
        return None
    if seconds < 0.0:
        raise IllegalValue(f"{'IN' if at is None else 'AT'} {plain(seconds)}", "times are 0 or more seconds")
    return Stamp(seconds, relative=at is None)

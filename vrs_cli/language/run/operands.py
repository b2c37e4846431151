"""The evaluated operands of an instruction, as the compiler hands them to the one who carries it out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import cast

from msgspec import Struct

from vrs_cli.engine.commands import Stamp
from vrs_cli.errors import IllegalValue, TypeMismatch
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.effects import CallProgram, Yielded
from vrs_cli.language.run.formats import TypeItem
from vrs_cli.language.run.memory import Context
from vrs_cli.language.words.kind import Kind
from vrs_cli.language.words.values import Value, plain


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


Operand = Value | Reference | Definable | TypeItem | CallProgram | None


class Operands(Struct, frozen=True):
    """An instruction with its operands evaluated: None for an omitted one, trailing ones may be absent.

    `text` is the instruction in canonical form; `value` what followed `=`.
    """

    text: str
    arguments: tuple[Operand, ...] = ()
    value: Operand = None
    stamp: Stamp | None = None
    always: bool = False
    unit: str | None = None

    def get(self, index: int) -> Operand:
        return self.arguments[index] if index < len(self.arguments) else None

    def real(self, index: int) -> float:
        return cast(float, self.get(index))

    def optional(self, index: int) -> float | None:
        return cast("float | None", self.get(index))

    def real_or(self, index: int, default: float) -> float:
        given = self.optional(index)
        return default if given is None else given

    def transform(self, index: int) -> Transform:
        given = self.get(index)
        if not isinstance(given, Transform):
            raise TypeMismatch("a precision point", "a transformation is wanted here")
        return given

    def place(self, index: int) -> Transform | Joints:
        return cast("Transform | Joints", self.get(index))

    def definable(self, index: int) -> Definable:
        return cast(Definable, self.get(index))

    def positive(self, index: int, what: str) -> float:
        given = self.real(index)
        if not given > 0.0:
            raise IllegalValue(f"{what} {plain(given)}", "it must be greater than 0")
        return given


Handler = Callable[[Context, Operands], Iterable[Yielded]]
NOTHING: tuple[Yielded, ...] = ()


def stamp_of(at: float | None, within: float | None) -> Stamp | None:
    """`AT t` or `IN dt` of a motion. Raises IllegalValue for a time before 0."""
    seconds = within if at is None else at
    if seconds is None:
        return None
    if seconds < 0.0:
        raise IllegalValue(f"{'IN' if at is None else 'AT'} {plain(seconds)}", "times are 0 or more seconds")
    return Stamp(seconds, relative=at is None)

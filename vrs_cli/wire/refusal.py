"""Errors as values, for those who are elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from msgspec import Struct, structs

from vrs_cli import errors
from vrs_cli.errors import Place, ProgramError, VrsError, sentence


class Refusal(Struct, frozen=True):
    """An error with its numbers; `message` is what is shown of it."""

    code: int
    title: str
    message: str
    detail: str = ""
    hint: str = ""
    value: float | None = None
    lower: float | None = None
    upper: float | None = None
    joint: int = 0
    place: Place | None = None
    in_python: str = ""

    @classmethod
    def of(cls, error: VrsError) -> Refusal:
        told: dict[str, Any] = error.numbers
        return cls(error.code, error.title, str(error), error.detail, error.hint, in_python=error.in_python, **told)

    def error(self) -> VrsError:
        """The error again: of its class, with the same message and numbers."""
        kind = _KIND_OF_CODE.get(self.code, VrsError)
        told = {name: getattr(self, name) for name in ("value", "lower", "upper", "joint", "place")}
        made = kind(self.detail, self.hint, in_python=self.in_python, **told)
        return made if str(made) == self.message else Quoted(self)


class Quoted(ProgramError):
    """A refusal in words of its own, as of a line that cannot be read."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.detail, refusal.hint, in_python=refusal.in_python)
        self.refusal: Final = refusal

    def for_python(self) -> VrsError:
        said = sentence(self.title, self.detail, self.in_python)
        return Quoted(structs.replace(self.refusal, message=said)) if self.in_python else self

    def __str__(self) -> str:
        return self.refusal.message

    @property
    def title(self) -> str:
        return self.refusal.title


_KIND_OF_CODE: Mapping[int, type[VrsError]] = {
    kind.code: kind
    for kind in vars(errors).values()
    if isinstance(kind, type) and issubclass(kind, VrsError) and "code" in vars(kind)
}

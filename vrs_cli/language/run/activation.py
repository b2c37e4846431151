"""One activation of a program: where it is, what it keeps, and what it interrupted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct

from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.effects import Event
from vrs_cli.language.run.environment import Executable, Steps
from vrs_cli.language.run.memory import Context


class Interruption(Struct, frozen=True):
    """What a reaction interrupts: the program's `priority`, and what it was `waiting` for; `failed`: its step did."""

    priority: int
    waiting: Event | None = None
    failed: bool = False


class Activation:
    """An activation of a program: where it is (`op`), and what it keeps while its generator is replaced.

    `between`: the step `op` has not begun; `reached`: it is the very next thing to be done. `interruption`: it was
    called as a reaction.
    """

    __slots__ = ("_arguments", "_context", "_slots", "between", "interruption", "op", "program", "reached", "steps")

    def __init__(self, context: Context, program: Executable, arguments: Sequence[Reference], step: int = 0) -> None:
        if not context.robot.switch("VPLUS"):
            program.refuse_beyond_val2()
        self.program = program
        self.op = program.compiled.entry(step)
        self._context = context
        self._arguments = (*arguments, *program.own())
        self._slots = program.fresh_slots()
        self.between, self.reached = True, False
        self.interruption: Interruption | None = None
        self.steps: Steps = program.start(context, self._arguments, self._slots, self.op)

    @property
    def step(self) -> int:
        """The present step, from 0."""
        return self.program.compiled.step_of(self.op)

    @property
    def automatic(self) -> tuple[Reference, ...]:
        """Its variables of AUTO."""
        return tuple(self.own[declared.key] for declared in self.program.analysis.own if declared.automatic)

    @property
    def own(self) -> Mapping[str, Reference]:
        """Its arguments and its own variables, by key."""
        analysis = self.program.analysis
        keys = [variable.key for variable in analysis.program.parameters] + [one.key for one in analysis.own]
        return dict(zip(keys, self._arguments, strict=True))

    def enter(self, op: int) -> None:
        """Go on from another operation."""
        self.steps.close()
        self.op, self.between, self.reached = op, True, False
        self.steps = self.program.start(self._context, self._arguments, self._slots, op)

    def skip(self, more: int = 0) -> None:
        """Go on with the next step, or so many steps after that."""
        end = len(self.program.program.steps)
        self.enter(self.program.compiled.entry(min(self.step + 1 + more, end)))

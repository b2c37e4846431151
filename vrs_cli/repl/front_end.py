"""A seat: somebody's place at a robot, here or afar. Lines go in; what is said is shown, and asked, at a terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from vrs_cli.engine.position import Watched
    from vrs_cli.files.trajectory_file import Recording
    from vrs_cli.interfaces.conversation.signature import Signature
    from vrs_cli.interfaces.editor.screen import EditedProgram
    from vrs_cli.interfaces.jog.jogger import JogArm
    from vrs_cli.values.prompt import PromptStatus, Suggestion
    from vrs_cli.values.questions import Editing, Jogging, Playing

KEEPING_UP, RESTING = 0.1, 1.0  # [s] between two looks at a clock on the wall: while the arm moves, and at rest
SHORTEST = 0.01  # [s] however soon the next thing is due


class Driven(Protocol):
    """A robot in whose time somebody waits for something else."""

    def step(self) -> None:
        """Do the next thing that is due; where none is, wait for it, or until `wake` is called."""

    def wake(self) -> None:
        """End the wait; from any thread."""


class Typing(Protocol):
    """What helps while a line is typed, here or on a screen."""

    def suggestions(self, text: str, everything: bool) -> list[Suggestion]: ...
    def signature(self, text: str, *, steps: bool = False) -> Signature | None:
        """What is being typed at the end of a line takes which arguments; `steps`: of a program, whatever is open."""


class Screens(Typing, Protocol):
    """What fills a screen while a question of its own is open."""

    def page(self, question: Editing) -> EditedProgram: ...
    def hand(self, question: Jogging) -> JogArm: ...
    def recording(self, question: Playing) -> Recording: ...
    def watched(self) -> Watched | None:
        """The robot, to be looked at as it moves; None where nothing is seen of it."""

    def keep_up(self) -> None:
        """Let happen, or be shown, what has become due while nobody was looking."""

    def abort(self) -> None:
        """Stop the robot before all else that is asked of it; `keep_up` shows what was stopped. Safe in a signal
        handler.
        """


class FrontEnd(Screens, Protocol):
    """`noted`: an error where nothing can be printed; `interrupted`: Ctrl-C was heard in the last line, or ABORT;
    `failed`: something was not done, and that was not told at the terminal.
    """

    noted: str

    def note(self, error: Exception) -> None: ...
    @property
    def interrupted(self) -> bool: ...
    @property
    def failed(self) -> bool: ...

    # --- what is done: each comes back when it is done, whatever went wrong has been shown ---

    def begin(self) -> None:
        """What comes before the first line."""

    def take(self, text: str) -> None:
        """A line, or several that were pasted together."""

    def answer(self) -> None:
        """Put the questions that programs have."""

    def was_cut(self) -> bool:
        """Whether the connection to the robot is cut, or was since the last line was taken: what was typed meanwhile
        is not to be taken, for it would be done later than whoever typed it expects.
        """

    def drop(self, what: str) -> None:
        """Tell that this was typed and is not taken."""

    def leave_entry(self, why: str = "") -> None:
        """What is typed of a program is forgotten, unless whoever is there wants to go on with it."""

    def leave(self) -> None:
        """Ctrl-D: the terminal is told of it, unless whoever is there wants to stay."""

    def end(self) -> None:
        """The user has left."""

    @property
    def driven(self) -> Driven | None:
        """What goes on here while a line is waited for; None where that goes on elsewhere."""

    # --- Ctrl-C ---

    def interrupt(self) -> bool:
        """Stop what is waited for; whether it comes to an end of its own. Safe in a signal handler."""

    def stop_program(self) -> None:
        """Stop the program that runs beside an empty line; its end is told when the arm stands."""

    # --- while a line is typed ---

    def status(self) -> PromptStatus: ...
    @property
    def withdrawn(self) -> bool:
        """Whether the question that is before the user waits for no answer any more."""

    def rest(self) -> float:
        """How long nothing happens that somebody would see [s], unless something comes from elsewhere."""

    def woken_by(self, wake: Callable[[], object]) -> None:
        """Have it called, from any thread, when something has come from elsewhere: `keep_up` is to be called."""

"""Pass the lines that a user types, at a terminal, through a pipe or over a connection, to a session. Lines of a
program are collected until its `.END`, and errors become replies."""

from __future__ import annotations

import re
from functools import lru_cache
from itertools import islice
from typing import Any

from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.position import position_at
from vrs_cli.errors import ProgramExists, RequestRefused, VrsError
from vrs_cli.interfaces.conversation.complete import names_of, suggestions, typed_name
from vrs_cli.interfaces.dialogue import Dialogue, Ticket, beside, beside_if, internal_error
from vrs_cli.interfaces.editor import buffer, editors
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.monitor.help import EDITING, help_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.operands import may_replace
from vrs_cli.interfaces.targets import TargetControl
from vrs_cli.interfaces.tasks.tasks import ROBOT_PROGRAM
from vrs_cli.interfaces.users import UserState
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Vector
from vrs_cli.language.text.parser import variables_in
from vrs_cli.language.words import functions, word
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import acts, diagnostics, hand, numbers, questions, replies, results

RUNNING = "*"  # the prompt while a program runs
PASTED_TOGETHER = 16  # carry out this many pasted lines before the requests of other users
A_PROGRAM = "a program"  # what a typed program is called in the error for a user who may not store one
MANY_NAMES = 1000  # let another thread search more names than this, because that takes some milliseconds
CONSTANTS = tuple(name.lower() for name, row in functions.FUNCTIONS.items() if row.constant)

_ASKED = re.compile(r"\s*(?:\?\s*(?P<behind>[#$]?[A-Za-z][\w.]*)?|(?P<before>[#$]?[A-Za-z][\w.]*)\s*\?)\s*")


def _place(arm: RobotArm, timeline: Timeline, t: float) -> tuple[Vector, str]:
    """Return the position of the tool tip in the world [m] at time t [s], and the words for the arm's configuration."""
    position = position_at(arm, timeline, t)
    T = position.T_world_tool
    return (T.px, T.py, T.pz), str(arm.configuration(position.joints))


class Conversation:
    """The lines of one user, and the program that the user is typing. Its methods return dialogues for the actor; no
    line that a user types raises an exception in them. `user_state`: the state of this user, if the robot also has
    other users (`UserSession.put` runs the dialogues with that state)."""

    def __init__(self, session: Session, user_state: UserState | None = None) -> None:
        self.session, self.user_state = session, user_state or session.user_state
        self.entry: buffer.ProgramBuffer | None = None
        # name of a program whose heading was refused, so that its steps are dropped; "" if there is none
        self._refused: str = ""
        self._dropped = 0  # number of steps of the refused program that the current lines contain
        self._left_out = 0  # number of lines with mistakes that were left out of the typed program
        self._pasted = ""  # complete programs and variable sections of a paste; stored with those that follow
        self._jogger = Jogger(self.session)
        # cached, because the prompt needs the same position again after each typed key
        self._place = lru_cache(maxsize=1)(_place)

    # --- lines ---

    def perform(self, dialogue: Dialogue[None]) -> None:
        """Carry out a dialogue at the terminal of the session. Errors are shown as replies."""
        try:
            self.session.converse(dialogue)
        except BrokenPipeError:
            raise  # the reader of the output has closed the pipe, so no reply can be shown
        except (Exception, KeyboardInterrupt) as error:
            self.session.terminal.show(self.error_reply(error, ""))

    def lines(self, text: str, more: bool = False) -> Dialogue[None]:
        """Carry out one line, or several lines that were pasted together. Ctrl-C during a line drops the lines after
        it. `more`: the next call brings further lines of the same paste."""
        self.user_state.interrupted, self._dropped, refused = False, 0, self._refused
        lines = text.splitlines() or [""]
        for number, line in enumerate(lines, 1):
            if line.strip():
                self.user_state.typed.append(line.rstrip())
            goes_on = buffer.closes_entry(line) and buffer.opens_entry(
                next(filter(str.strip, islice(lines, number, None)), "")
            )
            yield from self._guard(self._line(line, goes_on=goes_on, alone=len(lines) == 1 and not more), line)
            if self.user_state.interrupted:
                break
            if not number % PASTED_TOGETHER:
                yield from beside(lambda: None)  # a short pause, so that requests of other users can be carried out
        if self._pasted:
            yield from self._guard(self._store(), "")
        # a person has already seen that the program was refused
        if refused and self._dropped and not self.user_state.attended:
            what = f"{numbers.count(self._dropped, 'line')} of {refused} dropped: that program was refused"
            yield self.error_reply(RequestRefused(what, ".END ends it"), "")
        if self._refused and self.user_state.attended and not more:
            self.entry, self._refused = None, ""  # a person knows that the program was refused, and need not type .END

    def _guard(self, dialogue: Dialogue[None], line: str) -> Dialogue[None]:
        """Carry out a dialogue. An error becomes a reply, so that the next line can be carried out."""
        try:
            yield from dialogue
        except BrokenPipeError:
            raise
        except (Exception, KeyboardInterrupt) as error:
            yield self.error_reply(error, line)

    def error_reply(self, error: BaseException, line: str) -> replies.Reply:
        if isinstance(error, VrsError):
            return replies.refusal(error, line)
        if isinstance(error, KeyboardInterrupt):
            self.user_state.interrupted = True
            return results.Message("interrupted", results.Tone.ERROR)
        return internal_error(error, afar=self.session.folder.closed and not self.session.folder.disclosed)

    def _line(self, line: str, *, goes_on: bool, alone: bool) -> Dialogue[None]:
        if (asked := self._topic_of(line)) is not None:
            yield from help_on(asked)
        elif self.entry is not None:
            checked = alone and self.user_state.attended and not self._refused
            if checked and (mistake := self.entry.mistake(line, self.session.environment.kinds)) is not None:
                self._left_out += 1  # the line is not added to the program
                raise diagnostics.LineRefused(mistake)
            yield from self._step(self.entry, line, goes_on=goes_on)
        elif self.user_state.editor is None and buffer.opens_entry(line):
            yield from self._open(line)
        elif self.user_state.editor is not None or line.strip():
            yield from self.session.answers(line)

    def mistake(self, text: str) -> diagnostics.Diagnostic | None:
        """Return the first mistake in a line that is still being typed; None if there is none. Pasted lines are not
        checked."""
        session, entry = self.session, self.entry
        if not text.strip() or "\n" in text or self._topic_of(text) is not None:
            return None
        if self.user_state.editor is not None:
            return self.user_state.editor.mistake(text)
        if entry is not None:
            return entry.mistake(text, session.environment.kinds)
        return None if buffer.opens_entry(text) and not buffer.ProgramBuffer(text).is_program else session.mistake(text)

    def _topic_of(self, line: str) -> str | None:
        """Return the topic that a line asks help for: `word?` or `?word`, "" for `?` alone; None if the line does not
        ask for help."""
        if (found := _ASKED.fullmatch(line)) is None:
            return None
        return found["behind"] or found["before"] or (EDITING if self.user_state.editor is not None else "")

    # --- typing a program ---

    def _open(self, header: str) -> Dialogue[None]:
        """Begin a program or section with its first line (`.PROGRAM name`). The lines after it are added to it; they
        are dropped if the first line is refused."""
        self.entry = buffer.ProgramBuffer(header)
        name = self.entry.name
        self._refused = name or "the program"
        self.session.check_may(A_PROGRAM, word.Role.SUPERVISOR)
        if name and not (yield from may_replace(self.session, name)):
            raise ProgramExists(name, f"DELETEP {name} deletes it, DISABLE INTERACTIVE lets it be replaced")
        self._refused = ""

    def _step(self, entry: buffer.ProgramBuffer, line: str, *, goes_on: bool) -> Dialogue[None]:
        """Add a line to the typed program; `.END` ends the program. `goes_on`: another program or section follows in
        the same paste, and is stored together with this program, because it may contain the program's locations."""
        self._dropped += bool(self._refused)
        if not buffer.closes_entry(line):
            entry.add(line)
            return
        self.entry = None
        refused, self._refused = self._refused, ""
        left_out, self._left_out = self._left_out, 0
        if left_out:
            yield results.Message(f"Not in it, for their mistakes: {numbers.count(left_out, 'line')}")
        if not refused:
            try:
                self.session.check_may(A_PROGRAM, word.Role.SUPERVISOR)
            except VrsError:
                if self.user_state.attended:
                    # keep the program, because this user may be allowed to store it later (another user drives now)
                    self.entry = entry
                raise
            self._pasted += entry.source
        if not goes_on:
            yield from self._store()

    def _store(self) -> Dialogue[None]:
        """Check the typed programs, and store them in memory. EXECUTE without a name then runs the first new
        program."""
        text, self._pasted = self._pasted, ""
        loaded = yield from self.session.read_file(text)
        before = dict(self.session.programs)
        self.session.take(loaded)
        yield replies.report(loaded.diagnostics, text)
        new = [(key, stored) for key, stored in self.session.programs.items() if before.get(key) is not stored]
        for number, (key, stored) in enumerate(new):
            if not number and not self.session.running:
                self.session.last_program = stored.name
            steps, replaced = numbers.count(len(stored.program.steps), "step"), " (replaced)" if key in before else ""
            ready = "" if stored.analysis.executable else "; it cannot be executed yet"
            yield results.Message(f"Program {stored.name}: {steps}{replaced}{ready}")

    def leave_entry(self, why: str = "") -> Dialogue[None]:
        """Drop the program that is being typed or edited, because of Ctrl-C or the end of the input, and tell the user.
        A person is asked first if text would be lost. `why`: the reason, with which the message to the user begins."""
        editor = self.user_state.editor
        if editor is not None:
            name, how = editor.name, "E would have stored it"
        elif self.entry is not None:
            name, how = self.entry.name or "the program", ".END would have ended it"
        else:
            return
        if (
            self._has_text
            and self.user_state.attended
            and not (yield questions.Parting(f"{name} is not stored. Leave (Y/N)?"))
        ):
            return
        self.entry = self.user_state.editor = None
        self._left_out = 0
        yield results.Message(f"{why}{name} is not stored ({how})", results.Tone.ERROR if why else results.Tone.NOTE)

    @property
    def _has_text(self) -> bool:
        """Return whether leaving would lose typed text of a program."""
        editor = self.user_state.editor
        return editor.changed if editor is not None else self.entry is not None and bool(self.entry.lines)

    # --- acts of the user ---

    def act(self, act: results.UserAct[Any]) -> Dialogue[Any]:
        """Carry out an act of the user that is not a line of text. Return its result. Raises VrsError."""
        match act:
            case acts.Attend():
                yield from self._guard(self.session.ask_for_tasks(), "")
            case acts.LeaveEntry():
                yield from self._guard(self.leave_entry(act.why), "")
            case acts.StopProgram():
                self.session.check_may("ABORT", word.Role.DESIGNER)
                # the end of the program is reported later, when the arm has stopped
                track = self.session.tasks.get(ROBOT_PROGRAM)
                if track is None or not track.running:
                    yield results.Message("Nothing to stop: EXIT leaves")
                elif track.driven_by in (None, self.user_state):
                    self.session.driver.abort(ROBOT_PROGRAM)
                else:
                    yield results.Message(f"{track.task.program} was started by somebody else: ABORT stops it")
            case acts.ReadDraft() | acts.KeepDraft():
                self.session.check_may(
                    "a program", word.Role.SUPERVISOR if isinstance(act, acts.KeepDraft) else word.Role.OBSERVER
                )
                draft = self.user_state.on_screen
                return (
                    yield from draft.do(act)
                    if isinstance(draft, editors.ScreenDraft)
                    else editors.do_without_screen(self.session, act)
                )
            case hand.Press() | hand.StopJog() | hand.Look():
                return TargetControl(self.session).jog(self._jogger, act)
        return None

    def interrupt(self, ticket: Ticket[Any]) -> None:
        """Interrupt the request of a ticket (Ctrl-C). A program or prompt line stops before its next step; in any other
        request KeyboardInterrupt is raised. Any thread may call this method."""
        if not self.session.interrupt(self.user_state):
            ticket.throw(KeyboardInterrupt())

    # --- while a line is being typed ---

    def suggest(self, text: str, everything: bool) -> Dialogue[list[questions.Suggestion]]:
        """Return words that may continue the line `text`. If there are many names, another thread searches them."""
        session, memory, branches = self.session, self.session.environment, tuple(self.session.branches.names)
        world = session.driver.world
        parts = () if world is None else world.settings.parts
        steps = self.in_program or isinstance(self.user_state.on_screen, editors.ScreenDraft)
        many = len(memory.spelling) + len(memory.programs) > MANY_NAMES
        among = memory.copy() if many else memory
        return (
            yield from beside_if(
                many,
                lambda: suggestions(
                    text,
                    names_of(among, branches, parts, typed_name(text)),
                    session.folder,
                    in_program=steps,
                    everything=everything,
                ),
            )
        )

    def status(self) -> questions.PromptStatus:
        """Return the state that the prompt and the toolbar show. If the robot also has other users, call this only in
        the robot's thread."""
        session, engine = self.session, self.session.engine
        clock, now = engine.clock, engine.clock.reached
        tool, configuration = self._place(engine.arm, engine.timeline, now)
        speed = engine.settings.speed.always
        waiting = session.driver.open_questions()
        return questions.PromptStatus(
            prompt=self.prompt or (RUNNING if session.running else session.prompt),
            indent=self.entry.indent if self.entry is not None else "",
            in_program=self.in_program,
            typed=self._has_text,
            running=session.running,
            asked=f"{waiting[0][0].task.program} asks: {waiting[0][1].question.text}" if waiting else "",
            hidden=self._hidden_constants(),
            clock=now,
            end=engine.end,
            pace=questions.Pace(clock.rate, clock.paused) if isinstance(clock, WallClock) else None,
            tool=tool,
            monitor_speed=engine.settings.monitor_speed,
            speed=speed.value,
            speed_unit=speed.unit.value,
            configuration=configuration,
            branch=session.branches.present,
        )

    def _hidden_constants(self) -> tuple[str, ...]:
        """Return the constants that are hidden by variables of the same name: variables of the program being typed;
        otherwise variables with a value. Return none if no person is present: no colours are shown then, and the search
        would parse a long program again after each line."""
        entry = self.entry
        if not self.user_state.attended:
            return ()
        known = self.session.names() if entry is None else variables_in((entry.header, *entry.lines))
        return tuple(name for name in CONSTANTS if name in known)

    @property
    def in_program(self) -> bool:
        """Return whether the next line is a line of a program."""
        return self.entry is not None or self.user_state.editor is not None

    @property
    def unfinished_text(self) -> str:
        """The program that is being typed or edited, as the text of a program file; "" if there is none."""
        editor, entry = self.user_state.editor, self.entry
        if editor is not None:
            return editor.source
        return self.user_state.drafted or (entry.source if entry is not None and not self._refused else "")

    @property
    def prompt(self) -> str:
        """The prompt for a line of a program; "" if the next line is not a line of a program."""
        asks = self.user_state.editor or self.entry
        return "" if asks is None else asks.prompt

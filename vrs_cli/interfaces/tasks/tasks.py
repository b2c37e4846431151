"""The tasks of one robot, by number: who runs, who has stopped, and who has the robot.

0 is the robot program, 1 the process control program of VAL-II, others those of V+. The robot belongs to one task at a
time: to task 0 when it starts, or to the one that attaches it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from vrs_cli.engine.engine import Engine
from vrs_cli.errors import RobotNotAttached, TaskActive, TaskNotActive
from vrs_cli.files.bounds import Folder
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.tasks.track import PROMPT_LINE, ROBOT_PROGRAM, Aborted, Track
from vrs_cli.language.run.effects import AttachRobot, Pause, TaskState, Wait, WaitEvent
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.run.semantics.tasks import LAST_TASK
from vrs_cli.language.run.units import UnitEffect
from vrs_cli.values.results import RunOutcome, StoppedTask


class Tasks:
    """Those that run or have stopped. `current` is the number of the one whose turn it is. `failed`: those that nobody
    waits for and that have stopped with an error since somebody waits for another; `told` hears of each at once. `who`
    is served now, and drives what is begun.
    """

    def __init__(self, engine: Engine, environment: Environment, devices: Devices) -> None:
        self.current = PROMPT_LINE
        self.who: object = None
        self.failed: list[StoppedTask] = []
        self.told: Callable[[StoppedTask], None] = lambda _beside: None
        self._engine, self._environment, self._devices = engine, environment, devices
        self._tracks: dict[int, Track] = {}
        self._owner: int | None = None
        environment.signals.listeners.append(self._signal_changed)

    def __iter__(self) -> Iterator[Track]:
        return iter(self._tracks.values())

    def get(self, number: int) -> Track | None:
        return self._tracks.get(number)

    def in_order(self) -> list[Track]:
        """By number."""
        return sorted(self, key=lambda track: track.number)

    @property
    def running(self) -> Iterator[Track]:
        return (track for track in self if track.running)

    @property
    def steps_done(self) -> int:
        return sum([track.task.steps_done for track in self._tracks.values()])

    def next(self) -> Track | None:
        """The task that goes on first."""
        first: Track | None = None
        for track in self._tracks.values():  # asked for twice a step
            if track.outcome is None and (first is None or (track.wake, track.number) < (first.wake, first.number)):
                first = track
        return first

    def uses(self, program: str) -> Track | None:
        """A task that has a program on its stack."""
        return next((track for track in self.in_order() if not track.task.ended and track.task.uses(program)), None)

    # --- beginning and going on ---

    def start(self, number: int, task: Task, folder: Folder | None = None) -> Track:
        """A task beside those that run, from now on. `folder`: where it has its files, if not where all others have.
        Raises TaskActive.
        """
        there = self.get(number)
        if there is not None and there.running:
            raise TaskActive(f"task {number} runs {there.task.program}", "ABORT stops it")
        if number != PROMPT_LINE:
            self._devices.release(number)
        track = Track(number, task, self._engine.now, mine=number == ROBOT_PROGRAM, driven_by=self.who)
        self.forget(number)
        self._tracks[number] = track
        self._devices.disk.place(number, folder)
        self._take_robot(track)
        return track

    def free(self) -> int:
        """The first number that is not in use. Raises TaskActive."""
        free = set(range(1, LAST_TASK + 1)) - {track.number for track in self.running}
        if not free:
            raise TaskActive("every task is in use", "KILL clears one")
        return min(free)

    def prime(self, number: int, task: Task, folder: Folder | None = None) -> Track:
        """Ready to run, and stopped before its first step. Raises TaskActive."""
        track = self.start(number, task, folder)
        task.state = TaskState.PAUSED
        self.stop(track, RunOutcome.PAUSED)
        return track

    def proceed(self, number: int, *, retry: bool = False) -> Track:
        """Let a task go on that has stopped: at its next step, or (`retry`) again with the one where it stopped.

        Raises TaskNotActive, TaskActive.
        """
        track = self.get(number)
        if track is None or (not track.running and track.task.ended):
            raise TaskNotActive(f"task {number}", "EXECUTE starts one")
        if track.running:
            raise TaskActive(f"task {number} runs {track.task.program}")
        if retry:
            track.task.retry()
        track.outcome, track.fault, track.error, track.wake = None, None, None, self._engine.now
        track.task.state = TaskState.RUNNING  # from now on, not from its turn
        track.driven_by = self.who
        self._take_robot(track)
        self._run_signal(track, running=True)
        return track

    # --- ending ---

    def abort(self, number: int) -> Track | None:
        """Stop a task, and the robot if it is its; None where there is none that runs."""
        track = self.get(number)
        if track is None or not track.running:
            return None
        if isinstance(track.pending, Aborted):
            return track
        track.task.abort()
        if self.owns(track) and not self.only_waits(track):
            self._engine.stop()
        track.until(self._engine.now, Aborted())
        return track

    def pause(self, number: int) -> Track | None:
        """Stop a task when the motion that it is in is over; None where there is none that runs."""
        track = self.get(number)
        if track is None or not track.running or isinstance(track.pending, Aborted):
            return None
        track.task.state = TaskState.PAUSED
        track.until(self._engine.now, Pause())
        return track

    def only_waits(self, track: Track) -> bool:
        """A line of the prompt in real time: the arm moves whether it waits or not."""
        return track.at_prompt and self._engine.realtime

    def end_cycles(self, number: int) -> Track:
        """CYCLE.END: the present cycle of a task is its last. Raises TaskNotActive."""
        track = self.get(number)
        if track is None or track.task.ended:
            raise TaskNotActive(f"task {number}", "nothing is to be ended")
        track.task.end_cycles()
        return track

    def stop(self, track: Track, outcome: RunOutcome) -> None:
        """It goes on no more by itself, and lets the robot, its signal and its files go."""
        track.outcome, track.pending, track.stepping = outcome, None, None
        self.release_robot(track)
        self._run_signal(track, running=False)
        if track.task.ended and not track.at_prompt:
            self._devices.release(track.number)
        else:  # it may go on: what it has written is in its files
            self._devices.rest(track.number)
        if track.fault is not None and not track.awaited:
            self.failed.append(StoppedTask(track.number, track.fault, self._engine.now))
            self.told(self.failed[-1])

    def kill(self, number: int) -> None:
        """Forget a task that has stopped. Raises TaskNotActive, TaskActive."""
        track = self.get(number)
        if track is None:
            raise TaskNotActive(f"task {number}", "there is nothing to clear")
        if track.running:
            raise TaskActive(f"task {number} runs {track.task.program}", f"ABORT {number} stops it")
        self._devices.release(number)
        self.forget(number)

    def forget(self, number: int) -> None:
        track = self._tracks.pop(number, None)
        if track is not None and not track.running:
            track.task.close()

    def forget_all(self) -> None:
        for number in list(self._tracks):
            self.forget(number)

    # --- the robot ---

    def owns(self, track: Track) -> bool:
        """Whether the robot is its; a line of the prompt has it while no task does."""
        return self._owner == track.number or (track.at_prompt and self._owner is None)

    def check_robot_free(self) -> None:
        """Raises RobotNotAttached where a task has the robot."""
        if self._owner is not None:
            raise self.not_attached()

    def not_attached(self) -> RobotNotAttached:
        if self._owner is None:
            return RobotNotAttached("no program has it", "ATTACH takes it")
        return RobotNotAttached(f"task {self._owner} has it", "DETACH there and ATTACH here, or send it a signal")

    def attach_robot(self, track: Track) -> bool:
        """ATTACH; False while another task has it."""
        if self._owner not in (None, track.number):
            return False
        self._owner, track.mine = track.number, True
        return True

    def _take_robot(self, track: Track) -> None:
        if track.mine and self._owner is None:
            self._owner = track.number

    def release_robot(self, track: Track) -> None:
        """Those that want it are asked again."""
        if self._owner != track.number:
            return
        self._owner = None
        for other in self:
            if isinstance(other.pending, AttachRobot):
                other.wake = self._engine.now

    # --- units ---

    def look_at_units(self) -> None:
        """Something has arrived on a device: those that wait for that look again."""
        for track in self.running:
            if isinstance(track.pending, UnitEffect):
                track.wake = self._engine.now

    # --- signals ---

    def _signal_changed(self, signal: int, on: bool) -> None:
        """Waits that a signal may end are looked at now, and so are reactions."""
        for track in self.running:
            track.task.reactions.changed(signal, on)
            if on and track.event_signal == signal:
                self.set_event(track)
            if (isinstance(track.pending, Wait) and not track.pending.ticks) or track.reacts:
                track.wake = self._engine.now

    def set_event(self, track: Track) -> None:
        """SET.EVENT: a WAIT.EVENT of the task is looked at now."""
        track.event = True
        if isinstance(track.pending, WaitEvent):
            track.wake = self._engine.now

    def set_run_signal(self, track: Track, signal: int) -> None:
        """RUNSIG: the signal that says whether the task runs."""
        self._run_signal(track, running=False)
        track.run_signal = signal
        self._run_signal(track, running=True)

    def _run_signal(self, track: Track, *, running: bool) -> None:
        if track.run_signal is not None:
            self._environment.signals.write(track.run_signal if running else -track.run_signal)

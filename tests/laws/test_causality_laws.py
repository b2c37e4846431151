"""Real time: whatever is commanded, whenever and however, what has happened does not change by a bit."""

from __future__ import annotations

from contextlib import suppress
from math import radians
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.engine.wall import ManualWall
from tests.examples import examples, some
from tests.interfaces.terminals import RecordingTerminal
from tests.laws.motion_laws import check_continuous, check_limits
from tests.laws.test_motion_laws import ABOVE_THE_TABLE, MODEL, joint_targets, moves, others
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.transform import translation
from vrs_cli.repl.player import JogPanel
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.state import Target
from vrs_cli.values.acts import Go, Goal, Redo, Undo
from vrs_cli.values.commands import Brake, Break, JointTarget, SetParameter, SetTool
from vrs_cli.values.results import Position

LOOKS = 6  # instants of the past that are looked at before and after each command


class World:
    """A robot in real time, with somebody who remembers what was seen of it."""

    def __init__(self, seed: int) -> None:
        source = Random(seed)
        self.random = source
        self.wall = ManualWall(each_look=lambda: source.choice((0.0, 0.0, 1e-4, 0.02)))
        self.clock: WallClock = self.wall.clock()
        self.engine = Engine(MODEL, clock=self.clock)
        self.seen: dict[float, str] = {}

    def see(self) -> None:
        """Read the robot at random instants of the past, and at the last one of it."""
        self.clock.advance(self.clock.reached)
        now = self.clock.now
        for t in (now - TICK, *(self.random.uniform(0.0, now) for _ in range(LOOKS))):
            if 0.0 <= t < now:
                self.seen[t] = self.at(t)

    def at(self, t: float) -> str:
        """All that is known of an instant, to the bit."""
        it: Position = position_at(self.engine.arm, self.engine.timeline, t)
        return repr((it.joints, it.velocity, it.acceleration, it.T_world_tool, it.hand, it.moving, it.text))

    def check(self) -> None:
        for t, before in self.seen.items():
            assert self.at(t) == before, t


def waits(seconds: float) -> object:
    def act(world: World) -> None:
        world.wall.seconds += seconds

    return act


def runs_at(rate: float) -> object:
    return lambda world: world.clock.change(rate=rate)


def pauses(paused: bool) -> object:
    return lambda world: world.clock.change(paused=paused)


def commands(request: object, program: bool) -> object:
    return lambda world: world.engine.perform(request, program=program)


def redirects(target: JointTarget) -> object:
    return lambda world: world.engine.redirect(target.joints, text="JOG")


def steers(target: JointTarget, count: int) -> object:
    """A stream of targets, one in 20 ms, that goes on from the one before."""

    def act(world: World) -> None:
        for _ in range(count):
            world.engine.steer(Target(target.joints, (0.0,) * 6), 0.02)
            world.wall.seconds += 0.02
            world.clock.advance(world.clock.reached)

    return act


def takes_back(world: World) -> None:
    world.engine.undo()


def does_again(world: World) -> None:
    world.engine.redo()


policies = st.builds(SetParameter, name=st.just("CAUSALITY"), value=st.sampled_from(["ABORT", "POSTPONE"]))
profiles = st.builds(SetParameter, name=st.just("PROFILE"), value=st.sampled_from(list(Profile.__members__)))
rests = st.sampled_from([Break(), Brake(), SetTool(translation(0.0, 0.0, 0.05)), SetTool(translation(0.0, 0.0, 0.0))])
actions = st.one_of(
    st.floats(0.0, 2.0).map(waits),
    st.floats(0.0, 2.0).map(waits),
    st.floats(0.01, 20.0).map(runs_at),
    st.booleans().map(pauses),
    st.builds(commands, moves, st.booleans()),
    st.builds(commands, moves, st.booleans()),
    st.builds(commands, moves, st.booleans()),
    st.builds(commands, others | policies | profiles | rests, st.booleans()),
    st.builds(redirects, joint_targets),
    st.builds(steers, joint_targets, st.integers(1, 8)),
    st.sampled_from([takes_back, takes_back, does_again]),
)


@examples(120)
@given(st.integers(0, 1 << 30), st.lists(actions, min_size=5, max_size=25))
def test_the_past_never_changes(seed: int, sequence: list[object]) -> None:
    world = World(seed)
    world.engine.perform(ABOVE_THE_TABLE, program=True)
    world.engine.perform(SetParameter("CAUSALITY", "POSTPONE"))
    for act in sequence:
        world.see()
        with suppress(VrsError):
            act(world)  # type: ignore[operator]
        world.check()
    world.clock.change(paused=False)
    check_continuous(world.engine, world.engine.timeline)
    check_limits(world.engine, world.engine.timeline)
    for delta in world.engine.book.deltas:
        assert delta.executed >= delta.issued, "nothing is executed before it is issued"


# --- every way in ----------------------------------------------------------------------------------------------------

PROGRAMS = """\
.PROGRAM beside()
ATTACH
FOR i = 1 TO 4
DRIVE 2, 3, 40
WAIT TIMER(1) > i
DRIVE 2, -3, 40
END
DETACH
.END
.PROGRAM short()
REACTI 1001, away
DRIVE 1, 8, 60
DRIVE 1, -8, 60
MOVE HERE AT TIME()+0.1
BREAK
.END
.PROGRAM away()
DRIVE 4, 5, 100
RETURN
.END
"""
LINES = (
    *("READY", "READY IN 0", "READY IN 0.5", "READY AT 1", "READY AT 5", "READY AT 12", "NEST IN 1"),
    *("DRIVE 1, 10, 30", "DRIVE 1, -10, 80", "DEPARTS 5", "MOVES SHIFT(HERE BY 0, 10, 0) IN 0", "HOLD"),
    *("JOG 1, 3", "JOG Z, -2", "JOG TRX, 2", "ABORT", "BRAKE", "BREAK", "UNDO", "UNDO", "UNDO 2", "REDO", "DELAY 0.2"),
    *("TOOL TRANS(0,0,50,0,0,0)", "TOOL NULL", "OPENI", "EXECUTE short", "EXECUTE 2 beside", "ABORT 2", "PROCEED"),
    *("SIGNAL 1001", "SIGNAL -1001", "PCEXECUTE beside", "PCABORT", "KILL", "KILL 2", "BRANCH trial", "MERGE trial"),
    *("PARAMETER CAUSALITY = POSTPONE", "PARAMETER CAUSALITY = ABORT", "PARAMETER INSERT = OFF"),
    *("PARAMETER INSERT = ON", "PARAMETER PROFILE = SCURVE", "PARAMETER PROFILE = LSPB", "CLOCK RATE = 3"),
    *("CLOCK RATE = 1", "CLOCK PAUSE", "CLOCK GO", "CLOCK GO", "SPEED 60", "SPEED 20 ALWAYS", "DRY", "STATUS"),
)


class Shell:
    """Somebody at a robot in real time who types, jogs, steers and interrupts; another one watches."""

    def __init__(self, seed: int) -> None:
        self.random = source = Random(seed)
        self.wall = ManualWall(each_look=lambda: source.choice((0.0, 1e-4, 1e-3)))
        self.clock = self.wall.clock()
        self.session = Session(RecordingTerminal(), MODEL, clock=self.clock)
        self.session.load_text(PROGRAMS)
        self.panel = JogPanel(Jogger(self.session))
        self.steering = Steering(self.session.engine, speed=0.5)
        self.seen: dict[float, str] = {}

    def see(self) -> None:
        """What happened before the present instant; where no task goes on by itself, nobody need look at the clock
        first.
        """
        engine = self.session.engine
        if any(self.session.driver.tasks.running):
            self.session.settle()
        now = engine.now if any(self.session.driver.tasks.running) else self.clock.reached
        for t in (now - TICK, *(self.random.uniform(0.0, now) for _ in range(3))):
            if 0.0 <= t < now:
                self.seen[t] = self.at(t)

    def at(self, t: float) -> str:
        it = position_at(self.session.engine.arm, self.session.engine.timeline, t)
        return repr((it.joints, it.velocity, it.acceleration, it.hand, it.moving))

    def act(self) -> str:
        source = self.random
        self.wall.seconds += source.choice((0.0, 0.01, 0.1, 0.4, source.uniform(0.0, 2.0)))
        way = source.choice((self.line, self.line, self.line, self.keys, self.stream, self.interrupted, self.values))
        with suppress(VrsError, KeyboardInterrupt):
            return way()
        return way.__name__

    def line(self) -> str:
        line = self.random.choice(LINES)
        self.session.perform(line)
        return line

    def values(self) -> str:
        """What is asked for as a value, from here or afar."""
        source, now = self.random, self.clock.reached
        joints = tuple(q + radians(source.uniform(-20.0, 20.0)) for q in MODEL.poses["ready"])
        at, claim = (source.choice((None, 0.0, now - 0.2, now + 0.3)) for _ in range(2))
        go = Go(Goal(joints=joints), executed=at, text="GO")
        act = source.choice((go, go, go, Undo(), Redo()))
        self.session.converse(
            self.session.user_state.with_issue_time(claim and min(claim, now), act_on(self.session, act))
        )
        return f"{act}"

    def keys(self) -> str:
        panel, source = self.panel, self.random
        source.choice((panel.next_frame, panel.stop, lambda: panel.next_axis(1), lambda: panel.faster(-1)))()
        for _ in range(source.randint(1, 4)):
            panel.move(source.choice((-1.0, 1.0)))
            self.wall.seconds += 0.03
        return "keys"

    def stream(self) -> str:
        """Targets with stamps of the clock, of long ago, or none."""
        source, joints = self.random, self.session.engine.position().joints
        begin = source.choice((self.clock.reached, 0.0, 0.5 * self.clock.reached, None))
        if self.clock.paused:
            return "stream"  # targets to come are waited for
        for k in range(source.randint(1, 6)):
            goal = (joints[0] + radians(0.3 * k), *joints[1:])
            self.steering.to(goal, None if begin is None else begin + 0.02 * k)
            self.wall.seconds += source.choice((0.0, 0.02, 0.05))
        if source.random() < 0.5:
            self.steering.finish()
        return "stream"

    def interrupted(self) -> str:
        """Ctrl-C after a while, in a program or while the prompt waits."""
        source, session, sleep = self.random, self.session, self.wall.sleep
        line = source.choice(("EXECUTE short", "BREAK", "DO WAIT", "DO CALL short"))

        def press(seconds: float) -> None:
            sleep(seconds)
            if source.random() < 0.2:
                session.interrupt()

        self.clock.sleep = press
        try:
            session.perform(line)
        finally:
            self.clock.sleep = sleep
        return f"{line}, Ctrl-C"


@pytest.mark.parametrize("first", range(0, some(32), 4))
def test_no_way_in_changes_the_past(first: int) -> None:
    for seed in range(first, first + 4):
        shell = Shell(seed)
        for _ in range(25):
            shell.see()
            what = shell.act()
            for t, before in shell.seen.items():
                assert shell.at(t) == before, (seed, what, t)

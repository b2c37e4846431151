"""Real time: whatever is commanded, whenever, what has happened does not change by a bit."""

from __future__ import annotations

from contextlib import suppress
from random import Random

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.engine.wall import ManualWall
from tests.laws.motion_laws import check_continuous, check_limits
from tests.laws.test_motion_laws import ABOVE_THE_TABLE, MODEL, joint_targets, moves, others
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.commands import Brake, Break, JointTarget, SetParameter, SetTool
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import Position, position_at
from vrs_cli.errors import VrsError
from vrs_cli.kinematics.transform import translation
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.steered import Target

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
        return repr((it.joints, it.velocity, it.acceleration, it.T_world_tool, it.hand, it.moving, it.motion.text))

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
profiles = st.builds(SetParameter, name=st.just("PROFILE"), value=st.sampled_from(["LSPB", "SCURVE"]))
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


@settings(max_examples=120, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(st.integers(0, 1 << 30), st.lists(actions, min_size=5, max_size=25))
def test_the_past_never_changes(seed: int, sequence: list[object]) -> None:
    world = World(seed)
    world.engine.perform(ABOVE_THE_TABLE, program=True)
    world.engine.parameters.set_parameter("CAUSALITY", "POSTPONE")
    for act in sequence:
        world.see()
        with suppress(VrsError):
            act(world)  # type: ignore[operator]
        world.check()
    world.clock.change(paused=False)
    check_continuous(world.engine, world.engine.timeline)
    check_limits(world.engine, world.engine.timeline)
    for delta in world.engine.deltas:
        assert delta.executed >= delta.issued, "nothing is executed before it is issued"

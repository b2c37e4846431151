"""Carry out `vrs body`: act as the body of a served robot (the real or simulated arm that executes its motions), or
connect another arm to it."""

from __future__ import annotations

import asyncio
import sys
from argparse import Namespace
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from math import radians
from threading import Thread
from typing import TYPE_CHECKING, Any

from vrs_cli.bodies.scenario import Disturbance, Release, Scenario, load_scenario, read_command
from vrs_cli.cli import main, remote
from vrs_cli.cli.command_line import CommandLineError, errors_of_options, teller
from vrs_cli.errors import IllegalValue, UsageError, VrsError
from vrs_cli.interfaces.station.body import check_time
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.net.body_client import BodyClient
from vrs_cli.repl.interrupt import ENDINGS, Ended, signal_comes
from vrs_cli.wire.reports import LineFormat, heading, read_report, setpoint_line

if TYPE_CHECKING:
    from vrs_cli.bodies.mujoco_arm import MujocoArm


MAX_REPORTED = 5  # maximum number of wrong lines that are reported
MAX_LINE_CHARS = 1 << 16
MAX_JUMP = 5.0  # [s] if the robot's clock jumps farther than this, a new simulated arm is started
Tell = Callable[[str], None]


def body(options: Namespace) -> int:
    """Act as the robot's body until Ctrl-C, or until another client becomes the body. If the robot refuses a request,
    raises the robot's error."""
    kind = next((kind for kind in KINDS if getattr(options, kind)), None)
    if kind is None:
        raise CommandLineError("which body?", f"give --{' or --'.join(KINDS)}")
    status, number = asyncio.run(_until_signal(KINDS[kind](options)))
    if number in ENDINGS:
        raise Ended(number)
    return status


async def _until_signal(work: Coroutine[Any, Any, int]) -> tuple[int, int]:
    """Run a coroutine until it ends or a signal arrives. Return the exit status, and the number of the signal or 0."""
    working, heard = asyncio.create_task(work), asyncio.create_task(signal_comes())
    done, _ = await asyncio.wait({working, heard}, return_when=asyncio.FIRST_COMPLETED)
    if working in done:
        heard.cancel()
        return working.result(), 0
    working.cancel()
    with suppress(asyncio.CancelledError):
        await working
    return main.OK, heard.result()


def _client(options: Namespace) -> BodyClient:
    """Return the client that connects the body to the robot's server. Raises CommandLineError for a wrong address, or
    FileError."""
    token, tell = remote.token_of(options.token_file), teller(options.prog)
    with errors_of_options(UsageError, IllegalValue):
        return BodyClient(options.url, token, options.rate, name=options.name or "body", ca=options.ca, notify=tell)


def _tell_begun(tell: Tell, body: BodyClient, what: str) -> None:
    tell(
        f"{what} is the body of {body.model.title} at {body.client.url}, {body.rate:g} reports a second; Ctrl-C ends it"
    )


def _read_input(take: Callable[[str], None], end: Callable[[], object]) -> None:
    """Read standard input in a thread. In the event loop call `take` with each line, and `end` after the last line."""
    loop = asyncio.get_running_loop()

    def read() -> None:
        with suppress(OSError, ValueError, RuntimeError):  # the stream or the loop is closed
            while line := sys.stdin.readline(MAX_LINE_CHARS):
                loop.call_soon_threadsafe(take, line)
        with suppress(RuntimeError):
            loop.call_soon_threadsafe(end)

    Thread(target=read, name="vrs body reads", daemon=True).start()


# --- --mujoco: a simulated arm ---------------------------------------------------------------------------------------


async def _simulate(options: Namespace) -> int:
    """Act as the body with an arm that MuJoCo simulates. Raises CommandLineError if MuJoCo is not installed,
    NotAvailable if the masses of the robot's links are unknown, and the errors of the scenario file."""
    try:
        from vrs_cli.bodies.mujoco_arm import ArmSettings, MujocoArm
    except ImportError:
        raise CommandLineError("--mujoco needs MuJoCo", "pip install 'vrs-cli[physics]'") from None

    tell, usual = teller(options.prog), ArmSettings()
    settings = ArmSettings(
        bandwidth=options.bandwidth,
        report_rate=options.rate,
        resolution=usual.resolution if options.resolution is None else radians(options.resolution),
        noise=usual.noise if options.noise is None else radians(options.noise),
    )
    async with _client(options) as body:
        kinds = tuple(link.kind for link in body.model.links)
        scenario = Scenario() if options.scenario is None else load_scenario(options.scenario, kinds)
        seed = scenario.seed if options.seed is None else options.seed

        def make_arm(joints: Joints, t: float) -> MujocoArm:
            disturbances = [one for one in scenario.disturbances if one.at is not None and one.at >= t]
            return MujocoArm(
                body.model,
                seed=seed,
                controller=options.controller,
                settings=settings,
                joints=joints,
                start=t,
                disturbances=disturbances,
            )

        arm = make_arm(body.setpoint(body.now()).joints, body.now())
        _tell_begun(tell, body, "a simulated arm")
        await _move(body, arm, make_arm, _commands(kinds, tell))
    return main.OK


async def _move(
    body: BodyClient,
    arm: MujocoArm,
    make_arm: Callable[[Joints, float], MujocoArm],
    commands: asyncio.Queue[Disturbance | Release],
) -> None:
    """Let a simulated arm follow the robot's timeline, and send its measurements as reports. If the robot's clock
    jumps, for instance because the server was replaced, a new arm continues from the current pose."""
    order = body.order
    async for t in body.ticks():
        if not -MAX_JUMP < t - arm.time < MAX_JUMP:
            mode, arm = arm.mode, make_arm(arm.joints, t)
            arm.order(mode)
        if body.order is not order and body.order.at <= t:
            order = body.order
            arm.order(order.mode)
        while not commands.empty():
            arm.disturb(commands.get_nowait())
        for one in arm.advance(t, body.setpoint):
            body.report(one.t, one.joints, one.velocity, one.effort, one.mode)


def _commands(kinds: tuple[JointKind, ...], tell: Tell) -> asyncio.Queue[Disturbance | Release]:
    """Return a queue that receives the disturbances typed on standard input."""
    found: asyncio.Queue[Disturbance | Release] = asyncio.Queue()

    def take(line: str) -> None:
        if line.strip():
            try:
                found.put_nowait(read_command(line, kinds))
            except VrsError as error:
                tell(str(error))

    _read_input(take, lambda: None)
    return found


# --- --stream: another program ---------------------------------------------------------------------------------------


async def _stream(options: Namespace) -> int:
    """Let another program act as the body: write set points to standard output, and read reports from standard input
    until it ends. Return FAILED if some lines were not reports."""
    tell, form = teller(options.prog), LineFormat(options.format)
    async with _client(options) as body:
        units, joint_count = body.model.units, body.model.joint_count
        ended, wrong, number = asyncio.Event(), 0, 0

        def take(line: str) -> None:
            nonlocal wrong, number
            number += 1
            if not line.strip():
                return
            try:
                one = read_report(line, body.now(), units, joint_count)
                check_time(one.t, body.now())
                body.report(one.t, one.joints, one.velocity, one.effort, one.mode)
            except VrsError as error:
                wrong += 1
                if wrong <= MAX_REPORTED:
                    tell(f"standard input:{number}: {error}{' (others are not told)' if wrong == MAX_REPORTED else ''}")

        _tell_begun(tell, body, "another program")
        if form is LineFormat.CSV:
            print(heading(joint_count), flush=True)
        _read_input(take, ended.set)
        async for t in body.ticks():
            if ended.is_set():
                break
            print(setpoint_line(form, t, body.setpoint(t), body.order.mode, units), flush=True)
    return main.FAILED if wrong else main.OK


# --- --rosbridge: an arm of ROS 2 ------------------------------------------------------------------------------------


async def _follow_by_ros(options: Namespace) -> int:
    """Use an arm of ros2_control as the robot's body, through a rosbridge server. Raises CommandLineError
    for wrong joint names, FileError, and RequestRefused if no rosbridge answers."""
    from vrs_cli.bodies.joint_trajectory import read_joints
    from vrs_cli.bodies.rosbridge import RosSettings, follow

    if not options.rosbridge.startswith(("ws://", "wss://")):
        raise CommandLineError(
            f"--rosbridge {options.rosbridge} is no address", "give ws://HOST:PORT, usually port 9090"
        )
    tell = teller(options.prog)
    async with _client(options) as body:
        with errors_of_options(IllegalValue):
            joints = read_joints(options.joints, [link.kind for link in body.model.links])
        settings = RosSettings(
            options.rosbridge,
            joints,
            controller=f"/{options.ros_controller.strip('/')}",
            states=f"/{options.joint_states.strip('/')}",
            replaces=options.replacement,
            by_action=options.action,
        )
        _tell_begun(tell, body, f"an arm of ROS at {options.rosbridge}")
        await follow(body, settings, tell)
    return main.OK


KINDS: Mapping[str, Callable[[Namespace], Coroutine[Any, Any, int]]] = {
    "mujoco": _simulate,
    "stream": _stream,
    "rosbridge": _follow_by_ros,
}

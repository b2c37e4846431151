"""Act as the body (the real or simulated arm) of a served robot: follow its timeline and report measured joints.

    async with BodyClient("ws://127.0.0.1:8765", token, rate=100.0) as body:
        async for t in body.ticks():                      # [s] of the robot's clock
            joints, velocity, acceleration = body.setpoint(t)
            body.report(t, my_arm.follow(joints, velocity), my_arm.velocity)

If the connection is cut, the client reconnects, becomes the body again, and sends the reports made meanwhile. Reports
are numbered, so that the server counts each once and knows how many are lost.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from math import isfinite
from pathlib import Path
from types import TracebackType
from typing import Self

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import MissedEvents, Subscription
from vrs_cli.engine.position import joint_state_at
from vrs_cli.errors import IllegalValue, RequestRefused, VrsError
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.net import messages
from vrs_cli.net.client import Client, hello_of
from vrs_cli.net.far_end import FIRST_PINGS
from vrs_cli.net.mirror import Mirror
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.measured import BodyMode, Report
from vrs_cli.wire.reports import MAX_MESSAGE_REPORTS, row_fields, row_parts

SEND_EVERY = 0.02  # [s] time between two messages with reports
KEPT = 60.0  # [s] time for which reports are kept, to resend them if the connection is cut
MAX_KEPT = 100_000  # maximum number of kept reports
MAX_WAITING_BYTES = 64 * 1024  # maximum bytes waiting for the socket; while more wait, reports stay here
SETTLING = 3.0  # [s] maximum time for the first measurements of the robot's clock
PAST = 10.0  # [s] how much of the timeline's past is kept

log = logging.getLogger("vrs_cli")


class BodyClient:
    """A client that is the body of a served robot. Call all methods in the thread of the event loop. `rate`: reports
    per second, at most 2,000. `name`: the name that other users see if the token has none. `order`: the last order of
    the server: to follow the timeline or to hold still, from a given time on. `refusal`: the reason why this client is
    no longer the body. `notify`: callback for messages about the connection."""

    def __init__(
        self,
        url: str,
        token: str = "",
        rate: float = 100.0,
        *,
        name: str = "body",
        ca: Path | None = None,
        notify: Callable[[str], None] = log.warning,
    ) -> None:
        if not 0.0 < rate <= 2000.0:
            raise IllegalValue(f"{rate:g} reports a second", "more than 0, 2000 at most", value=rate)
        self.rate, self.order = rate, messages.BodyOrder(BodyMode.FOLLOWS, 0.0)
        self.refusal: VrsError | None = None
        self.client = Client(url, hello_of(token, name), ca=ca, notify=notify)
        self.far = self.client.far
        self._sent, self._fresh = deque[Report](), deque[Report]()  # kept reports: already sent, and not yet sent
        self._first = 0  # the number of the first kept report
        self.embodied, self._woken = False, asyncio.Event()
        self.life = ""
        self._sending: asyncio.Task[None] | None = None
        self._asking: asyncio.Task[None] | None = None
        self._orders: list[tuple[deque[messages.BodyOrder], asyncio.Event]] = []

    # --- the connection ---

    async def __aenter__(self) -> Self:
        """Connect and become the body. Raises RequestRefused if no robot answers or another client is the body, or the
        error that the server sent.
        """
        try:
            self.life = (await self.client.open()).life
            await self.client.follow(PAST)
            self.far.news.append(self._hear)
            await self._embody()
        except BaseException:
            await self.client.close()
            raise
        self._sending = asyncio.create_task(self._send())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop being the body, and leave the robot."""
        for task in (self._sending, self._asking):
            if task is not None:
                task.cancel()
        if self.embodied and self.far.open:
            with suppress(VrsError):
                self._send_batch(waiting=MAX_MESSAGE_REPORTS * MAX_WAITING_BYTES)
                self.client.begin(lambda id: messages.Embody(id, held=False), lambda _end: None)
        await self.client.close()

    async def _embody(self) -> None:
        """Become the body when the robot's clock is known well, and mark the reports that the server lacks as not
        sent."""
        due = asyncio.get_running_loop().time() + SETTLING
        while len(self.far.sync) < FIRST_PINGS and asyncio.get_running_loop().time() < due:
            await asyncio.sleep(SEND_EVERY)
        answer = await self.client.ask(lambda id: messages.Embody(id, first=self._first, rate=self.rate))
        assert isinstance(answer, messages.Embodied), "it answers Embody"
        while self._sent and self._first + len(self._sent) > answer.next:
            self._fresh.appendleft(self._sent.pop())
        while self._fresh and self._first + len(self._sent) < answer.next:
            self._sent.append(self._fresh.popleft())
        self.order, self.embodied = messages.BodyOrder(answer.mode, answer.at), True
        self._woken.set()

    def _end(self, why: VrsError) -> None:
        self.refusal, self.embodied = why, False
        self._woken.set()

    def _hear(self, message: messages.ServerMessage) -> None:
        match message:
            case messages.Welcome():
                self.embodied = False
                if message.life != self.life:  # the server has restarted: its clock may be a different one
                    self.life = message.life
                    self._first += len(self._sent) + len(self._fresh)
                    self._sent.clear()
                    self._fresh.clear()
                if self._asking is not None:
                    self._asking.cancel()

                async def embody_again() -> None:
                    try:
                        await self._embody()
                    except VrsError as error:
                        if self.far.open:  # else the connection was cut again, and the next welcome retries
                            self._end(error)

                self._asking = asyncio.create_task(embody_again())
            case messages.BodyOrder():
                self.order = message
                for orders, woken in self._orders:
                    orders.append(message)
                    woken.set()
            case messages.BodyReleased():
                if self.embodied:
                    self._end(RequestRefused("this client is the body no longer", "BODY says who is"))
            case messages.Refused(refusal=refusal, id=None):
                self.client.notify(f"reports were refused: {refusal.error()}")

    # --- timeline and orders ---

    @property
    def mirror(self) -> Mirror:
        assert self.far.mirror is not None, "it follows the timeline"
        return self.far.mirror

    @property
    def model(self) -> RobotModel:
        return self.mirror.arm.model

    @property
    def timeline(self) -> Timeline:
        return self.mirror.timeline

    def now(self) -> float:
        """Return the robot's clock [s], as estimated here."""
        return self.mirror.now

    def setpoint(self, t: float) -> JointState:
        """Return the joints, velocities and accelerations of the timeline at time t [s], past or future."""
        mirror = self.mirror
        return joint_state_at(mirror.arm, mirror.timeline, t)

    async def ticks(self) -> AsyncIterator[float]:
        """Yield the robot's clock [s] `rate` times a second. Raises RequestRefused when this client is no longer the
        body, or the error that the server sent."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            self._check()
            yield self.now()
            due = max(due + 1.0 / self.rate, loop.time())
            await asyncio.sleep(due - loop.time())

    async def changes(self) -> AsyncIterator[TimelineChange | MissedEvents | messages.BodyOrder]:
        """Yield the current timeline, then each change and each order. Raises the same errors as `ticks`."""
        woken, orders, loop = asyncio.Event(), deque[messages.BodyOrder](), asyncio.get_running_loop()
        listener = orders, woken
        self._orders.append(listener)

        def wake() -> None:
            loop.call_soon_threadsafe(woken.set)

        hearing: Subscription[TimelineChange] = self.mirror.events.subscribe(woken=wake)
        try:
            while True:
                woken.clear()
                for change in hearing.take_all():
                    yield change
                while orders:
                    yield orders.popleft()
                self._check()
                await woken.wait()
        finally:
            self._orders.remove(listener)
            hearing.end()

    def _check(self) -> None:
        refusal = self.refusal or self.far.refusal
        if refusal is not None:
            raise refusal

    # --- reports ---

    def report(
        self,
        t: float,
        joints: Joints,
        velocity: Joints | None = None,
        effort: Joints | None = None,
        mode: BodyMode = BodyMode.FOLLOWS,
    ) -> None:
        """Report joints [rad, m] measured at time t [s] of the robot's clock, and their velocities [rad/s, m/s] and
        efforts [N m, N] if known. The report is sent within 20 ms, or after the connection is restored; reports are
        kept for 60 s. Raises IllegalValue for a report that does not fit this robot."""
        rows = tuple(None if row is None else tuple(map(float, row)) for row in (joints, velocity, effort))
        count = self.model.joint_count
        for row in rows:
            if row is not None and (len(row) != count or not all(map(isfinite, row))):
                raise IllegalValue(f"a report of {row}", f"this robot has {count} joints, and each is a finite number")
        if not isfinite(t):
            raise IllegalValue(f"a report of the time {t}", "seconds of the robot's clock")
        at, speed, force = rows
        assert at is not None, "joints are there"
        self._fresh.append(Report(t, at, speed, force, mode))
        if len(self._sent) + len(self._fresh) > max(min(MAX_KEPT, KEPT * self.rate), 1.0):
            (self._sent or self._fresh).popleft()
            self._first += 1
        self._woken.set()

    async def _send(self) -> None:
        """Send new reports until cancelled."""
        while True:
            await self._woken.wait()
            self._woken.clear()
            if self.embodied and self.far.open:
                with suppress(RequestRefused):  # if the connection is cut, the reports are sent again later
                    self._send_batch(MAX_WAITING_BYTES)
            await asyncio.sleep(SEND_EVERY)
            if self.embodied and self._fresh:
                self._woken.set()

    def _send_batch(self, waiting: int) -> None:
        """Send new reports, until more than `waiting` bytes wait for the socket."""
        estimate = self.far.sync.estimate
        trip = 0.0 if estimate is None else estimate.round_trip * (self.far.rate or 1.0)
        for part in row_parts(tuple(self._fresh)):
            if self.far.connection.waiting > waiting:
                return
            first = self._first + len(self._sent)
            self.client.send(messages.Measured(first=first, sent=self.now(), round_trip=trip, **row_fields(part)))
            for _ in part:
                self._sent.append(self._fresh.popleft())

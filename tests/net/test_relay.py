"""A robot that is served elsewhere, through the relay of `vrs view`: what a page hears, and what is predicted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from math import inf
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from msgspec import convert
from msgspec.json import decode
from websockets.sync.client import connect

from tests.live import PATIENCE, until
from tests.net.course_sessions import DrawnWorld
from tests.net.serving import Caller, Serving, serving
from tests.net.test_cells_afar import CELL, LINES
from tests.net.test_delayed_robot import behind
from tests.net.test_page_data import URDF
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform
from vrs_cli.net.http import ServedPage
from vrs_cli.net.local_server import HERE, LocalServer, PagePlace
from vrs_cli.net.messages import (
    Alarm,
    At,
    BodyStatus,
    Closing,
    Delta,
    Done,
    Drag,
    Embody,
    Hello,
    Line,
    Measured,
    MeasuredWindow,
    Measurements,
    Replaced,
    ShownMeasured,
    Subscribe,
    Welcome,
)
from vrs_cli.net.mirror import Mirror
from vrs_cli.net.relay import LookAhead, PreviewMessage, Relay
from vrs_cli.net.tokens import add_tokens
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import Go, Goal
from vrs_cli.values.measured import DivergenceAlarm, DivergenceCause
from vrs_cli.values.world import SpanKind
from vrs_cli.wire.cells import cell_record
from vrs_cli.wire.codec import to_json
from vrs_cli.wire.records import Form, Motions, delta_of
from vrs_cli.world.course import World

SECRET = "a secret of the address"
HELLO = Hello((1,), SECRET, attended=True)


@contextmanager
def relayed(address: str, **options: object) -> Iterator[str]:
    """The address of a relay to the robot at an address."""
    told = list[str]()
    relay = Relay(address, "cell1", SECRET, **options)  # type: ignore[arg-type]
    server = LocalServer(PagePlace(HERE, SECRET, ServedPage({})), relays={"cell1": relay}, tell=told.append)
    try:
        yield f"{server.address}/robots/cell1"
    finally:
        server.close()
    assert told == []


class Page(Caller):
    """A page: it holds the timeline, and applies what is predicted as a page does."""

    def __init__(self, address: str, **options: object) -> None:
        super().__init__(address, HELLO, **options)  # type: ignore[arg-type]
        self.ask(lambda id: Subscribe(id, deltas=True))

    @property
    def previews(self) -> list[PreviewMessage]:
        said = [decode(frame) for frame in self.frames]
        return [convert(one, PreviewMessage) for one in said if one["type"] == "preview"]

    def preview(self) -> PreviewMessage:
        """The next one."""
        before = len(self.previews)
        while len(self.previews) == before:
            self.read()
        return self.previews[-1]

    def shown(self, holds: Callable[[PreviewMessage], object]) -> PreviewMessage:
        """Return the last preview, as soon as it is so; it may have come before the answer to `subscribe`."""
        while not (self.previews and holds(self.previews[-1])):
            self.read()
        return self.previews[-1]

    def drag(self, pose: Transform) -> None:
        self.protocol.send(Drag(pose))
        self.flush()

    def read(self) -> None:
        self.frames.append(self.socket.recv(timeout=PATIENCE))
        self.heard += self.protocol.receive(self.frames[-1])
        self.flush()


def _got(address: str) -> tuple[int, bytes]:
    try:
        with urlopen(address) as answer:
            return answer.status, answer.read()
    except HTTPError as error:
        return error.code, error.read()


def predicted(mirror: Mirror, preview: PreviewMessage) -> Timeline:
    """The timeline after the deltas of a preview, for a mirror that is at the same change."""
    form, motions, timeline = Form.of(mirror.arm), Motions(), mirror.timeline
    assert preview.number == mirror.seq
    for record in preview.deltas:
        timeline = timeline.apply(delta_of(record, motions, form))
    return timeline


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Serving]:
    with serving(tmp_path, realtime=1.0, journal=False) as it:
        yield it


def test_frames_pass_and_the_token_is_added(tmp_path: Path) -> None:
    tokens = tmp_path / "tokens.toml"
    token = add_tokens(tokens, ["ada"])["ada"]
    with (
        serving(tmp_path, tokens=tokens) as it,
        relayed(it.address, token=token, name="nobody") as address,
        Page(address) as page,
        Page(address) as other,
    ):
        names = [one.heard[0].name for one in (page, other)]  # type: ignore[attr-defined]
        assert names == ["ada", "ada-2"], "each page is a holder of its own"
        page.lines("DO x = 3", "TYPE x")
        assert "3" in "".join(page.said)


@pytest.mark.parametrize("secret", ["", "a token that is wrong", SECRET[:-1]])
def test_without_the_secret_nothing_is_relayed(robot: Serving, secret: str) -> None:
    with relayed(robot.address) as address:
        caller = Caller(address, Hello((1,), secret))
        closing = caller.heard[-1]
        assert isinstance(closing, Closing)
        assert closing.refusal is not None
        assert "the secret of its address" in closing.refusal.message
    assert not robot.hub.rooms["cell1"].clients


@pytest.mark.parametrize("said", ['{"type":"bye"}', "no JSON", "[" * 100_000])
def test_what_is_no_hello_is_refused(robot: Serving, said: str) -> None:
    with relayed(robot.address) as address, connect(address) as socket:
        socket.send(said)
        assert decode(socket.recv(timeout=PATIENCE))["type"] == "closing"


def test_a_robot_that_is_not_there_is_told_and_tried_again(tmp_path: Path) -> None:
    with serving(tmp_path) as it:
        gone = it.address
    with relayed(gone) as address:
        for _ in range(2):
            closing = Caller(address, HELLO).heard[-1]
            assert isinstance(closing, Closing)
            assert closing.refusal is None, "the page connects again"
            assert f"{gone} does not answer: connection refused" in closing.why


def turn(mirror: Mirror, angle: float, executed: float) -> Go:
    from vrs_cli.engine.position import joints_at

    return Go(Goal(joints=(angle, *joints_at(mirror.arm, mirror.timeline, 0.0)[1:])), executed=executed)


def test_what_is_predicted_is_what_the_robot_does(robot: Serving) -> None:
    """Over 0.15 s each way: before the robot answers, the page has the timeline that the robot then tells."""
    with behind(robot, 0.15, 0.15) as it, relayed(it.address) as address, Page(address) as page:
        mirror = page_mirror(robot, page)
        assert not page.shown(lambda one: one.round_trip).near
        for angle in (0.3, -0.3) * 3:  # until no thread is held up
            begin = robot.hub.rooms["cell1"].session.engine.clock.reached + 1.0
            begin = round(begin * 1024.0) / 1024.0
            id = page.send(lambda id, angle=angle, begin=begin: At(id, turn(mirror, angle, begin)))  # type: ignore[misc]
            seen = page.preview()
            if seen.expected:
                break
        assert [(one.id, one.begin, one.planned) for one in seen.expected] == [(id, begin, True)]
        assert not [one for one in page.heard if isinstance(one, Done) and one.id == id]
        mirror = page_mirror(robot, page)
        guess = predicted(mirror, seen)
        assert guess.end > begin
        page.until(lambda message: isinstance(message, Done) and message.id == id)
        page.shown(lambda one: not one.expected)
        now = page_mirror(robot, page).timeline
        assert [(s.start, s.finish, s.path) for s in guess] == [(s.start, s.finish, s.path) for s in now]


def page_mirror(robot: Serving, page: Page) -> Mirror:
    """What the page knows of the timeline."""
    from vrs_cli.wire.messages import snapshot_of

    arm = robot.hub.rooms["cell1"].session.engine.arm
    form = Form.of(arm)
    replaced = next(one for one in page.heard if isinstance(one, Replaced))
    mirror = Mirror(arm, snapshot_of(replaced.snapshot, form), replaced.number, lambda: 0.0)
    for one in page.heard:
        if isinstance(one, Delta):
            mirror.change(delta_of(one.delta, Motions(), form), one.number)
    return mirror


@pytest.mark.long
def test_what_was_shown_until_a_change_came_is_flagged(robot: Serving) -> None:
    with robot.call() as near, behind(robot, 0.15, 0.15) as it, relayed(it.address) as address, Page(address) as page:
        page.shown(lambda one: one.round_trip)
        near.lines("DRIVE 1, 30")
        page.until(lambda message: isinstance(message, Delta))
        mirror = page_mirror(robot, page)
        flagged = page.shown(lambda one: one.flagged).flagged
        assert len(flagged) == 1
        begin, end = flagged[0]
        assert begin == mirror.timeline[1].start
        assert begin < end


def test_a_line_is_unconfirmed_from_its_arrival_on(robot: Serving) -> None:
    with behind(robot, 0.1, 0.1) as it, relayed(it.address) as address, Page(address) as page:
        page.shown(lambda one: one.round_trip)
        id = page.send(lambda id: Line(id, "DRIVE 1, 30"))
        seen = page.shown(lambda one: one.expected)
        (one,) = seen.expected
        assert (one.id, one.text, one.planned, seen.deltas) == (id, "DRIVE 1, 30", False, ())
        assert one.begin == pytest.approx(one.issued + seen.round_trip / 2.0, abs=1e-3)
        page.until(lambda message: isinstance(message, Done) and message.id == id)
        page.shown(lambda one: not one.expected)


@pytest.mark.long
def test_a_command_that_never_arrives_is_not_expected_for_ever(robot: Serving) -> None:
    with behind(robot, 0.2, 0.2) as it, relayed(it.address) as address, Page(address) as page:
        page.shown(lambda one: one.round_trip)
        page.send(lambda id: Line(id, "DRIVE 1, 30"))
        page.shown(lambda one: one.expected)
        (client,) = robot.hub.rooms["cell1"].clients.values()
        page.cut()
        until(lambda: client.link is None)
        page.connect()
        seen = page.preview()
        while seen.expected:
            seen = page.preview()
        fates = [one for one in page.heard if isinstance(one, Welcome)][-1].fates
        assert len(fates) == 1, "whatever became of it"


@pytest.mark.long
def test_a_tool_that_is_dragged_leaves_nothing_confirmed_but_the_past(robot: Serving) -> None:
    pose = (1.0, 0.0, 0.0, 0.3, 0.0, -1.0, 0.0, 0.3, 0.0, 0.0, -1.0, 0.2)
    with behind(robot, 0.1, 0.1) as it, relayed(it.address) as address, Page(address) as page:
        page.lines("MOVE #PPOINT(0, -45, 180, 0, 45, 0)")
        page.shown(lambda one: one.round_trip)
        page.drag(pose)
        seen = page.shown(lambda seen: [one.text for one in seen.expected] == ["DRAG"])
        while not seen.since_heard:
            page.drag(pose)
            page.read()
            seen = page.previews[-1]


def test_the_user_chooses_how_far_ahead(robot: Serving) -> None:
    with relayed(robot.address, ahead=0.5) as address, Page(address) as page:
        page.shown(lambda one: one.ahead == 0.5)
        for wanted, told in (("auto", "auto"), (-1.0, None), ("soon", None), (2, 2.0), ("present", "present")):
            page.socket.send(to_json(LookAhead(wanted)))
            if told is not None:
                page.shown(lambda one, told=told: one.ahead == told)  # type: ignore[misc]


def test_who_comes_back_after_a_cut_of_the_far_line_goes_on(tmp_path: Path) -> None:
    """The server ends, and another one begins there: the page is told so, and has the new robot."""
    with ExitStack() as before, ExitStack() as stack:
        it = before.enter_context(serving(tmp_path, realtime=1.0))
        page = Page(stack.enter_context(relayed(it.address)))
        port, life = int(it.address.rpartition(":")[2]), page.heard[0].life  # type: ignore[attr-defined]
        before.close()
        closing = page.until(lambda message: isinstance(message, Closing))
        assert isinstance(closing, Closing)
        assert closing.why == "the server ends"
        page.protocol.cut()
        stack.enter_context(serving(tmp_path, realtime=1.0, port=port))
        page.connect()
        welcome = page.until(lambda message: isinstance(message, Welcome))
        assert welcome.life != life  # type: ignore[attr-defined]
        page.until(lambda message: isinstance(message, Replaced))
        page.leave()


def test_meshes_pass_and_nothing_else_does(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    (tmp_path / "box.stl").write_bytes(trimesh.creation.box((0.1, 0.1, 0.1)).export(file_type="stl"))
    (tmp_path / "one.urdf").write_text(URDF)
    with serving(tmp_path, model=load_robot(str(tmp_path / "one.urdf"))) as it, relayed(it.address) as address:
        with Page(address) as page:
            mesh, *_ = [shape["glb"] for shape in page.heard[0].model["shapes"] if "glb" in shape]  # type: ignore[attr-defined]
        local, far = (where.replace("ws:", "http:").removesuffix("/robots/cell1") for where in (address, it.address))
        assert _got(local + mesh) == _got(far + mesh)
        assert _got(f"{local}/robots/cell1/mesh/another.glb") == (404, b"there is no such mesh\n")
        assert _got(f"{local}/robots/cell1/mesh/..%2f..%2f")[0] == 404


# --- a cell that the server does not know -----------------------------------------------------------------------------


def test_parts_are_told_of_a_cell_that_the_server_does_not_know(tmp_path: Path) -> None:
    """For a page that was there and one that comes late; the parts are where the robot takes them."""
    cell = parse_cell(CELL)
    with (
        serving(tmp_path, journal=False) as it,
        relayed(it.address, cell=cell_record(cell)) as address,
        Page(address) as page,
    ):
        page.lines(*LINES)
        timeline = it.hub.rooms["cell1"].session.engine.timeline
        with Page(address) as late:
            for one in (page, late):
                one.ask(lambda id: Subscribe(id, deltas=True, world=True))
                drawn, welcome = DrawnWorld(), one.heard[0]
                assert isinstance(welcome, Welcome)
                assert to_json(welcome.cell) == to_json(cell_record(cell))
                heard = 0
                while drawn.until <= timeline.end:
                    for message in one.heard[heard:]:
                        drawn.hear(message)
                    heard = len(one.heard)
                    if drawn.until <= timeline.end:
                        one.read()
                arm = arm_for(load_robot("puma560"))
                course = World(arm, cell).course(timeline)
                while course.known_until(timeline.end) <= timeline.end:
                    pass
                assert [row.kind for row in drawn.tracks["part", "box"]][:2] == [SpanKind.RESTS, SpanKind.HELD]
                assert tuple(drawn.tracks["part", "box"]) == course.rows(-inf, timeline.end).parts["box"]


def test_the_cell_of_the_server_goes_before_another(tmp_path: Path) -> None:
    with (
        serving(tmp_path, journal=False, cell=parse_cell(CELL)) as it,
        relayed(it.address, cell={}) as address,
        Page(address) as page,
    ):
        welcome = page.heard[0]
        assert isinstance(welcome, Welcome)
        assert to_json(welcome.cell) == to_json(cell_record(parse_cell(CELL)))


def test_what_a_body_measures_comes_to_the_page(robot: Serving) -> None:
    room = robot.hub.rooms["cell1"]
    joints = room.session.engine.model.poses["ready"]
    alarm = DivergenceAlarm(0.2, 1, 0.1, 0.05, DivergenceCause.BLOCKED, "joint 1 does not move", 0.1)
    with relayed(robot.address) as address, Page(address) as page, robot.call(hello=Hello((1,), name="arm")) as arm:
        page.ask(lambda id: Subscribe(id, deltas=True, measured=True))
        arm.ask(Embody)
        arm.protocol.send(Measured(first=0, times=(0.0, 0.1), joints=(joints, joints), sent=0.1))
        arm.flush()
        told = page.until(lambda message: isinstance(message, Measurements))
        assert isinstance(told, Measurements)
        assert (told.times, told.joints) == ((0.0, 0.1), (joints, joints))
        window = page.ask(lambda id: MeasuredWindow(id, 0.05))
        assert isinstance(window, ShownMeasured)
        assert [part.times for part in window.parts] == [(0.1,)]
        room.session.body.tell(alarm)
        told = page.until(lambda message: isinstance(message, Alarm))
        assert isinstance(told, Alarm)
        assert told.alarm == alarm
    names = [one.body.name for one in page.heard if isinstance(one, BodyStatus) and one.body]
    assert set(names) == {"arm"}

"""The simulated body: where it stands, how well it follows, and what disturbances do to it."""

from __future__ import annotations

from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

pytest.importorskip("mujoco")

from tests.robots import KINDS
from vrs_cli.bodies.mujoco_arm import BRAKE, ArmSettings, MujocoArm, SetPoint
from vrs_cli.bodies.scenario import (
    BlockedJoint,
    ClockDrift,
    Disturbance,
    EmergencyStop,
    Payload,
    Push,
    Release,
    SlippingBrake,
)
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.errors import NotAvailable
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.link_data import LinkMasses
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.robot_file import ROBOTS, load_robot, robot_names
from vrs_cli.values.commands import JointTarget, Move
from vrs_cli.values.measured import BodyMode, Report

PUMA = load_robot("puma560")
PLACE: Joints = (0.2, -1.2, 1.0, 0.2, 0.5, 0.1)
MEASURED = sorted(path.stem for path in Path(ROBOTS, "masses").glob("*.toml"))
EXACT = ArmSettings(noise=0.0, resolution=1e-9)


def standing(_: float) -> tuple[Joints, Joints, Joints]:
    return PLACE, (0.0,) * 6, (0.0,) * 6


def swinging(t: float) -> tuple[Joints, Joints, Joints]:
    """All joints swing by 0.3 rad about PLACE, and start at rest."""
    return (
        tuple(x + 0.3 * (1.0 - cos(t)) for x in PLACE),
        (0.3 * sin(t),) * 6,
        (0.3 * cos(t),) * 6,
    )


def arm_at(place: Joints = PLACE, *disturbances: Disturbance, seed: int = 1) -> MujocoArm:
    return MujocoArm(PUMA, seed=seed, joints=place, disturbances=disturbances)


def errors(reports: list[Report], setpoint: SetPoint) -> np.ndarray:
    """Differences (N, n) of reports from set points at their own times."""
    return np.array([np.array(report.joints) - setpoint(report.t)[0] for report in reports])


def with_masses(model: RobotModel) -> RobotModel:
    """The robot with a mass for each link, where nobody says one."""
    return structs.replace(model, masses=tuple(LinkMasses(mass=5.0 / i) for i in range(1, model.joint_count + 1)))


def T_base_flange(arm: MujocoArm) -> Floats:
    """The real pose of the flange (3, 4)."""
    pytest.importorskip("mujoco").mj_kinematics(arm._m, arm._d)
    return np.column_stack([arm._d.xmat[arm._flange].reshape(3, 3), arm._d.xpos[arm._flange]])


@pytest.mark.parametrize("robot", KINDS)
def test_flange_is_where_the_kinematics_have_it(robot: str) -> None:
    model = with_masses(load_robot(robot))
    random = np.random.default_rng(1)
    for _ in range(4):
        q = tuple(random.uniform(model.lower, model.upper).tolist())
        found = T_base_flange(MujocoArm(model, joints=q))
        assert np.max(np.abs(found - np.array(link_frames(model, q)[-1]).reshape(3, 4))) < 1e-12


def test_computed_torque_follows_a_planned_motion() -> None:
    engine = Engine(PUMA)
    engine.begin(Move(JointTarget(PLACE), straight=False), program=False)

    def planned(t: float) -> tuple[Joints, Joints, Joints]:
        found = position_at(engine.arm, engine.timeline, t)
        return found.joints, found.velocity, found.acceleration

    found = MujocoArm(PUMA).advance(engine.end + 0.2, planned)
    assert len(found) == round((engine.end + 0.2) * 100)
    assert np.max(np.abs(errors(found, planned))) < radians(0.05)
    late = MujocoArm(PUMA, controller="pd").advance(engine.end + 0.2, planned)
    assert radians(0.1) < np.max(np.abs(errors(late, planned))) < radians(3.0)


@pytest.mark.parametrize("robot", MEASURED)
def test_robots_with_masses_follow_s_curves_to_a_twentieth_of_a_degree(robot: str) -> None:
    model, random = structs.replace(load_robot(robot), profile="SCURVE"), np.random.default_rng(2)
    engine, ready = Engine(model), np.array(model.poses["ready"])
    low, high = (np.clip(ends, ready - 0.8, ready + 0.8) for ends in (model.lower, model.upper))
    for q in (random.uniform(low, high), ready):
        engine.begin(Move(JointTarget(tuple(q.tolist())), straight=False), program=False)

    def planned(t: float) -> tuple[Joints, Joints, Joints]:
        found = position_at(engine.arm, engine.timeline, t)
        return found.joints, found.velocity, found.acceleration

    found = MujocoArm(model, seed=1).advance(engine.end + 0.2, planned)
    assert np.max(np.abs(errors(found, planned))) < radians(0.05)


def test_same_seed_gives_the_same_reports() -> None:
    one, same, other = (arm_at(seed=seed).advance(0.3, swinging) for seed in (1, 1, 2))
    assert one == same
    assert one != other


def test_reports_do_not_depend_on_how_time_goes() -> None:
    whole, parts = arm_at(), arm_at()
    wanted = whole.advance(0.4, swinging)
    found = [report for k in range(1, 41) for report in parts.advance(0.01 * k, swinging)]
    assert found == wanted


def test_encoders_have_a_resolution_and_noise() -> None:
    arm = MujocoArm(PUMA, joints=PLACE, settings=ArmSettings(resolution=1e-3, noise=0.0))
    for report in arm.advance(0.2, standing):
        counts = np.array(report.joints) / 1e-3
        assert counts == pytest.approx(np.rint(counts), abs=1e-9)
    noisy = MujocoArm(PUMA, joints=PLACE, seed=3, settings=ArmSettings(resolution=1e-9, noise=1e-4))
    spread = np.std([report.joints[5] for report in noisy.advance(3.0, standing)][50:])
    assert 0.7e-4 < spread < 2e-4


def test_it_comes_to_its_set_point_gently() -> None:
    arm = arm_at((0.5, -1.5, 1.3, 0.0, 0.0, 0.0))
    found = arm.advance(3.0, standing)
    fastest = np.max(np.abs([report.velocity for report in found]), axis=0)
    assert np.all(fastest < np.array(PUMA.max_velocity))
    assert np.max(np.abs(errors(found[-20:], standing))) < radians(0.05)


def test_order_to_hold_stops_it_and_to_follow_brings_it_back() -> None:
    arm = arm_at()
    arm.advance(1.0, swinging)
    arm.order(BodyMode.HOLDS)
    held = arm.advance(2.0, swinging)
    assert {report.mode for report in held} == {BodyMode.HOLDS}
    assert np.max(np.ptp([report.joints for report in held[50:]], axis=0)) < 5e-4
    arm.order(BodyMode.FOLLOWS)
    arm.advance(4.0, swinging)
    assert np.max(np.abs(errors(arm.advance(5.0, swinging), swinging))) < radians(0.05)


def test_push_moves_it_aside_for_a_while() -> None:
    arm = arm_at(PLACE, Push(at=0.5, lasting=0.2, force=(0.0, 60.0, 0.0)))
    before, during, after = (arm.advance(t, standing) for t in (0.5, 0.7, 1.5))
    assert np.max(np.abs(errors(before, standing))) < radians(0.03)
    assert np.max(np.abs(errors(during, standing))) > radians(0.06)
    assert np.max(np.abs(errors(after[-30:], standing))) < radians(0.1)  # dry friction


def test_a_push_ends_when_it_is_released() -> None:
    arm = arm_at()
    arm.disturb(Push(force=(0.0, 300.0, 0.0)))
    pushed = arm.advance(0.5, standing)
    arm.disturb(Release(Push))
    after = arm.advance(1.5, standing)
    assert np.max(np.abs(errors(pushed[-30:], standing))) > radians(1.0)
    assert np.max(np.abs(errors(after[-30:], standing))) < radians(0.3)  # dry friction


def test_push_at_a_joint_is_the_torque_that_its_motor_gives_against_it() -> None:
    arm = MujocoArm(PUMA, joints=PLACE, settings=EXACT)
    before = arm.advance(1.0, standing)[-1].effort
    arm.disturb(Push(joint=2, torque=60.0))
    after = arm.advance(3.0, standing)[-1].effort
    assert before is not None
    assert after is not None
    friction = float(arm.inertial.coulomb[1])  # holds a part of it
    assert 60.0 - 2.0 * friction < before[1] - after[1] < 60.0 + 2.0 * friction


def test_payload_loads_the_joints_as_its_weight() -> None:
    """The torque that 2 kg ask for is that of their weight at the flange, beside dry friction."""
    level: Joints = (0.0, 0.0, radians(90.0), 0.0, 0.0, 0.0)

    def level_point(_: float) -> tuple[Joints, Joints, Joints]:
        return level, (0.0,) * 6, (0.0,) * 6

    arm = MujocoArm(PUMA, joints=level, settings=EXACT)
    before = arm.advance(1.0, level_point)[-1].effort
    arm.disturb(Payload(mass=2.0))
    after = arm.advance(3.0, level_point)[-1].effort
    assert before is not None
    assert after is not None
    reach = float(T_base_flange(arm)[0, 3])
    assert abs(after[1] - before[1]) == pytest.approx(2.0 * 9.81 * reach, abs=2.0 * float(arm.inertial.coulomb[1]))
    arm.disturb(Release(Payload))
    arm.advance(5.0, level_point)
    assert np.max(np.abs(errors(arm.advance(5.5, level_point), level_point))) < radians(0.1)


def test_blocked_joint_stays_and_its_motor_pushes_no_more_than_it_can() -> None:
    arm = arm_at()
    arm.advance(0.5, swinging)
    arm.disturb(BlockedJoint(joint=3))
    stands = arm.joints[2]
    found = arm.advance(3.0, swinging)
    assert arm.joints[2] == pytest.approx(stands, abs=1e-6)
    efforts = np.abs([report.effort for report in found])
    assert np.all(efforts <= arm.inertial.max_torque)
    assert np.max(efforts[:, 2]) == pytest.approx(arm.inertial.max_torque[2])
    arm.disturb(Release(BlockedJoint))
    arm.advance(4.0, swinging)
    assert np.max(np.abs(errors(arm.advance(5.0, swinging), swinging))) < radians(0.05)


def test_emergency_stop_holds_by_brakes_until_it_is_released_and_ordered_to_follow() -> None:
    arm = arm_at(PLACE, EmergencyStop(at=1.0, lasting=2.0))
    arm.advance(1.3, swinging)
    stands = arm.joints
    stopped = arm.advance(3.0, swinging)
    assert {report.mode for report in stopped} == {BodyMode.STOPPED}
    assert all(report.effort == (0.0,) * 6 for report in stopped)
    assert arm.joints == pytest.approx(stands, abs=1e-6)
    assert stopped[-1].joints == pytest.approx(stands, abs=5e-4)
    arm.order(BodyMode.FOLLOWS)  # too early: its stop is still on
    held = arm.advance(4.0, swinging)
    assert {report.mode for report in held[1:]} == {BodyMode.HOLDS}
    assert arm.joints == pytest.approx(stands, abs=radians(0.1))
    arm.order(BodyMode.FOLLOWS)
    arm.advance(6.0, swinging)
    assert np.max(np.abs(errors(arm.advance(7.0, swinging), swinging))) < radians(0.05)


def test_brake_that_slips_lets_its_joint_sink() -> None:
    level: Joints = (0.0, radians(-30.0), radians(90.0), 0.0, 0.0, 0.0)
    held, slips = (arm_at(level, *extra) for extra in ((), (SlippingBrake(joint=2, torque=20.0),)))
    for arm in (held, slips):
        arm.disturb(EmergencyStop())
        arm.advance(1.0, standing)
    assert held.joints == pytest.approx(level, abs=1e-3)
    assert slips.joints[1] > level[1] + radians(3.0)  # down
    assert BRAKE * held.inertial.max_torque[1] > 20.0
    slips.advance(20.0, standing)
    assert slips.joints[1] < PUMA.upper[1] + radians(3.0)  # the end stop


def test_clock_that_drifts_stamps_its_reports_and_follows_by_it() -> None:
    arm = arm_at(PLACE, ClockDrift(at=1.0, rate=0.01, jump=0.5))
    found = arm.advance(3.0, swinging)
    assert found[99].t == pytest.approx(1.0)
    assert found[-1].t == pytest.approx(3.52)
    assert np.max(np.abs(errors(found[200:], swinging))) < radians(0.1)


@pytest.mark.parametrize("robot", [name for name in robot_names() if name not in MEASURED])
def test_robots_without_masses_are_refused(robot: str) -> None:
    with pytest.raises(NotAvailable, match="mass of links 1, 2"):
        MujocoArm(load_robot(robot))

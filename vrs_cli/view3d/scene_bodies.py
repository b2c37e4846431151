"""The parts, fixtures and sensors of a cell in a scene: parts where the world's course says, sensors
lit while something is in their regions.
"""

from __future__ import annotations

from viser import MeshHandle, SceneApi

from vrs_cli.kinematics.shapes import Box, Capsule, Cylinder
from vrs_cli.kinematics.transform import along
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.scene import (
    Beam,
    BoxShape,
    Colour,
    CylinderShape,
    Fixture,
    MeshShape,
    Proximity,
    ScenePart,
    Sensor,
    Shape,
    SphereShape,
    Zone,
)
from vrs_cli.view3d.meshes import Mesh, hull, joined, mesh_of
from vrs_cli.view3d.parts import Rooted, Shown, place, put
from vrs_cli.world.world import World

LIT, DARK = (255, 196, 0), (96, 110, 128)  # of sensors
LIT_OPACITY, DARK_OPACITY = 0.75, 0.25
THIN = 0.003  # [m] the least radius at which a beam is seen


class SceneBodies(Rooted):
    """Nodes /cell/NAME of parts and fixtures, /cell/sensors/NUMBER of sensors."""

    def __init__(self, scene: SceneApi, world: World) -> None:
        self._scene, self._world = scene, world
        self._root = scene.add_frame("/cell", show_axes=False)
        around = world.settings.scene
        bodies: list[Fixture | ScenePart] = [*around.fixtures, *around.parts]
        self._own = {one.name: _rgb(one.colour) for one in bodies}
        self._bodies = {one.name: self._body(one.name, one.shape) for one in bodies}
        for fixture in around.fixtures:
            place(self._bodies[fixture.name], fixture.T_world_fixture)
        self._sensors = [(one, self._sensor(f"/cell/sensors/{k}", one)) for k, one in enumerate(around.sensors)]
        self._drawn: tuple[Timeline, float] | None = None

    def _body(self, name: str, shape: Shape) -> MeshHandle:
        mesh, colour = shape_mesh(shape), self._own[name]
        return self._scene.add_mesh_simple(
            f"/cell/{name}", mesh.vertices, mesh.faces, color=colour, side="front", receive_shadow=False
        )

    def _sensor(self, node: str, sensor: Sensor) -> MeshHandle:
        mesh = region_mesh(sensor.region)
        handle = self._scene.add_mesh_simple(
            node, mesh.vertices, mesh.faces, color=DARK, opacity=DARK_OPACITY, cast_shadow=False, receive_shadow=False
        )
        if isinstance(sensor.region, Zone):
            place(handle, sensor.region.T_world_zone)
        return handle

    def show(self, shown: Shown) -> None:
        if self._drawn is not None and self._drawn[0] is shown.timeline and self._drawn[1] == shown.t:
            return
        self._drawn = shown.timeline, shown.t
        course = self._world.course(shown.timeline)
        for name in course.parts():
            node, state = self._bodies[name], course.state(name, shown.t)
            put(node, visible=state.exists)
            if state.exists:
                place(node, state.pose)
        for sensor, node in self._sensors:
            on = bool(course.signal(abs(sensor.signal), shown.t)) is (sensor.signal > 0)
            put(node, color=LIT if on else DARK, opacity=LIT_OPACITY if on else DARK_OPACITY)

    def paint(self, name: str, colour: tuple[int, int, int] | None) -> None:
        """Paint a part or a fixture; None: in its own colour."""
        put(self._bodies[name], color=colour or self._own[name])


def _rgb(colour: Colour) -> tuple[int, int, int]:
    red, green, blue = (round(255 * part) for part in colour)
    return red, green, blue


def shape_mesh(shape: Shape) -> Mesh:
    """The surface of a part or a fixture, in its own frame."""
    match shape:
        case BoxShape(size):
            return mesh_of(Box(size))
        case CylinderShape(radius, height):
            return mesh_of(Cylinder((0.0, 0.0, -0.5 * height), (0.0, 0.0, 0.5 * height), (radius, radius)))
        case SphereShape(radius):
            return mesh_of(Capsule((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (radius, radius)))
        case MeshShape(pieces):
            return joined([hull(points) for points in pieces])


def region_mesh(region: Beam | Zone | Proximity) -> Mesh:
    """The surface of what a sensor sees; that of a thin beam is thicker. A box stands in its own frame."""
    match region:
        case Zone():
            return mesh_of(Box(region.size))
        case Beam():
            begin, end = region.begin, region.end
        case Proximity():
            begin, end = region.place, along(region.place, region.direction, region.range)
    radius = max(region.radius, THIN)
    return mesh_of(Capsule(begin, end, (radius, radius)))

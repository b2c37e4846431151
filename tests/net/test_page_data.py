"""Clients are told what a robot looks like: its shapes, and where its meshes are as GLB, with their colours."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

from tests.net.serving import Serving, serving
from vrs_cli.kinematics.bodies import shapes_of
from vrs_cli.kinematics.link_data import MeshFile
from vrs_cli.kinematics.model_data import from_dict
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.messages import Welcome

URDF = """<robot name="two">
  <link name="base"><visual><geometry><mesh filename="box.stl"/></geometry></visual></link>
  <link name="upper"><visual><geometry><mesh filename="red.obj" scale="0.5 0.5 0.5"/></geometry></visual></link>
  <link name="lower"><visual><geometry><mesh filename="box.stl"/></geometry>
    <material name="m"><color rgba="0 0.4 0 1"/></material></visual></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
</robot>"""
MATERIAL = "newmtl red\nKd 1 0 0\n"


def _address(server: Serving, path: str) -> str:
    return server.address.replace("ws:", "http:") + path


def _status(address: str) -> int:
    try:
        with urlopen(address) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def test_the_welcome_has_the_shapes_of_a_built_in_robot(tmp_path: Path) -> None:
    with serving(tmp_path) as server, server.call() as ada:
        welcome = ada.heard[0]
        assert isinstance(welcome, Welcome)
        known = load_robot("puma560")
        assert from_dict(json.loads(json.dumps(welcome.model))).shapes == shapes_of(known)


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """The folder of a robot whose links have a plain mesh, one with colours of its own, and one painted by the URDF."""
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "box.stl").write_bytes(box.export(file_type="stl"))
    rows = [*(f"v {x} {y} {z}" for x, y, z in box.vertices), *("f {} {} {}".format(*face + 1) for face in box.faces)]
    (folder / "red.obj").write_text("\n".join(["mtllib red.mtl", "usemtl red", *rows, ""]))
    (folder / "red.mtl").write_text(MATERIAL)
    (folder / "two.urdf").write_text(URDF)
    return folder


def test_meshes_are_served_in_metres_and_in_their_colours(tmp_path: Path, robot: Path) -> None:
    import trimesh

    model = load_robot(robot / "two.urdf")
    with serving(tmp_path, model=model) as server, server.call() as ada:
        welcome = ada.heard[0]
        assert isinstance(welcome, Welcome)
        shapes = {table["link"]: table for table in welcome.model["shapes"]}
        colours = {}
        for link, table in shapes.items():
            assert table["file"] in ("box.stl", "red.obj"), "the server's folders are nobody's business"
            with urlopen(_address(server, table["glb"])) as answer:
                assert answer.headers["Content-Type"] == "model/gltf-binary"
                scene = trimesh.load_scene(BytesIO(answer.read()), file_type="glb")
            (mesh,) = scene.geometry.values()
            colours[link] = tuple(int(x) for x in mesh.visual.material.main_color[:3])
            assert max(mesh.extents) == pytest.approx(0.05 if link == 1 else 0.1)
        grey = (176, 181, 188)
        assert colours == {0: grey, 1: (255, 0, 0), 2: (0, 102, 0)}
        glb = shapes[0]["glb"]
        assert _status(_address(server, glb)) == 200
        for wrong in (glb[:-6] + "0.glb", "/robots/cell1/mesh/../../x", "/robots/none" + glb[13:], "/mesh/x"):
            assert _status(_address(server, wrong)) == 404


def test_a_mesh_that_cannot_be_read_is_a_link_of_capsules(tmp_path: Path, robot: Path) -> None:
    (robot / "red.obj").unlink()
    model = load_robot(robot / "two.urdf")
    with serving(tmp_path, model=model) as server, server.call() as ada:
        welcome = ada.heard[0]
        assert isinstance(welcome, Welcome)
        assert {table["link"]: table["kind"] for table in welcome.model["shapes"]} == {
            0: "mesh",
            1: "capsule",
            2: "mesh",
        }


def test_a_damaged_mesh_is_not_found_and_told_to_who_serves(tmp_path: Path, robot: Path) -> None:
    (robot / "red.obj").write_text("v nan nan nan\n")
    with serving(tmp_path, model=load_robot(robot / "two.urdf")) as server, server.call() as ada:
        welcome = ada.heard[0]
        assert isinstance(welcome, Welcome)
        (address,) = (table["glb"] for table in welcome.model["shapes"] if table["link"] == 1)
        assert _status(_address(server, address)) == 404
        assert any("red.obj" in line for line in server.told)


def test_a_mesh_reads_no_file_outside_its_package(tmp_path: Path, robot: Path) -> None:
    pytest.importorskip("trimesh")
    from vrs_cli.files.mesh_file import glb_of

    (tmp_path.parent / "secret.mtl").write_text(MATERIAL)
    try:
        (robot / "red.obj").write_text((robot / "red.obj").read_text().replace("red.mtl", "../../../secret.mtl"))
        (body,) = (one.body for one in shapes_of(load_robot(robot / "two.urdf")) if one.link == 1)
        assert isinstance(body, MeshFile)
        found = glb_of(Path(body.path), body.scale, (1, 2, 3))
        assert b"1.0,0.0,0.0" not in found.replace(b" ", b"")
    finally:
        (tmp_path.parent / "secret.mtl").unlink()

"""Test rare states of the page: meshes with textures, a resting cell, a resized column."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.net.serving import serving
from tests.page.browser import line, open_robot, until
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.http import ServedPage
from vrs_cli.render.text import styled_lines

if TYPE_CHECKING:
    from playwright.sync_api import Page

JOINT = """<link name="link{1}"/><joint name="joint{1}" type="revolute"><parent link="link{0}"/><child link="link{1}"/>
<origin xyz="0.3 0 {2}"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1" effort="1"/></joint>"""
URDF = f"""<robot name="textured"><link name="link0">
<visual><geometry><mesh filename="box.glb"/></geometry></visual></link>
{JOINT.format(0, 1, 0.4)}{JOINT.format(1, 2, 0)}{JOINT.format(2, 3, 0)}</robot>"""
CELL = """
[[part]]
name = "box"
shape = "box"
size = [40, 40, 60]
at = [0, 550, -250]
"""
TEXTURES = """(() => {
    const found = [];
    scene.figure.root.traverse((one) => one.material?.map && found.push(one.material.map.image?.width));
    return found;
})()"""
CHANGES = """(() => {
    window.changes = {};
    new MutationObserver((rows) => {
        for (const { target } of rows) {
            const name = target.className || target.nodeName.toLowerCase();
            changes[name] = (changes[name] ?? 0) + 1;
        }
    }).observe(document.body, { subtree: true, childList: true, attributes: true, characterData: true });
})()"""
SAID = "document.querySelector('[data-slot=output]').innerText"


@pytest.mark.long
def test_a_mesh_has_its_texture(page: Page, built: Path, tmp_path: Path) -> None:
    trimesh, image = pytest.importorskip("trimesh"), pytest.importorskip("PIL.Image")
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    corners = [[x > 0, y > 0] for x, y, _ in box.vertices]
    box.visual = trimesh.visual.TextureVisuals(uv=corners, image=image.new("RGB", (8, 8), "orange"))
    box.export(tmp_path / "box.glb")
    (tmp_path / "textured.urdf").write_text(URDF)
    model = load_robot(str(tmp_path / "textured.urdf"))
    with serving(tmp_path, pages=ServedPage.read(built), model=model) as served:
        open_robot(page, served)
        until(page, f"{TEXTURES}.length === 1 && {TEXTURES}[0] === 8")


def test_a_page_at_rest_writes_the_time_alone_and_draws_nothing(page: Page, built: Path, tmp_path: Path) -> None:
    with serving(tmp_path, pages=ServedPage.read(built), realtime=1.0, cell=parse_cell(CELL)) as served:
        open_robot(page, served)
        until(page, "app.source.world.version > 0")
        page.evaluate("window.shows = 0; app.add({ show: () => window.shows++ })")
        until(page, "shows > 2")
        page.evaluate(CHANGES)
        page.evaluate("window.before = scene.stage.pictures; window.shows = 0")
        until(page, "shows > 2")
        changes = page.evaluate("changes")
        assert set(changes) <= {"clock", "number", "number muted", "cursor", "strip", "canvas", "present"}
        assert sum(changes.values()) <= 40
        assert page.evaluate("scene.stage.pictures - before") == 0


@pytest.mark.long
def test_replies_are_drawn_for_the_column_as_it_is_now(page: Page, built: Path, tmp_path: Path) -> None:
    with serving(tmp_path, pages=ServedPage.read(built), styled=styled_lines) as served:
        open_robot(page, served)
        until(page, f"typeof {SAID} === 'string'")
        line(page, "WHERE")
        until(page, f"{SAID}.split('\\n').filter((one) => /JT|X/.test(one)).length > 2")
        page.evaluate("document.documentElement.style.setProperty('--side', '700px')")
        until(page, "app.connection.columns > 60")
        line(page, "WHERE")
        until(page, f"/JT1 .* JT6/.test({SAID})")

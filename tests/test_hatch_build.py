"""The hook of the build compiles modules only if it is asked to. `.ci/run` runs all tests on compiled modules."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.skipif(not (ROOT / "vrs_cli" / "hatch_build.py").is_file(), reason="this is no checkout")
if (ROOT / "vrs_cli" / "hatch_build.py").is_file():
    from vrs_cli import hatch_build

NAME = "engine/load"


class FakeApp:
    """A fake of hatch's application."""

    def abort(self, text: str) -> None:
        sys.exit(text)


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder that the hook takes for the package. Its build of C code makes one empty file."""

    def compiled(work: Path) -> Path:
        (work / "built" / "engine").mkdir(parents=True)
        (work / "built" / f"{NAME}{hatch_build.EXTENSION_SUFFIXES[0]}").touch()
        return work / "built"

    monkeypatch.setattr(hatch_build, "HERE", tmp_path)
    monkeypatch.setattr(hatch_build, "compile_modules", compiled)
    monkeypatch.setattr(hatch_build, "missing_tool", lambda: "")
    monkeypatch.setenv("VRS_NO_PAGE", "1")
    monkeypatch.setenv("VRS_COMPILED", "1")
    (tmp_path / "engine").mkdir()
    return tmp_path


def hook(target: str = "wheel") -> Any:
    metadata = SimpleNamespace(core=SimpleNamespace(dependencies=["msgspec"]))
    return hatch_build.BuildHook(str(ROOT), {}, None, metadata, "", target, FakeApp())


def built(version: str) -> dict[str, Any]:
    """What the hook tells hatch."""
    data: dict[str, Any] = {"artifacts": [], "force_include": {}}
    made = hook()
    made.initialize(version, data)
    made.finalize(version, data, "")
    return data


def extensions(package: Path) -> list[str]:
    return [path.name for path in package.glob(f"{NAME}.*")]


def test_the_modules_are_there() -> None:
    assert [name for name in hatch_build.MODULES if not (ROOT / "vrs_cli" / f"{name}.py").is_file()] == []


def test_a_wheel_with_compiled_modules_fits_one_platform(package: Path) -> None:
    data = built("standard")
    assert (data["pure_python"], data["infer_tag"]) == (False, True)
    assert list(data["force_include"].values()) == ["vrs_cli"]
    assert extensions(package) == []
    assert [word for word in hook().dependencies() if word.startswith(("mypy", "msgspec"))] == [
        *hatch_build.REQUIREMENTS,
        "msgspec",
    ]
    assert hook("sdist").dependencies() == []


def test_an_editable_installation_has_or_loses_them_beside_the_sources(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert built("editable")["force_include"] == {}
    assert extensions(package) == [Path(NAME).name + hatch_build.EXTENSION_SUFFIXES[0]]
    monkeypatch.delenv("VRS_COMPILED")
    assert built("editable") == {"artifacts": [], "force_include": {}}
    assert extensions(package) == []


def test_a_build_is_pure_unless_it_is_asked_for(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VRS_COMPILED")
    assert built("standard") == {"artifacts": [], "force_include": {}}
    assert hook().dependencies() == []
    assert extensions(package) == []


@pytest.mark.parametrize("lacks", ["compiler", "headers"])
def test_what_a_build_lacks_is_told_in_one_message(
    lacks: str, package: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.undo()
    monkeypatch.setenv("VRS_NO_PAGE", "1")
    monkeypatch.setenv("VRS_COMPILED", "1")
    monkeypatch.setenv("CC", "no-such-compiler" if lacks == "compiler" else f"{sys.executable} -O2")
    if lacks == "headers":
        monkeypatch.setattr(hatch_build.sysconfig, "get_path", lambda _: str(tmp_path))
    with pytest.raises(SystemExit, match=r"needs .*(no-such-compiler|Python\.h).* pure Python\.$"):
        built("standard")
    assert extensions(package) == []

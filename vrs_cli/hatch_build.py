"""Build the parts of the package that are not Python code, as a hook of hatch: the page of the browser and, with
`VRS_COMPILED=1`, the `MODULES` as extension modules in C, which mypyc makes of their Python code.

A wheel then fits one platform and one version of Python. An editable installation has the extension modules beside
their sources; it ignores changes of these sources until it is installed again. Without `VRS_COMPILED` an editable
installation removes extension modules. The wheel contains the sources of compiled modules too: tracebacks show them,
and `kinematics/formula.py` derives array functions from them.
"""

from __future__ import annotations

import os
import shutil
import sys
import sysconfig
import tempfile
from contextlib import chdir
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # hatch runs this file, but does not import it

from vrs_cli.page import hatch_build as page  # noqa: E402

MODULES = (  # the inner loops of straight lines and of motion laws
    "kinematics/spherical_wrist/inverse",
    "trajectory/polynomial",
    "trajectory/laws/law",
    "trajectory/laws/lspb",
    "trajectory/laws/scurve",
    "trajectory/laws/scurve_joints",
    "engine/following",
    "engine/load",
    "engine/boundary",
    "engine/straight",
)
LIBRARY = "compiled__mypyc"  # the extension module with the code of all MODULES
REQUIREMENTS = ("mypy[mypyc]>=2.4,<3",)
TYPES = """\
[mypy]
strict = true
follow_imports = silent
[mypy-vrs_cli.api.*,vrs_cli.interfaces.*,vrs_cli.lab.*]
follow_imports = skip
"""  # configuration of mypy: read only types that MODULES use, not those of all names in `vrs_cli/__init__.pyi`
EXACT = "-ffp-contract=off"  # option of C compilers: round each product, as Python does


def missing_tool() -> str:
    """Return what a build in C needs and this machine lacks; "" if nothing is known to be missing."""
    words = (os.environ.get("CC") or sysconfig.get_config_var("CC") or "").split()
    if words and shutil.which(words[0]) is None:
        return f"a C compiler: there is no {words[0]} (Debian: apt install gcc)"
    header = Path(sysconfig.get_path("include")) / "Python.h"
    return "" if header.is_file() else f"the headers of Python: there is no {header} (Debian: apt install python3-dev)"


def compile_modules(work: Path) -> Path:
    """Compile MODULES in an empty folder. Return the folder of the new files; it has the layout of the package."""
    from mypyc.build import mypycify
    from setuptools import Distribution

    (work / "mypy.ini").write_text(TYPES, encoding="utf-8")
    options = (f"--config-file={work / 'mypy.ini'}", f"--cache-dir={work / 'cache'}")
    files = [f"vrs_cli/{name}.py" for name in MODULES]
    with chdir(HERE.parent):
        group = f"vrs_cli.{LIBRARY.removesuffix('__mypyc')}"
        sources = str(work / "c")
        extensions = mypycify([*options, *files], opt_level="2", debug_level="0", group_name=group, target_dir=sources)
        for extension in extensions if sys.platform != "win32" else ():
            extension.extra_compile_args.append(EXACT)
        command = Distribution({"ext_modules": extensions}).get_command_obj("build_ext")
        command.build_lib, command.build_temp = str(work / "built"), str(work / "temporary")
        command.ensure_finalized()
        command.run()
    return work / "built" / "vrs_cli"


def remove_compiled() -> None:
    """Remove the extension modules beside the sources."""
    for name in (LIBRARY, *MODULES):
        for path in HERE.glob(f"{name}.*{EXTENSION_SUFFIXES[-1]}"):
            path.unlink()


class BuildHook(page.PageHook):
    """The hook that builds the page, and compiles modules for a wheel or an editable installation if it is asked to."""

    def _compiles(self) -> bool:
        return self.target_name == "wheel" and os.environ.get("VRS_COMPILED") == "1"

    def dependencies(self) -> list[str]:
        """Return the packages that the build needs besides hatchling. mypyc reads the types of those that vrs needs."""
        compiling = [*REQUIREMENTS, *self.metadata.core.dependencies] if self._compiles() else []
        return [*super().dependencies(), *compiling]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page, and compile the modules."""
        super().initialize(version, build_data)
        if version == "editable":
            remove_compiled()
        if not self._compiles():
            return
        if missing := missing_tool():
            self.app.abort(f"VRS_COMPILED=1 needs {missing}. Without VRS_COMPILED vrs is installed as pure Python.")
        self.work = tempfile.mkdtemp(prefix="vrs-compiled-")
        built = compile_modules(Path(self.work))
        if version == "editable":
            shutil.copytree(built, HERE, dirs_exist_ok=True)
        else:
            build_data["pure_python"], build_data["infer_tag"] = False, True
            build_data["force_include"][str(built)] = "vrs_cli"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002
        """Remove the temporary files."""
        if self._compiles():
            shutil.rmtree(self.work, ignore_errors=True)

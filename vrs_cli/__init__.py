"""vrs: a VAL-II shell for a virtual robot, and a Python API for this robot.

    import vrs_cli as vrs

    r = vrs.Robot("puma560")
    r.move(0, -45, 180, 0, 45, 0).moves(vrs.trans(300, 450, -200, 90, 90, 0), at=1.0)
    r.sample(rate=100).joints  # (N, 6)

See docs/python.md. Each name is loaded when it is first used, so that the command line starts fast.
"""

from importlib import import_module

from vrs_cli.version import __version__

_HOMES = {  # the module of each public name
    "Robot": "vrs_cli.api.robot",
    "load": "vrs_cli.api.robot",
    "connect": "vrs_cli.api.connection",
    "LeRobotArm": "vrs_cli.api.connection",
    "trans": "vrs_cli.api.location",
    "Location": "vrs_cli.api.location",
    "Posture": "vrs_cli.api.posture",
    "Ways": "vrs_cli.api.posture",
    "Replies": "vrs_cli.api.answers",
    "Explanation": "vrs_cli.api.answers",
    "Picture": "vrs_cli.api.answers",
    "Scene": "vrs_cli.api.answers",
    "Run": "vrs_cli.api.answers",
    "Limits": "vrs_cli.interfaces.tasks.limits",
    "ProgramFailed": "vrs_cli.api.answers",
    "Change": "vrs_cli.api.answers",
    "Measured": "vrs_cli.api.posture",
    "Model": "vrs_cli.api.posture",
    "robots": "vrs_cli.api.posture",
    "Preview": "vrs_cli.api.posture",
    "Dragged": "vrs_cli.api.control",
    "Predictor": "vrs_cli.lab.methods",
    "RemoteController": "vrs_cli.lab.methods",
    "VrsError": "vrs_cli.errors",
    "MotionError": "vrs_cli.errors",
    "ProgramError": "vrs_cli.errors",
    "FileError": "vrs_cli.errors",
    "UsageError": "vrs_cli.errors",
    "FileDamaged": "vrs_cli.errors",
    "IllegalValue": "vrs_cli.errors",
    "JointOutOfRange": "vrs_cli.errors",
    "LeaseHeld": "vrs_cli.errors",
    "LocationOutOfRange": "vrs_cli.errors",
    "NonexistentFile": "vrs_cli.errors",
    "NotPossible": "vrs_cli.errors",
    "ProgramNotExecutable": "vrs_cli.errors",
    "RequestRefused": "vrs_cli.errors",
    "TooLate": "vrs_cli.errors",
    "UndefinedName": "vrs_cli.errors",
    "load_ipython_extension": "vrs_cli.api.connection",
}

__all__ = ["__version__", *(name for name in _HOMES if name != "load_ipython_extension")]  # noqa: PLE0604


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_HOMES[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

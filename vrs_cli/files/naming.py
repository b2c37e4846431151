"""Names of files that are good on every system."""

from __future__ import annotations

# Windows, "Naming Files, Paths, and Namespaces": devices, whatever extension follows, and characters with a meaning
DEVICES = frozenset({"con", "prn", "aux", "nul", "conin$", "conout$"}) | {
    f"{port}{number}" for port in ("com", "lpt") for number in "123456789¹²³"
}
SPECIAL = frozenset('<>:"|?*\\/')


def wrong_name(name: str) -> str:
    """Why a file cannot have that name on every system, empty where it can."""
    stem = name.partition(".")[0].rstrip(" ").lower()
    if stem in DEVICES:
        return f"{stem.upper()} is a device on Windows"
    strange = sorted(SPECIAL & set(name))
    if strange:
        return f"no {strange[0]} can be in the name of a file on Windows"
    if not name.isprintable():
        return "a control character can be in no name"
    if name != name.rstrip(". "):
        return "no name of a file ends in a dot or a blank on Windows"
    return ""

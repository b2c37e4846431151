"""Tokens: who may enter a server, in which role, and which robots each may hold. They are in a TOML file, which is read
again when it has changed:

    [[token]]
    name = "ada"                                # what others see, and what her own robots are called
    sha256 = "9f86d081884c7d65..."              # of the token; or token = "the token itself"
    role = "supervisor"                         # observer, designer, supervisor (default), teacher or body
    robots = ["cell1", "cell2"]                 # default: all that the server was started with
    expires = 2027-07-31                        # default: never

A teacher is a supervisor of every robot, also of those of other tokens. A body is an observer that may be the body of
its `robots`, which may be other tokens' own: follow their timeline and report what it measures. It has no own robots.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import secrets
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from datetime import date, datetime, time, timedelta
from pathlib import Path

from msgspec import Struct

from vrs_cli.errors import FileDamaged, FileError, UsageError
from vrs_cli.files.atomic import write_atomically
from vrs_cli.files.opening import stamp, unreadable, wrong_name
from vrs_cli.language.words.word import Role

BYTES = 24  # random bytes of a token that is made here
SHORTEST = 16  # characters of a token that somebody chose, at least
TEACHER, BODY = "teacher", "body"
ROLES: Mapping[str, Role] = {
    "observer": Role.OBSERVER,
    "designer": Role.DESIGNER | Role.OBSERVER,
    "supervisor": Role.SUPERVISOR,
    TEACHER: Role.SUPERVISOR,
    BODY: Role.OBSERVER,
}
KEYS = ("name", "token", "sha256", "role", "robots", "expires")
_TABLE = re.compile(r"^(?=[ \t]*\[\[[ \t]*token[ \t]*\]\])", re.MULTILINE)  # the beginning of a table
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,39}")
NAME_RULE = "a letter, then letters, digits, _ . and -, 40 at most"
GOOD = "see docs/serve.md"


def good_name(name: str) -> bool:
    """Return whether a token or a robot may have this name: it becomes part of an address and of a file name."""
    return NAME.fullmatch(name) is not None and not wrong_name(name)


class Grant(Struct, frozen=True):
    """The rights of a token. `robots`: the shared robots that it may hold, None for all. `until`: seconds since 1970.
    `body`: it may be the body of its robots.
    Two grants are equal if nothing of them has changed, the token included.
    """

    name: str
    role: Role
    teacher: bool = False
    robots: frozenset[str] | None = None
    until: float | None = None
    digest: bytes = b""
    body: bool = False

    def expired(self, now: float) -> bool:
        return self.until is not None and now >= self.until

    def own_names(self, most: int) -> tuple[str, ...]:
        """The names of the robots that this token has for itself: `ada`, `ada-2`, up to the number `most`; a body has
        none.
        """
        if self.body:
            return ()
        return tuple(self.name if number == 1 else f"{self.name}-{number}" for number in range(1, most + 1))


OPEN = Grant("", Role.SUPERVISOR, teacher=True, body=True)  # for everybody, if a server has no tokens


def digest_of(token: str) -> bytes:
    """Return the hash that is kept and compared. Tokens are long and random, so a plain hash is enough."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).digest()


class Tokens(Struct, frozen=True):
    """All grants of a server."""

    grants: tuple[Grant, ...] = ()

    def find(self, token: str, now: float) -> Grant | None:
        """Return the grant of a token that is valid now. The time that it takes tells nothing about the tokens."""
        asked, found = digest_of(token), None
        for grant in self.grants:
            if hmac.compare_digest(asked, grant.digest):
                found = grant
        return None if found is None or found.expired(now) else found

    def holds(self, grant: Grant, now: float) -> bool:
        """Return whether a grant is still valid and unchanged."""
        return grant in self.grants and not grant.expired(now)


# --- the file -------------------------------------------------------------------------------------------------------


class TokenFile:
    """The tokens of a file, for a server of `robots` at which each token has `own` more. `wrong`: what is wrong with a
    file that has changed; the tokens before the change are valid then. Raises FileError, FileDamaged if the file is
    wrong at first.
    """

    def __init__(self, path: Path, robots: Iterable[str] = (), own: int = 0) -> None:
        self.path = path
        self._robots, self._own = tuple(robots), own
        self._read = self._seen = stamp(path)
        self.tokens = self._found()
        self.wrong = ""

    def look(self) -> bool:
        """Read the file again if it has changed; return whether the tokens are others now. A program that writes a file
        may empty it first: so it is read when it is as at the look before, and taken if it still is after reading.
        """
        mark = stamp(self.path)
        still, self._seen = mark == self._seen, mark
        if mark == self._read or not still:
            return False
        before, found, wrong = self.tokens, self.tokens, ""
        try:
            found = self._found()
        except FileError as error:
            wrong = f"{error}; the tokens read before it was changed still hold"
        if stamp(self.path) != mark:
            return False
        self._read, self.tokens, self.wrong = mark, found, wrong
        return found != before

    def _found(self) -> Tokens:
        """Read the file. Raises FileError, and FileDamaged if a robot that a token has for itself would belong to
        another one too. Names that differ by capital letters alone are the same, as for files on some systems.
        """
        tokens, whose = read_tokens(self.path), {robot.casefold(): "the robot of all" for robot in self._robots}
        for grant in tokens.grants:
            for name in grant.own_names(self._own):
                if (other := whose.get(name.casefold())) is not None:
                    what = f"{self.path}: {grant.name} would have {name} for itself, which is {other}"
                    raise FileDamaged(what, "give the token another name")
                whose[name.casefold()] = f"{grant.name}'s"
        return tokens


def read_tokens(path: Path) -> Tokens:
    """Read a file of tokens. Raises FileError, and FileDamaged, which names the entry and what would be right."""
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except OSError as error:
        raise unreadable(path, error) from None
    except (ValueError, RecursionError) as error:
        raise FileDamaged(f"{path}: {error}", f"tokens are a TOML file: {GOOD}") from None
    rows = data.pop("token", [])
    if data or not isinstance(rows, list):
        raise FileDamaged(f"{path}: {next(iter(data), 'token')}", f"it holds [[token]] tables alone: {GOOD}")
    grants = [_grant(f"{path}: token {number}", row) for number, row in enumerate(rows, start=1)]
    known = set[str | bytes]()
    for grant in grants:
        if known & {grant.name, grant.digest}:
            raise FileDamaged(f"{path}: {grant.name} is there twice", "each token has a name of its own")
        known |= {grant.name, grant.digest}
    return Tokens(tuple(grants))


def _grant(where: str, row: object) -> Grant:
    if not isinstance(row, dict):
        raise FileDamaged(f"{where} is no table", GOOD)
    wrong = next((key for key in row if key not in KEYS), None)
    if wrong is not None:
        raise FileDamaged(f"{where}: {wrong}", f"a token has {', '.join(KEYS)}")
    name = row.get("name")
    if not isinstance(name, str) or not good_name(name):
        raise FileDamaged(f"{where}: name {name!r}", NAME_RULE)
    where = f"{where} ({name})"
    role = row.get("role", "supervisor")
    if role not in ROLES:
        raise FileDamaged(f"{where}: role {role!r}", f"one of {', '.join(ROLES)}")
    robots = row.get("robots")
    if robots is not None and not (isinstance(robots, list) and all(isinstance(one, str) for one in robots)):
        raise FileDamaged(f"{where}: robots {robots!r}", 'names of robots: ["cell1", "cell2"]')
    shared = None if robots is None else frozenset(robots)
    until, digest = _until(where, row.get("expires")), _digest(where, row)
    return Grant(name, ROLES[role], role == TEACHER, shared, until, digest, role == BODY)


def _digest(where: str, row: Mapping[str, object]) -> bytes:
    token, sha256 = row.get("token"), row.get("sha256")
    if (token is None) == (sha256 is None):
        raise FileDamaged(f"{where}", "it has either token or sha256")
    if isinstance(token, str) and len(token) >= SHORTEST:
        return digest_of(token)
    if isinstance(sha256, str) and re.fullmatch("[0-9a-fA-F]{64}", sha256):
        return bytes.fromhex(sha256)
    raise FileDamaged(where, f"a token has {SHORTEST} characters at least, sha256 64 hexadecimal digits")


def _until(where: str, expires: object) -> float | None:
    """Return the end of the named day, or the instant, in the server's time zone if none is named."""
    if expires is None:
        return None
    if isinstance(expires, datetime):
        return expires.timestamp()
    if isinstance(expires, date):
        return datetime.combine(expires + timedelta(days=1), time()).timestamp()
    raise FileDamaged(f"{where}: expires {expires!r}", "a day or an instant: 2027-07-31, 2027-07-31T12:00:00Z")


# --- new ones -------------------------------------------------------------------------------------------------------


def add_tokens(
    path: Path,
    names: Iterable[str],
    role: str = "supervisor",
    robots: Sequence[str] | None = None,
    until: datetime | date | None = None,
    *,
    plain: bool = False,
) -> dict[str, str]:
    """Make a token for each name, all with the same rights, and add their hashes to a file, which is made if need be.
    Return the tokens by name; nobody can find them out later, unless the file has them `plain`. Raises FileError,
    FileDamaged, and UsageError for a name that is there already.
    """
    made, before, known = {name: secrets.token_urlsafe(BYTES) for name in names}, "", set[str]()
    if path.exists():
        known = {grant.name for grant in read_tokens(path).grants}
        before = path.read_text(encoding="utf-8").rstrip("\n")
    else:
        try:
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT, 0o600))  # for nobody else to read
        except OSError as error:
            raise FileError(f"{path} cannot be written: {error.strerror}", "name another place") from None
    if taken := sorted(known & made.keys()):
        raise UsageError(
            f"{path} has a token of {taken[0]} already", "take it out of the file first: it is revoked then"
        )
    given = [f'role = "{role}"']
    if robots is not None:
        listed = ", ".join(f'"{robot}"' for robot in robots)
        given.append(f"robots = [{listed}]")
    if until is not None:
        given.append(f"expires = {until.isoformat()}")
    kept = {
        name: f'token = "{token}"' if plain else f'sha256 = "{digest_of(token).hex()}"' for name, token in made.items()
    }
    heads = (f'[[token]]\nname = "{name}"\n{secret}' for name, secret in kept.items())
    parts = [before, *("\n".join((head, *given)) for head in heads)]
    write_atomically(path, "\n\n".join(part for part in parts if part) + "\n")
    return made


def plain_tokens(path: Path) -> dict[str, str]:
    """Return the tokens that a file has as they are, by name. Raises FileError, FileDamaged."""
    read_tokens(path)
    rows = tomllib.loads(path.read_text(encoding="utf-8")).get("token", [])
    return {row["name"]: row["token"] for row in rows if "token" in row}


def take_out(path: Path, names: Iterable[str]) -> None:
    """Remove the tokens of these names from a file; all else in it stays. Raises FileError, FileDamaged, and UsageError
    for a name that is not there.
    """
    gone = set(names)
    if missing := sorted(gone - {grant.name for grant in read_tokens(path).grants}):
        raise UsageError(f"{path} has no token of {missing[0]}", "nothing is changed")
    head, *tables = _TABLE.split(path.read_text(encoding="utf-8"))
    kept = [table for table in tables if not gone & {row["name"] for row in tomllib.loads(table)["token"]}]
    write_atomically(path, head + "".join(kept))

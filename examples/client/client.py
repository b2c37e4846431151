"""A client of the protocol, written from docs/protocol.md alone: the connection, the timeline and g, in plain Python.

It reads steps from its input and writes answers to its output, as the conformance kit requires:
`python3 -m tests.net.kit run --without scurve,steady,msgpack python3 examples/client/client.py`
"""

import json
import struct
import sys
import zlib
from bisect import bisect_right
from math import ceil, cos, sin

TICK = 2.0**-30  # [s]
NUMBERED = ("told", "typed", "asked", "withdrawn", "done", "refused", "lease")
COUNTS = {"pointing": "111110", "upright": "111001", "position": "111000", "point": "111000"}
IDENTITY = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]

# --- transformations: three rows of four --------------------------------------------------------------------------


def compose(A, B):
    return [
        [sum(A[i][k] * B[k][j] for k in range(3)) + (A[i][3] if j == 3 else 0.0) for j in range(4)] for i in range(3)
    ]


def inverse(T):
    R = [[T[j][i] for j in range(3)] for i in range(3)]
    return [[*R[i], -sum(R[i][k] * T[k][3] for k in range(3))] for i in range(3)]


def turned(axis, angle):
    """A rotation about a unit axis (Rodrigues)."""
    (x, y, z), c, s = axis, cos(angle), sin(angle)
    v = 1.0 - c
    return [
        [c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0.0],
        [y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0.0],
        [z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0.0],
    ]


def polynomial(a, s):
    result = 0.0
    for coefficient in reversed(a):
        result = result * s + coefficient
    return result


# --- the robot ----------------------------------------------------------------------------------------------------


class Robot:
    def __init__(self, model):
        self.joints, self.base = model["joints"], model.get("base", IDENTITY)
        self.flange = model.get("flange", IDENTITY)
        self.counts = COUNTS.get(model.get("task", "pose"), "111111")

    def frames(self, q):
        """T_robot_link of each link, the flange last, and T_robot_joint before each joint."""
        T, before = self.base, []
        for joint, x in zip(self.joints, q, strict=True):
            before.append(T)
            slides = joint.get("kind") == "prismatic"
            theta, d = joint.get("theta", 0.0) + (0.0 if slides else x), joint.get("d", 0.0) + (x if slides else 0.0)
            alpha, a = joint.get("alpha", 0.0), joint.get("a", 0.0)
            c, s, ca, sa = cos(theta), sin(theta), cos(alpha), sin(alpha)
            link = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0.0, sa, ca, d]]
            T = compose(T, link)
        return compose(T, self.flange), before

    def inverse(self, flange, near, guides):
        """Newton's method from `near`, with steps that are damped while they are long."""
        q = list(near)
        for _ in range(100):
            here, before = self.frames(q)
            missing, rows = self._missing(here, flange), [[0.0] * len(q) for _ in range(6)]
            for k, T in enumerate(before):
                axis, arm = [T[i][2] for i in range(3)], [here[i][3] - T[i][3] for i in range(3)]
                slides = self.joints[k].get("kind") == "prismatic"
                column = [*axis, 0.0, 0.0, 0.0] if slides else [*cross(axis, arm), *axis]
                for i in range(6):
                    rows[i][k] = column[i]
            rows, missing = self._counted(here, rows, missing)
            rows += [list(weights) for weights, _ in guides]
            missing += [value - dot(weights, q) for weights, value in guides]
            if max(map(abs, missing)) < 1e-11:
                break
            step = least_squares(rows, missing)
            longest = max(map(abs, step))
            q = [x + dx * min(1.0, 0.3 / longest if longest else 1.0) for x, dx in zip(q, step, strict=True)]
            if longest < 1e-11:
                break
        return q

    def _counted(self, here, rows, missing):
        """Leave out what does not count for the task: of the place, and of turns about the axes of the flange."""
        axes = [[here[i][k] for i in range(3)] for k in range(3)]
        turns = [[dot(axis, column) for column in zip(*rows[3:], strict=True)] for axis in axes]
        about = [dot(axis, missing[3:]) for axis in axes]
        counted = [k for k in range(6) if self.counts[k] == "1"]
        return [[*rows[:3], *turns][k] for k in counted], [[*missing[:3], *about][k] for k in counted]

    @staticmethod
    def _missing(here, there):
        """From one pose to another: the way, and the rotation as the half sum of the cross products of the axes."""
        axes = [([here[i][k] for i in range(3)], [there[i][k] for i in range(3)]) for k in range(3)]
        turn = [sum(cross(a, b)[i] for a, b in axes) * 0.5 for i in range(3)]
        return [there[i][3] - here[i][3] for i in range(3)] + turn


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def least_squares(rows, wanted):
    """The shortest x with rows x = wanted, as near as can be (normal equations, a trace of damping)."""
    n = len(rows[0])
    A = [[sum(r[i] * r[j] for r in rows) + (1e-14 if i == j else 0.0) for j in range(n)] for i in range(n)]
    b = [sum(r[i] * w for r, w in zip(rows, wanted, strict=True)) for i in range(n)]
    for i in range(n):
        p = max(range(i, n), key=lambda k: abs(A[k][i]))
        A[i], A[p], b[i], b[p] = A[p], A[i], b[p], b[i]
        for k in range(i + 1, n):
            f = A[k][i] / A[i][i]
            A[k] = [x - f * y for x, y in zip(A[k], A[i], strict=True)]
            b[k] -= f * b[i]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (b[i] - sum(A[i][k] * x[k] for k in range(i + 1, n))) / A[i][i]
    return x


# --- the timeline -------------------------------------------------------------------------------------------------


class Lost(Exception):
    """A change that does not fit: the timeline has to come again."""


class Timeline:
    def __init__(self, robot, snapshot):
        self.robot, self.first = robot, snapshot.get("first", 0)
        self.segments = self._read(snapshot["segments"], None, {})
        self.values, self.events = snapshot.get("values", []), snapshot.get("events", [])
        self.first_event = snapshot.get("first_event", 0)

    def _read(self, records, owner, motions):
        """Segments with their motions; a motion is described once in a message."""
        segments = []
        for record in records:
            motion = record.get("motion", owner)
            if isinstance(motion, dict):
                motions[motion["number"]] = motion
            elif motion is not None:
                motion = motions[motion]
            segments.append({**record, "motion": motion})
        return segments

    def apply(self, delta):
        motions, motion = {}, delta["motion"]
        motions[motion["number"]] = motion
        keep = delta["keep"] - self.first
        if keep < 1:
            raise Lost
        kept, later = self.segments[:keep], self.segments[keep + delta["drop"] :]
        if kept[-1]["finish"] > delta["cut"]:
            kept[-1] = {**kept[-1], "finish": delta["cut"]}
        shift = delta.get("shift", 0.0)
        later = [{**one, "start": one["start"] + shift, "finish": one["finish"] + shift} for one in later]
        self.segments = kept + self._read(delta["segments"], motion, motions) + later
        edit = delta.get("events")
        if edit is not None:
            keep = edit["keep"] - self.first_event
            if keep < 0:
                raise Lost
            later, shift = self.events[keep + edit.get("drop", 0) :], edit.get("shift", 0.0)
            later = [{**one, "time": one["time"] + shift} for one in later]
            self.events = self.events[:keep] + edit.get("events", []) + later

    def steer(self, target):
        """What follows from one target of steering, with the profile LSPB."""
        motion = target.get("motion", self.segments[-1]["motion"])
        t, tick, rates = target["executed"], target["tick"] * TICK, target["rates"]
        index = self._index(t)
        q, v = self.joints(t), self._velocity(t)
        parts = [("blend", tick, [[p, a, 0.5 * (b - a) / tick] for p, a, b in zip(q, v, rates, strict=True)])]
        q = [polynomial(row, tick) for row in parts[0][2]]
        if any(rates):
            parts.append(("cruise", tick, [[p, b] for p, b in zip(q, rates, strict=True)]))
            q = [polynomial(row, tick) for row in parts[1][2]]
            most = [one["max_acceleration"] * motion.get("acceleration", 1.0) for one in self.robot.joints]
            time = ceil(max(abs(b) / a for b, a in zip(rates, most, strict=True)) / TICK) * TICK
            parts.append(("decelerate", time, [[p, b, 0.5 * (0.0 - b) / time] for p, b in zip(q, rates, strict=True)]))
        segments, numbers, start = [], [], t
        for phase, lasting, rows in parts:
            segments.append(
                {"start": start, "finish": start + lasting, "phase": phase, "joints": rows, "motion": motion}
            )
            numbers += [start, start + lasting, *(x for row in rows for x in row)]
            start += lasting
        if zlib.crc32(struct.pack(f"<{len(numbers)}d", *numbers)) != target["crc"]:
            raise Lost
        kept = [one for one in self.segments[: index + 1] if one["start"] < t or one is self.segments[0]]
        kept[-1] = {**kept[-1], "finish": min(kept[-1]["finish"], t)}
        self.segments = kept + segments

    def extend(self, snapshot):
        """Put an older part before what is known."""
        older = Timeline(self.robot, snapshot)
        self.segments = older.segments[: self.first - older.first] + self.segments
        self.first = older.first

    def _index(self, t):
        return max(bisect_right(self.segments, t, key=lambda one: one["start"]) - 1, 0)

    def _at(self, t):
        segment = self.segments[self._index(t)]
        return segment, min(max(t - segment["start"], 0.0), segment["finish"] - segment["start"])

    def joints(self, t):
        segment, s = self._at(t)
        rows, line = segment.get("joints"), segment.get("line")
        if rows is None and "pieces" in segment:
            for piece in segment["pieces"]:
                rows, here = piece["joints"], s
                if s <= piece["duration"]:
                    break
                s -= piece["duration"]
            s = here
        if rows is not None:
            return [polynomial(row, s) for row in rows]
        T = [[*line["orientation"][i][:3], polynomial(line["position"][i], s)] for i in range(3)]
        for turn in line["turns"]:
            T = compose(T, turned(turn["axis"], polynomial(turn["angle"], s)))
        seeds, interval = line["seeds"], line["seed_interval"]
        seed = seeds[min(max(round(s / interval), 0), len(seeds) - 1)] if len(seeds) > 1 else seeds[0]
        guides = [(one["weights"], polynomial(one["value"], s)) for one in line.get("guides", [])]
        return self.robot.inverse(compose(T, inverse(tool_of(segment))), seed, guides)

    def _velocity(self, t):
        segment, s = self._at(t)
        if t >= segment["finish"]:
            return [0.0] * len(self.robot.joints)
        return [polynomial([k * c for k, c in enumerate(row)][1:] or [0.0], s) for row in segment["joints"]]

    def tool(self, t):
        """T_world_tool."""
        segment, _ = self._at(t)
        base = (segment["motion"].get("frames") or {}).get("base", IDENTITY)
        flange, _ = self.robot.frames(self.joints(t))
        return [x for row in compose(inverse(base), compose(flange, tool_of(segment))) for x in row]

    def value(self, channel, t):
        for event in reversed(self.values + self.events):
            if event["channel"] == channel and event["time"] <= t and not event.get("observed"):
                return event["value"]
        return 0.0


def tool_of(segment):
    return (segment["motion"].get("frames") or {}).get("tool", IDENTITY)


# --- the connection -----------------------------------------------------------------------------------------------


class Client:
    def __init__(self):
        self.out, self.welcome, self.heard, self.last_id = [], None, 0, 0
        self.commands, self.ends, self.questions = {}, {}, set()
        self.subscription = self.number = self.timeline = None
        self.clock = {"now": 0.0}

    def open(self, fields):
        hello = {"type": "hello", "versions": [1], **fields}
        if self.welcome is not None:
            key, unanswered = self.welcome["connection"], list(self.commands)
            hello["resume"] = {"connection": key, "seq": self.heard, "unanswered": unanswered}
        self.out.append(hello)

    def cut(self, _):
        pass

    def do(self, message):
        if message["type"] == "answer":
            self.questions.discard(message["question"])
            self.out.append(message)
            return
        self.last_id += 1
        message = {**message, "id": self.last_id}
        if message["type"] in ("line", "at", "abort", "drive", "put"):
            self.commands[self.last_id] = message
        if message["type"] == "subscribe":
            self.subscription = message
        self.out.append(message)

    def received(self, message):
        kind = message["type"]
        if "seq" in message and kind != "welcome":
            if message["seq"] <= self.heard:
                return
            self.heard = message["seq"]
        handle = getattr(self, f"_{kind}", None)
        if handle is not None:
            handle(message)

    def _welcome(self, message):
        before, self.welcome = self.welcome, message
        self.robot = Robot(message["model"])
        if not message.get("resumed"):
            self.heard = message.get("seq", 0)
            self.questions.clear()
        for fate in message.get("fates", []):
            if fate["outcome"] in ("unseen", "forgotten") and self.commands.pop(fate["id"], None):
                self.ends[fate["id"]] = "refused"
        if before is not None and before["life"] != message["life"]:
            self.number = None
        if self.subscription is not None:
            after = {} if self.number is None else {"after": self.number}
            self.last_id += 1
            self.out.append({**self.subscription, **after, "id": self.last_id})

    def _done(self, message):
        if self.commands.pop(message["id"], None):
            self.ends[message["id"]] = "done" if message.get("ok", True) else "refused"

    def _refused(self, message):
        if self.commands.pop(message.get("id"), None):
            self.ends[message["id"]] = "refused"

    def _asked(self, message):
        self.questions.add(message["number"])

    def _withdrawn(self, message):
        self.questions.discard(message["number"])

    def _clock(self, message):
        self.clock = message

    def _replaced(self, message):
        self.number, self.timeline = message.get("number", 0), Timeline(self.robot, message["snapshot"])

    def _shown(self, message):
        self.timeline.extend(message["snapshot"])

    def _delta(self, message):
        self._change(message, lambda: self.timeline.apply(message["delta"]))

    def _steered(self, message):
        self._change(message, lambda: self.timeline.steer(message["target"]))

    def _change(self, message, apply):
        if self.number is None or message["number"] <= self.number:
            return
        try:
            if message["number"] != self.number + 1:
                raise Lost
            apply()
            self.number = message["number"]
        except Lost:
            self.number = None
            self.out.append({"type": "resync", "full": True} if message["type"] == "steered" else {"type": "resync"})

    def now(self, wall):
        clock = self.clock
        goes = clock.get("realtime") and not clock.get("paused")
        return clock["now"] + (clock.get("rate", 1.0) * (wall - clock.get("wall", 0.0)) if goes else 0.0)


def answered(client, kind, asked):
    """The answer to a question of the kit."""
    match kind:
        case "joints":
            return [client.timeline.joints(t) for t in asked["times"]]
        case "tools":
            return [client.timeline.tool(t) for t in asked["times"]]
        case "values":
            return [client.timeline.value(asked["channel"], t) for t in asked["times"]]
        case "now":
            return [client.now(wall) for wall in asked["walls"]]
        case "ends":
            return client.ends
        case "asked":
            return sorted(client.questions)
    return getattr(client, kind)(asked)


def main():
    client = Client()
    for line in sys.stdin:
        ((kind, asked),) = json.loads(line).items()
        client.out.clear()
        answer = answered(client, kind, asked)
        print(json.dumps({"send": client.out, kind: answer}), flush=True)


main()

"""Receive every change of the timeline, and keep a copy that is equal to the last bit."""

import vrs_cli as vrs

r = vrs.Robot()
heard = []


def changed(change: vrs.Change) -> None:
    """Store a change. This runs in a separate thread, so the robot does not wait for it."""
    heard.append(change)


end = r.subscribe(changed)
r.move(0, -45, 180, 0, 45, 0)
r.moves(vrs.trans(300, 450, -200, 90, 90, 0), at=1.0)
r.undo()
end()  # when this returns, all changes so far have been delivered

for change in heard:
    print(change)
    if change.delta is not None:
        print(f"  kept {change.delta.keep} segments, {len(change.delta.segments)} are new")

copy = heard[0].timeline
for change in heard[1:]:
    copy = copy.apply(change.delta)
print(copy == r.timeline)

# It prints:
#
#   <Change to version 0: another timeline, to 0.000 s>
#   <Change to version 1: MOVE #PPOINT(0, -45, 180, 0, 45, 0), to 1.133 s>
#     kept 1 segments, 3 are new
#   <Change to version 2: MOVES TRANS(300, 450, -200, 90, 90, 0) AT 1, to 2.168 s>
#     kept 4 segments, 3 are new
#   <Change to version 3: MOVES TRANS(300, 450, -200, 90, 90, 0) AT 1, to 1.133 s>
#     kept 3 segments, 1 are new
#   True

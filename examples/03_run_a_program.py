"""Run a VAL-II program: set its variables, and read its results."""

import vrs_cli as vrs

r = vrs.Robot()
r.define("""
.PROGRAM pick()
    FOR i = 1 TO count
        APPRO part, 80
        MOVES part
        CLOSEI
        DEPARTS 80
        OPENI
        picked = i
    END
    TYPE "picked", picked
.END
""")
r["count"] = 2
r["part"] = vrs.trans(0, 550, -250, 90, 90, 0)

run = r.execute("pick")
print(run)
print(r["picked"], r["part"], f"{r['DISTANCE(part, TRANS(0, 0, 0))']:.3f}")

r["part"] = vrs.trans(0, 5500, -250, 90, 90, 0)
try:
    r.execute("pick")
except vrs.ProgramFailed as failed:
    print(failed)

# It prints:
#
#   picked 2
#   pick: Program completed, 3.373 s
#   2.0 trans(0, 550, -250, 90, 90, 0) 604.152
#   pick step 2, APPRO part, 80: *Location too far* the wrist would be 5499.2 mm from the shoulder, the arm reaches 865.3 mm (move the location 4633.8 mm nearer)

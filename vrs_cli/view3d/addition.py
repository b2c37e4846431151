"""What the page does beside what viser's own does. STOP is above everything else, on a phone too, and says what became
of it. A page without a connection, to the robot or to vrs itself, looks so, and says since when: viser says nothing, or
`Connecting...`. A list of steps is scrolled to the one that is marked as the present one, once it is another; and on a
phone the sheet, which has one width in viser, is as wide as the page. And it never gets the picture of a hall that
viser's page begins to prepare for its light before it hears that there is another: software takes half a second.
"""

from __future__ import annotations

THERE = "/there"  # what the page asks for to know whether vrs is there, and the robot
STOP = "/stop"
OPENS, GOES_ON = "Started again it opens a page of its own.", "This page goes on when it is started again."

SCRIPT = """
<style>
#vrs-band {
    position: fixed; z-index: 10000; top: 4.2rem; left: 50%; transform: translateX(-50%); width: max-content;
    max-width: min(34rem, 90vw); box-sizing: border-box; padding: 0.8rem 1.1rem; border-radius: 6px;
    background: #a83232; color: #fff; font: 15px/1.4 sans-serif; pointer-events: none;
}
#vrs-stop {
    position: fixed; z-index: 10001; top: 0.75rem; right: 16.5rem; padding: 0.6rem 1.6rem; border: 2px solid #fff;
    border-radius: 8px; background: #d01f1f; color: #fff; font: bold 18px/1.2 sans-serif; cursor: pointer;
    box-shadow: 0 1px 6px #0008;
}
#vrs-stop:active { background: #8f1010; }
.vrs-lost #vrs-stop { background: repeating-linear-gradient(45deg, #6b6b6b 0 8px, #828282 8px 16px); }
.vrs-lost canvas { filter: grayscale(1) brightness(0.85) contrast(0.7); }
.vrs-lost .tabler-icon-cloud-check { stroke: #d01f1f !important; }
.vrs-lost .tabler-icon-cloud-check path:last-child { display: none; }
@media (max-width: 800px) { #vrs-stop { right: 0.75rem; } }
@media (max-width: 30rem) { [style*="width: 20em"] { width: 100vw !important; } }
</style>
<div id="vrs-band" role="status" hidden></div>
<button id="vrs-stop" hidden>STOP</button>
<script>
(() => {
    const ask = window.fetch, hall = "data:image/jpeg";
    window.fetch = (what, ...how) =>
        (what.url ?? String(what)).startsWith(hall) ? new Promise(() => {}) : ask(what, ...how);

    const band = document.getElementById("vrs-band"), stop = document.getElementById("vrs-stop");
    const here = `/${location.pathname.split("/")[1]}`;
    const get = (path, patience) => ask(here + path, {cache: "no-store", signal: AbortSignal.timeout(patience)});
    let lost = "", since = "", said = "", stopping = "";
    function show() {
        document.body.classList.toggle("vrs-lost", Boolean(lost));
        band.textContent = [said, lost].filter(Boolean).join(" ");
        band.hidden = !band.textContent;
        stop.textContent = stopping || (lost ? "STOP: no connection" : "STOP");
    }
    async function look() {
        try {
            const answer = await get("PATH-THERE", 5000);
            const found = answer.ok ? await answer.json() : null;
            lost = found ? found.lost : "Another vrs view is at this address now: open the one that it tells.";
            stop.hidden = !found?.drives;
            since = "";
        } catch {
            since ||= new Date().toLocaleTimeString();
            lost = `vrs view has ended (${since}): what is seen here is where the robot was last. `
                + "STOP does not reach the robot. AGAIN";
        }
        if (lost && stopping === "STOPPED") stopping = "";
        show();
        setTimeout(look, 1000);
    }
    look();

    stop.onclick = async () => {
        stopping = "STOP ...";
        show();
        try {
            const answer = await get("PATH-STOP", 3000);
            said = answer.ok ? "" : await answer.text();
        } catch {
            said = "STOP has no answer: the robot may move on.";
        }
        stopping = said ? "NOT STOPPED" : "STOPPED";
        show();
        setTimeout(() => { said = stopping = ""; show(); }, said ? 8000 : 2000);
    };

    let step = null;
    new MutationObserver(() => {
        const now = document.querySelector('[data-step="here"]');
        if (now && now !== step) {
            const list = now.parentElement;
            const below = now.getBoundingClientRect().top - list.getBoundingClientRect().top;
            list.scrollTop += below - list.clientHeight / 2;
        }
        step = now;
    }).observe(document.body, {childList: true, subtree: true});
})();
</script>
"""


def addition(*, comes_back: bool) -> bytes:
    """What stands behind viser's page. `comes_back`: vrs that is started again is at the same address."""
    again = GOES_ON if comes_back else OPENS
    return SCRIPT.replace("PATH-THERE", THERE).replace("PATH-STOP", STOP).replace("AGAIN", again).encode()

"""What the page does beside what viser's own does: it says in words that vrs has ended, where viser says nothing, or
`Connecting...`; a list of steps is scrolled to the one that is marked as the present one, once it is another; and on a
phone the sheet, which has one width in viser, is as wide as the page. And it never gets the picture of a hall that
viser's page begins to prepare for its light before it hears that there is another: software takes half a second.
"""

from __future__ import annotations

THERE = "/there"  # what the page asks for to know whether vrs is
OPENS, GOES_ON = "Started again it opens a page of its own.", "This page goes on when it is started again."

SCRIPT = """
<style>#vrs-ended {
    position: fixed; z-index: 10000; top: 1rem; left: 50%; transform: translateX(-50%); max-width: min(34rem, 90vw);
    padding: 0.8rem 1.1rem; border-radius: 6px; background: #a83232; color: #fff; font: 15px/1.4 sans-serif;
}
@media (max-width: 30rem) { [style*="width: 20em"] { width: 100vw !important; } }</style>
<div id="vrs-ended" role="status" hidden></div>
<script>
(() => {
    const ask = window.fetch, hall = "data:image/jpeg";
    window.fetch = (what, ...how) =>
        (what.url ?? String(what)).startsWith(hall) ? new Promise(() => {}) : ask(what, ...how);

    const box = document.getElementById("vrs-ended");
    const there = `/${location.pathname.split("/")[1]}THERE`;
    const said = text => { box.textContent = text; box.hidden = !text; };
    async function look() {
        try {
            const answer = await ask(there, {cache: "no-store", signal: AbortSignal.timeout(5000)});
            said(answer.ok ? "" : "Another vrs view is at this address now: open the one that it tells.");
        } catch {
            said("vrs view has ended: what is seen here is where the robot was last. AGAIN");
        }
    }
    setInterval(look, 2000);

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
    return SCRIPT.replace("THERE", THERE).replace("AGAIN", GOES_ON if comes_back else OPENS).encode()

import type { App, Shown } from "../app";
import { Change } from "../core/change";
import { ZOOMS, commandFrom, doingAt } from "../core/spans";
import { assign, button, h, put } from "../dom";
import { type Icon, fold, icon } from "../style/icons";

/** The action of a button or a key. `on`: whether a switch is on. */
export interface Action {
  label: string;
  key: string;
  run(): void;
  icon?: Icon;
  on?(): boolean;
}

const RATES = [0.1, 0.25, 0.5, 1, 2, 4, 10];
const SKIP = 10; // [s]
const NARROW = matchMedia("(max-width: 899px), (max-height: 499px)");

/** Makes the buttons of time. Returns their actions, for keys. */
export function makeBar(app: App, slot: HTMLElement, zoom: { seconds: number }): Action[] {
  const { playback } = app;
  const runs = (): boolean => playback.playing || playback.following;
  const pauseAtCommand = (sign: 1 | -1): void => {
    const t = commandFrom(app.source.timeline, playback.time, sign);
    playback.pause();
    playback.seek(t);
  };
  const setRate = (rate = playback.rate): void => {
    playback.setRate(rate);
    app.wake();
  };
  const actions: Record<string, Action> = {
    play: { label: "Play or pause", key: "Space", icon: "play", run: () => (runs() ? playback.pause() : playback.play()) },
    start: { label: "To the start", key: "Home", icon: "start", run: () => playback.seek(playback.begin) },
    end: { label: "To the end", key: "End", icon: "end", run: () => playback.seek(playback.end) },
    before: { label: "Command before", key: "B", icon: "before", run: () => pauseAtCommand(-1) },
    after: { label: "Next command", key: "N", icon: "after", run: () => pauseAtCommand(1) },
    back: { label: `${SKIP} s back`, key: "PageUp", run: () => playback.seek(playback.time - SKIP) },
    on: { label: `${SKIP} s on`, key: "PageDown", run: () => playback.seek(playback.time + SKIP) },
    follow: { label: "Live: follow the robot", key: "F", on: () => playback.following, run: () => playback.follow() },
    slower: { label: "Slower", key: "Z", icon: "slower", run: () => setRate(RATES.findLast((rate) => rate < playback.rate)) },
    faster: { label: "Faster", key: "X", icon: "faster", run: () => setRate(RATES.find((rate) => rate > playback.rate)) },
    loop: {
      label: "Loop: over and over", key: "L", icon: "loop", on: () => playback.loop,
      run: () => {
        playback.loop = !playback.loop;
        if (playback.loop && playback.following) playback.seek(playback.time);
        app.wake();
      },
    },
    zoom: {
      label: "Zoom: all, 60 s, 20 s, 5 s", key: "V", icon: "zoom",
      run: () => {
        zoom.seconds = ZOOMS[(ZOOMS.indexOf(zoom.seconds) + 1) % ZOOMS.length];
        app.wake();
      },
    },
  };
  if (!app.connection) delete actions.follow;

  const buttons: Record<string, HTMLButtonElement> = {};
  const make = (name: string, ...texts: (Node | string)[]): HTMLButtonElement => {
    const { label, key, run, icon: drawn, on } = actions[name];
    const made = button(drawn ? icon(drawn) : "", run, { class: texts.length ? "" : "icon", "aria-label": label, title: `${label} (${key})` });
    if (on) made.setAttribute("aria-pressed", "false");
    made.append(...texts);
    return (buttons[name] = made);
  };
  const [rate, zoomed, lamp] = [h("span", { class: "number" }), h("span", { class: "number" }), h("span", { class: "lamp" })];
  const [clock, end, doing] = [h("b", { class: "number" }), h("span", { class: "number muted" }), h("span", { class: "doing" })];
  const secondary = h("div", { class: "secondary", "aria-label": "Speed and zoom" },
    h("span", { class: "group" }, make("slower"), button(rate, () => setRate(1), { class: "rate", title: "At its own rate" }), make("faster")),
    make("loop"), make("zoom", zoomed));
  slot.append(h("div", { class: "bar" },
    h("span", { class: "group" }, ...["start", "before", "play", "after", "end"].map((name) => make(name))),
    actions.follow ? make("follow", lamp, "Live") : "",
    h("div", { class: "clock" }, h("div", { class: "when" }, clock, " ", end), doing),
    h("ul", { class: "legend", "aria-label": "Colours of the phases" },
      ...["accelerate", "cruise", "blend", "decelerate", "rest"].map((phase) => h("li", {}, h("span", { class: `swatch ${phase}` }), phase))),
    ...fold(secondary, "more", "Speed and zoom", NARROW)));

  const state = new Change();
  app.add({
    show({ t, timeline }: Shown) {
      put(clock, `${t.toFixed(2)} s`);
      put(end, `/ ${playback.end.toFixed(2)} s`);
      const { text } = doingAt(timeline, t);
      put(doing, text);
      assign(doing, { title: text });
      put(rate, `${playback.rate} ×`);
      put(zoomed, zoom.seconds === Infinity ? "all" : `${zoom.seconds} s`);
      if (!state.to([runs(), playback.following, playback.loop])) return;
      const name = runs() ? "Pause" : "Play";
      buttons.play.replaceChildren(icon(runs() ? "pause" : "play"));
      buttons.play.setAttribute("aria-label", name);
      buttons.play.title = `${name} (Space)`;
      lamp.classList.toggle("good", playback.following);
      for (const [of, one] of Object.entries(buttons)) if (actions[of].on) one.setAttribute("aria-pressed", String(actions[of].on()));
    },
  });
  return Object.values(actions);
}

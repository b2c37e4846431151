import type { App, Shown } from "../app";
import type { Timeline } from "../core/timeline";
import { PHASES, ZOOMS, commandFrom, doingAt } from "../core/spans";
import { h } from "../dom";
import { type Icon, icon } from "../style/icons";
import { fold } from "../style/menu";

/** What a button or a key does. `on`: what is switched on stays lit. */
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

/** Makes the buttons of time. Returns all that can be done with it, for keys. */
export function makeBar(app: App, slot: HTMLElement, zoom: { seconds: number }): Action[] {
  const { playback } = app;
  const runs = (): boolean => playback.playing || playback.following;
  const pauseAt = (t: number): void => {
    playback.pause();
    playback.seek(t);
  };
  const setRate = (rate: number | undefined): void => {
    if (rate !== undefined) playback.setRate(rate);
    app.wake();
  };
  const timeline = (): Timeline => app.source.timeline;
  const live = app.connection !== null;
  const start: Action = { label: "To the start", key: "Home", icon: "start", run: () => playback.seek(playback.begin) };
  const before: Action = { label: "Command before", key: "B", icon: "before", run: () => pauseAt(commandFrom(timeline(), playback.time, -1)) };
  const play: Action = { label: "Play or pause", key: "Space", icon: "play", run: () => (runs() ? playback.pause() : playback.play()) };
  const after: Action = { label: "Next command", key: "N", icon: "after", run: () => pauseAt(commandFrom(timeline(), playback.time, 1)) };
  const end: Action = { label: "To the end", key: "End", icon: "end", run: () => playback.seek(playback.end) };
  const follow: Action = { label: "Live: follow the robot", key: "F", on: () => playback.following, run: () => playback.follow() };
  const slower: Action = { label: "Slower", key: "Z", icon: "slower", run: () => setRate([...RATES].reverse().find((rate) => rate < playback.rate)) };
  const faster: Action = { label: "Faster", key: "X", icon: "faster", run: () => setRate(RATES.find((rate) => rate > playback.rate)) };
  const loop: Action = {
    label: "Loop: over and over", key: "L", icon: "loop", on: () => playback.loop,
    run: () => {
      playback.loop = !playback.loop;
      if (playback.loop && playback.following) playback.seek(playback.time);
      app.wake();
    },
  };
  const zooming: Action = {
    label: "Zoom: all, 60 s, 20 s, 5 s", key: "V", icon: "zoom",
    run: () => {
      zoom.seconds = ZOOMS[(ZOOMS.indexOf(zoom.seconds) + 1) % ZOOMS.length];
      app.wake();
    },
  };
  const back: Action = { label: `${SKIP} s back`, key: "PageUp", run: () => playback.seek(playback.time - SKIP) };
  const on: Action = { label: `${SKIP} s on`, key: "PageDown", run: () => playback.seek(playback.time + SKIP) };

  const buttons = new Map<Action, HTMLButtonElement>();
  const button = (action: Action, ...children: (Node | string)[]): HTMLButtonElement => {
    const inner = children.length ? children : [icon(action.icon!)];
    const made = h("button", {
      type: "button", class: children.length ? "button" : "button icon", "aria-label": action.label, title: `${action.label} (${action.key})`, onclick: action.run,
      ...(action.on ? { "aria-pressed": "false" } : {}),
    }, ...inner);
    buttons.set(action, made);
    return made;
  };
  const [rate, zoomed] = [h("span", { class: "number" }), h("span", { class: "number" })];
  const reset = h("button", { type: "button", class: "button rate", title: "At its own rate", onclick: () => setRate(1) }, rate);
  const [clock, of, doing] = [h("b", { class: "number" }), h("span", { class: "number muted" }), h("span", { class: "doing" })];
  const swatch = (phase: string): HTMLElement => h("li", {}, h("span", { class: `swatch ${phase}` }), phase);
  const secondary = h("div", { class: "secondary", "aria-label": "Speed and zoom" },
    h("span", { class: "group" }, button(slower), reset, button(faster)),
    button(loop), button(zooming, icon("zoom"), zoomed));
  const lamp = h("span", { class: "lamp" });
  slot.append(h("div", { class: "bar" },
    h("span", { class: "group" }, button(start), button(before), button(play), button(after), button(end)),
    ...(live ? [button(follow, lamp, "Live")] : []),
    h("div", { class: "clock" }, h("div", { class: "when" }, clock, " ", of), doing),
    h("ul", { class: "legend", "aria-label": "Colours of the phases" }, ...["accelerate", "cruise", "blend", "decelerate", "rest"].filter((phase) => (PHASES as readonly string[]).includes(phase)).map(swatch)),
    ...fold(secondary, "more", "Speed and zoom", NARROW)));

  const put = (element: HTMLElement, text: string): void => {
    if (element.textContent !== text) element.textContent = text;
  };
  let state = "";
  app.add({
    show({ t, timeline: shown }: Shown) {
      put(clock, `${t.toFixed(2)} s`);
      put(of, `/ ${playback.end.toFixed(2)} s`);
      const what = doingAt(shown, t).text;
      put(doing, what);
      doing.title = what;
      put(rate, `${playback.rate} ×`);
      put(zoomed, zoom.seconds === Infinity ? "all" : `${zoom.seconds} s`);
      const now = [runs(), playback.following, playback.loop].join();
      if (now === state) return;
      state = now;
      const playing = buttons.get(play)!;
      playing.replaceChildren(icon(runs() ? "pause" : "play"));
      playing.setAttribute("aria-label", runs() ? "Pause" : "Play");
      playing.title = `${runs() ? "Pause" : "Play"} (Space)`;
      lamp.classList.toggle("good", playback.following);
      for (const [action, one] of buttons) if (action.on) one.setAttribute("aria-pressed", String(action.on()));
    },
  });
  return [play, start, end, before, after, back, on, ...(live ? [follow] : []), slower, faster, loop, zooming];
}

import { type Extension, type Range, RangeSet, RangeSetBuilder, type RangeValue, type StateEffectType, StateField, type Text } from "@codemirror/state";
import { Decoration, type DecorationSet, EditorView, ViewPlugin, type ViewUpdate } from "@codemirror/view";
import type { Message } from "../core/connection";
import words from "./words.json";

/** A text and its kind: `number`, `error`, ...; the names of `Ink` in vrs_cli/render/colours.py. */
export type Run = [text: string, ink: string];

const TOKEN =
  /(;.*)|("[^"]*"?)|(\^[BHD]?[0-9A-F]+|'.|(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?)|([#$%.]?[A-Z][\w.]*)|(\s+)|(.)/gisu;
const SORTS = ["comment", "string", "number", "word", "text", "operator"];
const ASSIGNED = /^\s*(?:\[[^\]]*\]\s*)?=(?!=)/; // the text after the name of an assignment
const MAX_COLOURED = 2000; // characters of a line; the rest is plain
const of = (list: string[]): Set<string> => new Set(list);
const FIRST = [["command", of(words.command)], ["instruction", of(words.instruction)], ["control", of(words.control)]] as const;
const [FUNCTIONS, CONSTANTS, LINKS] = [of(words.function), of(words.constant), of(words.link)];

/** Returns the ink of a word that starts a statement, which may be abbreviated; null if it starts none. */
function firstInk(word: string): string | null {
  const exact = FIRST.find(([, list]) => list.has(word));
  if (exact) return exact[0];
  if (word.length < 2 || FUNCTIONS.has(word) || LINKS.has(word)) return null;
  return FIRST.find(([, list]) => [...list].some((one) => one.startsWith(word)))?.[0] ?? null;
}

/** Divides a line of VAL-II into runs: by its words, as `scan` of vrs_cli/render/colours.py does. */
export function scan(line: string): Run[] {
  const runs: Run[] = [];
  let first = true;
  for (const found of line.slice(0, MAX_COLOURED).matchAll(TOKEN)) {
    const text = found[0];
    let ink = SORTS[found.slice(1).findIndex((group) => group !== undefined)];
    if (ink === "word") {
      const word = text.toUpperCase();
      const rest = line.slice(found.index + text.length);
      const starts = first && !ASSIGNED.test(rest) ? firstInk(word) : null;
      if (word.startsWith(".")) ink = "control";
      else if (starts) ink = starts;
      else if (FUNCTIONS.has(word) && (CONSTANTS.has(word) || rest.startsWith("("))) ink = "function";
      else ink = LINKS.has(word) && !first && !rest.startsWith("[") ? "control" : "name";
      first = first && (word === "DO" || word === "EXPLAIN");
    }
    runs.push([text, ink]);
  }
  if (line.length > MAX_COLOURED) runs.push([line.slice(MAX_COLOURED), "text"]);
  return runs;
}

/** Colours the visible lines of VAL-II in an editor. */
const colours = ViewPlugin.fromClass(
  class {
    decorations: DecorationSet;
    constructor(view: EditorView) {
      this.decorations = coloured(view);
    }
    update(update: ViewUpdate): void {
      if (update.docChanged || update.viewportChanged) this.decorations = coloured(update.view);
    }
  },
  { decorations: (plugin) => plugin.decorations },
);

function coloured(view: EditorView): DecorationSet {
  const builder = new RangeSetBuilder<Decoration>();
  for (const { from, to } of view.visibleRanges) {
    for (let at = from; at <= to; ) {
      const line = view.state.doc.lineAt(at);
      let begin = line.from;
      for (const [text, ink] of scan(line.text)) {
        if (ink !== "text") builder.add(begin, begin + text.length, Decoration.mark({ class: `ink-${ink}` }));
        begin += text.length;
      }
      at = line.to + 1;
    }
  }
  return builder.finish();
}

/** Returns a field of marks that move with the text; an effect replaces them by those of `ranges`. */
export function marksField<V extends RangeValue, T>(
  effect: StateEffectType<T>, ranges: (value: T, doc: Text) => Range<V>[], provide?: (field: StateField<RangeSet<V>>) => Extension,
): StateField<RangeSet<V>> {
  return StateField.define<RangeSet<V>>({
    create: () => RangeSet.empty,
    update: (marks, { changes, effects, state }) =>
      effects.reduce((now, one) => (one.is(effect) ? RangeSet.of(ranges(one.value, state.doc)) : now), marks.map(changes)),
    provide,
  });
}

/** Returns the message and the place in the text of a finding of the robot. */
export function findingIn(doc: Text, { text, detail, hint, span }: Message): { from: number; to: number; message: string } {
  const line = doc.line(Math.min(span.line ?? 1, doc.lines));
  const from = Math.min(line.from + span.column - 1, Math.max(line.to - 1, line.from));
  const to = Math.min(Math.max(line.from + span.end - 1, from), line.to);
  return { from, to, message: `${text}${detail ? `: ${detail}` : ""}${hint ? ` (${hint})` : ""}` };
}

/** Returns the extensions of an editor of VAL-II: colours, a label, no spelling correction. */
export const valEditor = (label: string, more: Record<string, string> = {}): Extension => [
  colours, EditorView.contentAttributes.of({ "aria-label": label, autocapitalize: "off", autocorrect: "off", spellcheck: "false", ...more }),
];

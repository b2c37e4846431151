import type { Message } from "../core/connection";
import { button, h } from "../dom";
import type { Commands } from "./commands";

const MAX_FILE_BYTES = 1_400_000; // a message of a client has at most 2 MB, in base64

/** Decodes base64. */
export const bytesOf = (base64: string): Uint8Array<ArrayBuffer> => Uint8Array.from(atob(base64), (one) => one.charCodeAt(0));

/** Downloads a text or bytes as a file. */
export function download(name: string, data: BlobPart): void {
  const link = h("a", { href: URL.createObjectURL(new Blob([data])), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Makes a button to choose files of the computer; a file that is too large is refused by `say`. */
export function fileButton(label: string, accept: string, take: (file: File) => unknown, say: (why: string) => void): HTMLElement {
  const input = h("input", { type: "file", accept, multiple: true, class: "unseen", tabindex: "-1", "aria-label": label });
  input.addEventListener("change", () => {
    for (const file of input.files ?? [])
      if (file.size > MAX_FILE_BYTES) say(`${file.name} has ${file.size} bytes; ${MAX_FILE_BYTES} at most`);
      else void take(file);
    input.value = "";
  });
  return h("span", {}, button(label, () => input.click()), input);
}

/** Puts the programs of a file of the computer in the robot's memory. */
export async function loadFile(commands: Commands, file: File): Promise<void> {
  try {
    await commands.load(file.name, new TextDecoder("utf-8", { fatal: true }).decode(await file.arrayBuffer()));
  } catch {
    commands.note(`${file.name} is no text`, "error");
  }
}

/** Makes the list of files of the robot's folder: load, fetch, put, delete. */
export function makeFiles(commands: Commands): HTMLElement {
  const list = h("ul", { class: "list files" });
  const said = h("div", { class: "note", hidden: true, role: "status" });
  const name = h("input", { class: "field code", value: "all.v2", "aria-label": "Name of the file to store" });
  const store = button("Store all", () => command(`STORE ${name.value.trim()}`), { title: "STORE: all programs and variables, in the robot's folder" });
  const folder = h("details", { class: "panel" }, h("summary", { class: "heading", text: "Files of the robot" }), list, said,
    h("div", { class: "row" }, fileButton("Put a file there", "", (file) => put(file, false), say), name, store));
  folder.addEventListener("toggle", () => folder.open && void refresh());

  async function command(line: string): Promise<void> {
    await commands.command(line);
    await refresh();
  }
  async function refresh(): Promise<void> {
    const answer = await commands.connection.ask("names");
    const files = (answer.files ?? []) as Message[];
    say(answer.refusal?.message ?? (files.length ? "" : "The robot's folder is empty."));
    list.replaceChildren(...files.map(({ name, size }) =>
      h("li", { class: "row spread" },
        h("span", { class: "file-name" }, h("span", { class: "code", text: name }), " ", h("span", { class: "note", text: sizeText(size) })),
        h("span", {},
          button("Load", () => command(`LOAD ${name}`), { class: "quiet", title: `LOAD ${name}` }),
          button("Get", () => get(name), { class: "quiet", title: "Save it on this computer" }),
          button("Delete", () => command(`FDELETE ${name}`), { class: "quiet", title: `FDELETE ${name}` })))));
  }
  async function get(of: string): Promise<void> {
    const answer = await commands.connection.ask("get", { name: of });
    if (answer.refusal) return say(answer.refusal.message);
    download(of, bytesOf(answer.data));
  }
  async function put(file: File, replace: boolean): Promise<void> {
    const bytes = new Uint8Array(await file.arrayBuffer());
    let data = "";
    for (let at = 0; at < bytes.length; at += 8192) data += String.fromCharCode(...bytes.subarray(at, at + 8192));
    const end = await commands.connection.ask("put", { name: file.name, data: btoa(data), ...(replace ? { replace } : {}) });
    await refresh();
    if (end.refusal) say(end.refusal.message, ...(replace ? [] : [button("Replace it", () => put(file, true))]));
  }
  function say(text: string, ...more: Node[]): void {
    said.replaceChildren(text, " ", ...more);
    said.hidden = !text;
  }
  return folder;
}

function sizeText(bytes: number): string {
  return bytes < 1000 ? `${bytes} B` : bytes < 1e6 ? `${(bytes / 1e3).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

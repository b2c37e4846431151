import { expect, test } from "vitest";
import { markdown } from "../src/class";

/** As much of a document as the texts of lessons need. */
class Fake {
  className = "";
  children: (Fake | string)[] = [];
  private own = "";
  constructor(readonly tagName: string) {}
  get textContent(): string {
    return this.own + this.children.map((one) => (typeof one === "string" ? one : one.textContent)).join("");
  }
  set textContent(text: string) {
    this.children = [];
    this.own = text;
  }
  append(...children: (Fake | string)[]): void {
    this.children.push(...children);
  }
}
Object.assign(globalThis, { document: { createElement: (tag: string) => new Fake(tag.toUpperCase()) } });

const shape = (text: string): string[] => markdown(text).map((one) => `${one.tagName} ${one.textContent}`);

test("blocks of a lesson", () => {
  expect(shape("## Step 1\n\nSay `DRIVE 1, 30`\nand **look**.\n\n    MOVE a\n    MOVE b\n\n- one\n- two\n  more\n")).toEqual([
    "H3 Step 1", "P Say DRIVE 1, 30 and look.", "PRE MOVE a\nMOVE b", "UL onetwo more",
  ]);
});

test("code in fences, and what is no markup", () => {
  expect(shape("```val2\nMOVE a\n\nMOVE b\n```\n\n<img src=x onerror=alert(1)> 2 * 3 ** 4")).toEqual([
    "PRE MOVE a\nMOVE b", "P <img src=x onerror=alert(1)> 2 * 3 ** 4",
  ]);
});

import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import type { TestProject } from "vitest/node";

declare module "vitest" {
  export interface ProvidedContext {
    recordings: string;
  }
}

/** Records the conversations of the conformance kit with the vrs of this checkout, for all tests. `VRS_RECORDINGS` names
 * a folder that has them already. */
export default function setup(project: TestProject): (() => void) | void {
  if (process.env.VRS_RECORDINGS) return project.provide("recordings", process.env.VRS_RECORDINGS);
  const checkout = resolve(import.meta.dirname, "../../..");
  const own = [".venv/bin/python", ".venv/Scripts/python.exe"].map((name) => join(checkout, name)).find(existsSync);
  const folder = mkdtempSync(join(tmpdir(), "vrs-kit-"));
  execFileSync(process.env.PYTHON ?? own ?? "python3", ["-m", "tests.net.kit", "record", folder], { cwd: checkout, stdio: "inherit" });
  project.provide("recordings", folder);
  return () => rmSync(folder, { recursive: true });
}

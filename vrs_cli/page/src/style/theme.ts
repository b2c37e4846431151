import { remember, remembered } from "../core/storage";

// Light or dark: the setting of the system, or the choice of the user.
export type Theme = "system" | "light" | "dark";

const listeners = new Set<() => void>();
const system = matchMedia("(prefers-color-scheme: dark)");
const resolved = new Map<string, string>();

/** Returns the theme that the user chose. */
export const chosenTheme = (): Theme => (document.documentElement.dataset.theme as Theme | undefined) ?? "system";

/** Returns whether the page is dark now. */
export function isDark(): boolean {
  const chosen = chosenTheme();
  return chosen === "dark" || (chosen === "system" && system.matches);
}

/** Shows the page in a theme, and stores the choice. */
export function chooseTheme(theme: Theme): void {
  remember("theme", theme === "system" ? null : theme);
  document.documentElement.dataset.theme = theme;
  tell();
}

/** Calls `changed` whenever the colours change. */
export function onTheme(changed: () => void): void {
  listeners.add(changed);
}
/** Returns a custom property such as "--accent" as a colour for a canvas: rgb(...). */
export function colour(property: string): string {
  let found = resolved.get(property);
  if (found === undefined) {
    const probe = document.createElement("span");
    probe.style.color = `var(${property})`;
    document.documentElement.append(probe);
    resolved.set(property, (found = getComputedStyle(probe).color));
    probe.remove();
  }
  return found;
}

function tell(): void {
  resolved.clear();
  for (const changed of listeners) changed();
}

const kept = remembered("theme");
if (kept === "light" || kept === "dark") chooseTheme(kept);
system.addEventListener("change", tell);

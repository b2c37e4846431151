/** Reads a stored text; null if there is none. `storage`: that of the tab survives only a reload. */
export function remembered(name: string, storage: () => Storage = () => localStorage): string | null {
  try {
    return storage().getItem(`vrs ${name}`);
  } catch {
    return null; // the page is a file, or the browser stores nothing
  }
}

/** Stores a text under a name; null removes it. Returns false if there is no room. */
export function remember(name: string, text: string | null, storage: () => Storage = () => localStorage): boolean {
  try {
    if (text === null) storage().removeItem(`vrs ${name}`);
    else storage().setItem(`vrs ${name}`, text);
    return true;
  } catch {
    return false;
  }
}

/** Reads a value stored as JSON; returns `otherwise` if it is missing or unreadable. */
export function rememberedValue<T>(name: string, otherwise: T, storage?: () => Storage): T {
  try {
    return (JSON.parse(remembered(name, storage) ?? "null") as T | null) ?? otherwise;
  } catch {
    return otherwise;
  }
}

/** Reads what this browser remembers; null where it remembers nothing. `storage`: that of this tab, for a reload. */
export function remembered(name: string, storage: () => Storage = () => localStorage): string | null {
  try {
    return storage().getItem(`vrs ${name}`);
  } catch {
    return null; // a page that is a file, or a browser that keeps nothing
  }
}

/** Has this browser remember a text under a name; null forgets it. Returns false where there is no room. */
export function remember(name: string, text: string | null, storage: () => Storage = () => localStorage): boolean {
  try {
    if (text === null) storage().removeItem(`vrs ${name}`);
    else storage().setItem(`vrs ${name}`, text);
    return true;
  } catch {
    return false;
  }
}

/** Reads a value that is remembered as JSON; `otherwise` where there is none that can be read. */
export function rememberedValue<T>(name: string, otherwise: T, storage?: () => Storage): T {
  try {
    return (JSON.parse(remembered(name, storage) ?? "null") as T | null) ?? otherwise;
  } catch {
    return otherwise;
  }
}

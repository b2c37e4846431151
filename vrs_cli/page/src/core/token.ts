/** Removes the token after "#" from the address, and keeps it for a reload of this tab. */
export function takeToken(): string {
  const fragment = new URLSearchParams(location.hash.slice(1));
  const token = fragment.get("token");
  if (token) {
    sessionStorage.setItem("token", token);
    fragment.delete("token");
    history.replaceState(null, "", location.pathname + location.search + (fragment.size ? `#${fragment}` : "")); // remove the secret from the address
  }
  return sessionStorage.getItem("token") ?? "";
}

/** Returns the headers of a request with the token. */
export function bearer(token: string): HeadersInit {
  return token ? { Authorization: `Bearer ${token}` } : {};
}

/** Exchanges the token for a cookie that scripts cannot read; if the server gives none, the tab keeps the token. */
export async function exchangeToken(robot: string, token: string): Promise<void> {
  if (!token) return;
  const answer = await fetch(`/enter/${encodeURIComponent(robot)}`, { headers: bearer(token), cache: "no-store" }).catch(() => null);
  if (answer?.status === 204) sessionStorage.removeItem("token");
}

/** Removes the cookies of robots, so that nobody enters from this browser without the link. */
export async function leave(robots: string[]): Promise<void> {
  sessionStorage.removeItem("token");
  const headers = { "X-Vrs": "leave" };
  await Promise.allSettled(robots.map((robot) => fetch(`/leave/${encodeURIComponent(robot)}`, { headers, cache: "no-store" })));
}

/** Returns the address of the page of a robot. */
export const viewOf = (robot: string): string => `/view/${encodeURIComponent(robot)}`;

/** Returns the address of a robot at the server of this page. */
export function addressOf(robot: string): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/robots/${encodeURIComponent(robot)}`;
}

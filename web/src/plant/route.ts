// Where one is: the URL says everything that a page needs, so that each view can be linked.
import { Cell, useCell } from './cell';

export type Route = { path: string; query: URLSearchParams };

const here = (): Route => ({ path: location.pathname, query: new URLSearchParams(location.search) });
export const route = new Cell<Route>(here());
export const useRoute = (): Route => useCell(route);

window.addEventListener('popstate', () => route.set(here()));

export function go(to: string, how: 'push' | 'replace' = 'push'): void {
  if (how === 'push') history.pushState(null, '', to);
  else history.replaceState(null, '', to);
  route.set(here());
  if (how === 'push') window.scrollTo(0, 0);
}

// Changes parameters of the query where one is; what is empty goes.
export function setQuery(changes: Record<string, string>): void {
  const query = new URLSearchParams(location.search);
  for (const [name, value] of Object.entries(changes)) {
    if (value === '') query.delete(name);
    else query.set(name, value);
  }
  const text = query.toString();
  go(location.pathname + (text === '' ? '' : `?${text}`), 'replace');
}

// Links of the page are followed without loading it anew; those with a modifier, a target or another origin by the browser.
export function followLinks(event: MouseEvent): void {
  if (event.defaultPrevented || event.button !== 0 || event.metaKey || event.ctrlKey || event.shiftKey || event.altKey) return;
  const link = (event.target as Element | null)?.closest?.('a');
  if (!link || link.target || link.hasAttribute('download') || link.origin !== location.origin) return;
  if (link.hash && link.pathname === location.pathname && link.search === location.search) return;
  event.preventDefault();
  go(link.pathname + link.search + link.hash);
}

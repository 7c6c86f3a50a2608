// What stands around every page: where one can go, who one is, and what is away.
import type { ComponentChildren, FunctionComponent } from 'preact';
import { useEffect, useErrorBoundary, useRef, useState } from 'preact/hooks';
import { useCell } from '../plant/cell';
import { eventsState } from '../plant/events';
import { reach } from '../plant/reach';
import { followLinks, go, useRoute } from '../plant/route';
import { lookAtSession, sessionState, signOut, type Session } from '../plant/session';
import { duration } from '../words/time';
import { Empty, Loading } from './states';
import { SignIn } from './sign_in';
import { theme, type Theme } from './theme';
import { useNow } from './now';

type PageModule = { default: FunctionComponent<{ argument: string }> };
type Page = { pattern: RegExp; load: () => Promise<PageModule> };

// Each page is a file of its own, fetched when it is first looked at.
const kPages: Page[] = [
  { pattern: /^\/$/, load: () => import('../pages/fleet') },
  { pattern: /^\/blades$/, load: () => import('../pages/blades') },
  { pattern: /^\/blades\/([^/]+)$/, load: () => import('../pages/blade') },
  { pattern: /^\/calibrations$/, load: () => import('../pages/calibrations') },
  { pattern: /^\/calibrations\/([^/]+)$/, load: () => import('../pages/calibration') },
  { pattern: /^\/registrations\/([^/]+)$/, load: () => import('../pages/registration') },
  { pattern: /^\/parts$/, load: () => import('../pages/parts') },
  { pattern: /^\/parts\/([^/]+)$/, load: () => import('../pages/part') },
  { pattern: /^\/machines\/([^/]+)$/, load: () => import('../pages/machine') },
  { pattern: /^\/corrections(?:\/([^/]+))?$/, load: () => import('../pages/corrections') },
];

const kFetchAgainMs = 3000;

const kLinks = [
  { href: '/', text: 'Fleet', isHere: (path: string) => path === '/' || path.startsWith('/machines') },
  { href: '/blades', text: 'Blades', isHere: (path: string) => path.startsWith('/blades') },
  { href: '/corrections', text: 'Corrections', isHere: (path: string) => path.startsWith('/corrections') },
  { href: '/calibrations', text: 'Calibrations', isHere: (path: string) => path.startsWith('/calibrations') },
  { href: '/parts', text: 'Parts', isHere: (path: string) => path.startsWith('/parts') },
];

function Notice() {
  const state = useCell(reach);
  const events = useCell(eventsState);
  const now = useNow();
  return (
    <div role="status" class="notice-place">
      {state.away ? (
        <p class="notice"><strong>{state.what[0]!.toUpperCase() + state.what.slice(1)} {state.what.includes(' and ') ? 'are' : 'is'} away</strong>{' '}
          for {duration((now.getTime() - state.since.getTime()) / 1000)}. What you see is as it was; the page goes on by itself.</p>
      ) : events === 'broken' ? (
        <p class="notice notice-small">Live events broke off. They are asked for again, and none is lost.</p>
      ) : null}
    </div>
  );
}

const kThemes: Record<Theme, string> = { auto: 'As the computer', light: 'Light', dark: 'Dark' };

function Account({ session }: { session: Session }) {
  const chosen = useCell(theme);
  const events = useCell(eventsState);
  return (
    <div class="account">
      <span class={`live live-${events}`} title="Whether events of the plant arrive as they are recorded">
        <span class="dot" aria-hidden="true" />{events === 'live' ? 'Live' : events === 'broken' ? 'Not live' : 'Connecting'}
      </span>
      <label class="theme"><span class="hidden">Colours</span>
        <select value={chosen} onChange={(event) => theme.set(event.currentTarget.value as Theme)}>
          {Object.entries(kThemes).map(([value, text]) => <option key={value} value={value}>{text}</option>)}
        </select>
      </label>
      <span class="who" title={session.roles.join(', ')}>{session.name.replace(/^users\//, '')}
        <span class="muted small"> {session.roles.map((role) => role.toLowerCase().replaceAll('_', ' ')).join(', ')}</span></span>
      <button type="button" class="quiet" onClick={() => void signOut()}>Sign out</button>
    </div>
  );
}

function Body({ path }: { path: string }) {
  const page = kPages.find(({ pattern }) => pattern.test(path));
  const [loaded, setLoaded] = useState<{ page: Page; module?: PageModule; failed?: boolean }>();
  useEffect(() => {
    if (!page) return;
    let isOver = false, again: ReturnType<typeof setTimeout> | undefined;
    // Where the gateway is away it is fetched once that is back.
    const load = () => page.load().then((module) => { if (!isOver) setLoaded({ page, module }); }, () => {
      if (isOver) return;
      setLoaded({ page, failed: true });
      again = setTimeout(load, kFetchAgainMs);
    });
    void load();
    return () => { isOver = true; clearTimeout(again); };
  }, [page]);
  if (!page) return <Empty title="There is no such page">The address may be mistyped. <a href="/">To the fleet</a></Empty>;
  if (loaded?.page !== page) return <Loading what="the page" />;
  if (!loaded.module) {
    return <Empty title="The page could not be fetched">The gateway is away: it is asked again every 3 seconds. Or the plant was updated: <button type="button" onClick={() => location.reload()}>Load again</button></Empty>;
  }
  const Content = loaded.module.default;
  return <Guarded key={path}><Content argument={decodeURIComponent(page.pattern.exec(path)?.[1] ?? '')} /></Guarded>;
}

// A page that fails to draw itself says so, instead of standing as it was for ever; the rest of the shell goes on.
function Guarded({ children }: { children: ComponentChildren }) {
  const [failure, drawAgain] = useErrorBoundary((error: unknown) => console.error(error));
  if (failure === undefined) return <>{children}</>;
  return <Empty title="This page could not be drawn">A fault of the page, not of the plant: {String(failure)}. <button type="button" onClick={drawAgain}>Draw it again</button></Empty>;
}

export function Heading({ children, title }: { children: ComponentChildren; title: string }) {
  const heading = useRef<HTMLHeadingElement>(null);
  useEffect(() => { document.title = `${title} – Sixpoint`; }, [title]);
  // A screen reader is told where one is now, as it would be by a page that loads.
  useEffect(() => { if (document.activeElement === document.body || document.activeElement?.tagName === 'A') heading.current?.focus({ preventScroll: true }); }, []);
  return <h1 ref={heading} tabIndex={-1}>{children}</h1>;
}

export function Shell() {
  const state = useCell(sessionState);
  const { path } = useRoute();
  useEffect(() => { void lookAtSession(); }, []);
  useEffect(() => {
    if (state.is !== 'away') return;
    const timer = setInterval(() => void lookAtSession(), 3000);
    return () => clearInterval(timer);
  }, [state.is]);
  useEffect(() => {
    document.addEventListener('click', followLinks);
    return () => document.removeEventListener('click', followLinks);
  }, []);

  if (state.is === 'unknown') return <main class="alone"><Loading what="the plant" /></main>;
  if (state.is === 'away') return <main class="alone"><h1>Sixpoint</h1><Empty title="The gateway does not answer">It is asked again every 3 seconds.</Empty></main>;
  if (state.is === 'out') return <SignIn wasIn={state.wasIn} />;
  return (
    <>
      <a class="skip" href="#content">To the content</a>
      <header class="top no-print">
        <a class="brand" href="/"><img src="/icon.svg" alt="" width="22" height="22" /> Sixpoint</a>
        <nav aria-label="Pages">{kLinks.map(({ href, text, isHere }) => (
          <a key={href} href={href} aria-current={isHere(path) ? 'page' : undefined}>{text}</a>
        ))}</nav>
        <form class="jump" role="search" onSubmit={(event) => {
          event.preventDefault();
          const field = event.currentTarget.elements.namedItem('serial') as HTMLInputElement;
          if (field.value.trim() !== '') go(`/blades?serial=${encodeURIComponent(field.value.trim())}`);
          field.value = '';
        }}>
          <input name="serial" aria-label="Find a blade by serial number" placeholder="Find blade…" maxLength={64} autocomplete="off" spellcheck={false} />
        </form>
        <Account session={state.session} />
      </header>
      <Notice />
      <main id="content"><Body path={path} /></main>
    </>
  );
}

// A list that is fetched page by page, as far as somebody wants to see; anew from its beginning when the question changes or events touch it.
import { useEffect, useRef, useState } from 'preact/hooks';
import type { Event } from '#proto/sixpoint/plant/v1/event_pb';
import { onEvents } from './events';
import { recoveries } from './reach';
import { refusalOf, type Refusal } from './refusal';

export type Page<T> = { rows: T[]; nextPageToken: string };
export type Paged<T> = {
  rows: T[] | undefined;  // undefined: the first page is not there yet
  hasMore: boolean;
  isAsking: boolean;
  refusal: Refusal | undefined;
  more: () => void;
  again: () => void;
};

// The first `most` rows, or all there are: a page may have fewer than were asked for.
export async function firstRows<T>(most: number, fetchPage: (pageToken: string, pageSize: number) => Promise<Page<T>>): Promise<T[]> {
  const rows: T[] = [];
  let pageToken = '';
  do {
    const page = await fetchPage(pageToken, most - rows.length);
    rows.push(...page.rows);
    pageToken = page.nextPageToken;
  } while (pageToken !== '' && rows.length < most);
  return rows;
}

type State<T> = { rows: T[] | undefined; next: string; pageCount: number; isAsking: boolean; refusal: Refusal | undefined };
const kLeastPauseMs = 400;

export function usePaged<T>(question: unknown[], fetchPage: (pageToken: string, signal: AbortSignal) => Promise<Page<T>>, isTouchedBy?: (event: Event) => boolean, leastPauseMs = kLeastPauseMs): Paged<T> {
  const empty: State<T> = { rows: undefined, next: '', pageCount: 1, isAsking: true, refusal: undefined };
  const [state, setState] = useState(empty);
  const [turn, setTurn] = useState(0);
  const key = JSON.stringify(question), askedKey = useRef(key);
  const touched = useRef(isTouchedBy);
  touched.current = isTouchedBy;
  const running = useRef<AbortController>();
  const shown = useRef(state);
  shown.current = state;

  const ask = async (from: T[], pageToken: string, pages: number, pageCount: number) => {
    running.current?.abort();
    const stop = (running.current = new AbortController());
    setState((old) => ({ ...old, isAsking: true }));
    try {
      const rows = [...from];
      let next = pageToken;
      for (let i = 0; i < pages && (i === 0 || next !== ''); ++i) {
        const page = await fetchPage(next, stop.signal);
        rows.push(...page.rows);
        next = page.nextPageToken;
      }
      if (!stop.signal.aborted) setState({ rows, next, pageCount, isAsking: false, refusal: undefined });
    } catch (error) {
      if (!stop.signal.aborted) setState((old) => ({ ...old, isAsking: false, refusal: refusalOf(error) }));
    }
  };

  useEffect(() => {
    const isNew = askedKey.current !== key;
    askedKey.current = key;
    if (isNew) setState(empty);
    // As many pages as were shown: what changes does not take away what one looks at.
    const pages = isNew ? 1 : shown.current.pageCount;
    void ask([], '', pages, pages);
    return () => running.current?.abort();
  }, [key, turn]);
  useEffect(() => {
    if (!state.refusal?.isAway) return;
    const retry = setTimeout(() => setTurn((n) => n + 1), 3000);
    return () => clearTimeout(retry);
  }, [state.refusal]);
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    // What is being fetched is not begun anew: a search that takes longer than events take to come would never end.
    const turnOrWait = () => { if (shown.current.isAsking) timer = setTimeout(turnOrWait, leastPauseMs); else { timer = undefined; setTurn((n) => n + 1); } };
    const soon = () => { timer ??= setTimeout(turnOrWait, leastPauseMs); };
    const quiet = [onEvents((events) => { if (touched.current && events.some(touched.current)) soon(); }), recoveries.listen(soon)];
    return () => { clearTimeout(timer); for (const stop of quiet) stop(); };
  }, []);

  return {
    rows: state.rows, hasMore: state.next !== '', isAsking: state.isAsking, refusal: state.refusal,
    more: () => { if (state.rows && state.next !== '' && !state.isAsking) void ask(state.rows, state.next, 1, state.pageCount + 1); },
    again: () => setTurn((n) => n + 1),
  };
}

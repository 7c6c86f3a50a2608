// What a page asks of the plant: asked again when the question changes, when events say so, and when what was away answers again.
import { useEffect, useRef, useState } from 'preact/hooks';
import type { Event } from '#proto/sixpoint/plant/v1/event_pb';
import { onEvents } from './events';
import { recoveries } from './reach';
import { refusalOf, type Refusal } from './refusal';

export type Asked<T> = {
  value: T | undefined;  // the last good answer: kept while it is asked again
  refusal: Refusal | undefined;
  isLoading: boolean;
  again: () => void;
};

const kLeastPauseMs = 400;  // between two of the same question, however many events come

export function useAsked<T>(
  question: unknown[], ask: (signal: AbortSignal) => Promise<T>, isTouchedBy?: (event: Event) => boolean,
): Asked<T> {
  const [state, setState] = useState<Omit<Asked<T>, 'again'>>({ value: undefined, refusal: undefined, isLoading: true });
  const [turn, setTurn] = useState(0);
  const touched = useRef(isTouchedBy);
  touched.current = isTouchedBy;
  const key = JSON.stringify(question);
  const askedKey = useRef<string>();

  useEffect(() => {
    const stop = new AbortController();
    let retry: ReturnType<typeof setTimeout> | undefined;
    const isNew = askedKey.current !== key;
    askedKey.current = key;
    setState((old) => ({ ...old, value: isNew ? undefined : old.value, isLoading: true }));
    ask(stop.signal).then(
      (value) => { if (!stop.signal.aborted) setState({ value, refusal: undefined, isLoading: false }); },
      (error: unknown) => {
        if (stop.signal.aborted) return;
        const refusal = refusalOf(error);
        setState((old) => ({ ...old, refusal, isLoading: false }));
        if (refusal.isAway) retry = setTimeout(() => setTurn((n) => n + 1), 3000);
      });
    return () => { stop.abort(); clearTimeout(retry); };
  }, [key, turn]);

  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    let last = 0;
    const again = () => {
      if (timer) return;
      timer = setTimeout(() => { timer = undefined; last = Date.now(); setTurn((n) => n + 1); },
        Math.max(0, last + kLeastPauseMs - Date.now()));
    };
    const quiet = [
      onEvents((events) => { if (touched.current && events.some(touched.current)) again(); }),
      recoveries.listen(again),
    ];
    return () => { clearTimeout(timer); for (const stop of quiet) stop(); };
  }, []);

  return { ...state, again: () => setTurn((n) => n + 1) };
}

// The journal as it grows: one watch for the whole page, gone on with after every break by the last number that was looked at.
import { Code, ConnectError } from '@connectrpc/connect';
import { EventService, type Event } from '#proto/sixpoint/plant/v1/event_pb';
import { Cell } from './cell';
import { client } from './clients';
import { lookAtSession, sessionState } from './session';

export type EventsState = 'starting' | 'live' | 'broken';
export const eventsState = new Cell<EventsState>('starting');

const kSilenceMs = 20_000;  // an answer comes every 5 s; docs/events.md
const kLongestPauseMs = 10_000;

const listeners = new Set<(events: Event[]) => void>();
let afterSequence: bigint | undefined;
let running: AbortController | undefined;

export function onEvents(listener: (events: Event[]) => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

const pause = (ms: number) => new Promise((resolve) => setTimeout(resolve, ms));

async function watchOnce(signal: AbortSignal): Promise<void> {
  const silence = new AbortController();
  let alarm = setTimeout(() => silence.abort(), kSilenceMs);
  const request = afterSequence === undefined ? { fromNow: true } : { afterSequence };
  try {
    for await (const answer of client(EventService).watchEvents(request, { signal: AbortSignal.any([signal, silence.signal]) })) {
      clearTimeout(alarm);
      alarm = setTimeout(() => silence.abort(), kSilenceMs);
      afterSequence = answer.lookedAtSequence;
      eventsState.set('live');
      if (answer.events.length > 0) for (const listener of [...listeners]) listener(answer.events);
    }
  } finally {
    clearTimeout(alarm);
  }
}

async function watch(signal: AbortSignal): Promise<void> {
  let pauseMs = 500;
  while (!signal.aborted) {
    const began = Date.now();
    try {
      await watchOnce(signal);
    } catch (error) {
      if (signal.aborted) return;
      const code = ConnectError.from(error).code;
      if (code === Code.PermissionDenied) return;
      // A stream is told at its end that the session is over, where no call is refused.
      if (code === Code.Unauthenticated) await lookAtSession();
      // Past the newest entry: another plant answers, or an older state of it was restored. Begin anew.
      if (code === Code.InvalidArgument) afterSequence = undefined;
    }
    if (signal.aborted) return;
    pauseMs = Date.now() - began > 30_000 ? 500 : Math.min(2 * pauseMs, kLongestPauseMs);
    eventsState.set('broken');
    await pause(pauseMs * (0.75 + 0.5 * Math.random()));
  }
}

// Only while somebody is signed in and looks: a person may have 8 watches, and all persons together 32.
function startOrStop(): void {
  const wanted = sessionState.value.is === 'in' && document.visibilityState === 'visible';
  if (wanted && !running) {
    running = new AbortController();
    void watch(running.signal);
  } else if (!wanted && running) {
    running.abort();
    running = undefined;
  }
}

export function followTheJournal(): void {
  sessionState.listen(startOrStop);
  document.addEventListener('visibilitychange', startOrStop);
  startOrStop();
}

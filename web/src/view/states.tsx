// What stands where there is no value yet, none at all, or a refusal.
import type { ComponentChildren } from 'preact';
import type { Asked } from '../plant/asked';
import type { Paged } from '../plant/paged';
import type { Refusal } from '../plant/refusal';

export const Loading = ({ what }: { what: string }) => (
  <div class="state state-loading" role="status"><span class="bar" aria-hidden="true" />Loading {what}…</div>
);

export const Empty = ({ title, children }: { title: string; children?: ComponentChildren }) => (
  <div class="state state-empty"><strong>{title}</strong>{children && <p>{children}</p>}</div>
);

export const Refused = ({ refusal, again }: { refusal: Refusal; again?: () => void }) => (
  <div class="state state-refused" role="alert">
    <strong>{refusal.title}</strong>
    <p>{refusal.text}</p>
    {refusal.violations.length > 0 && (
      <ul>{refusal.violations.map((v) => (
        <li key={v.field}><code>{v.field}</code>{v.value && <> is <q>{v.value}</q></>}; wanted: {v.wanted}</li>
      ))}</ul>
    )}
    <p class="small">
      {refusal.isAway ? 'It is asked again every few seconds. ' : ''}
      {refusal.reason && <span class="muted">{refusal.reason}</span>} {again && <button type="button" class="quiet" onClick={again}>Ask again</button>}
    </p>
  </div>
);

// The last good answer stays while the plant is away: the notice on top says so.
export function Shown<T>({ asked, what, children }: { asked: Asked<T>; what: string; children: (value: T) => ComponentChildren }) {
  if (asked.value !== undefined) return <>{children(asked.value)}</>;
  if (asked.refusal) return <Refused refusal={asked.refusal} again={asked.again} />;
  return <Loading what={what} />;
}

// Of a section that is drawn only where there is something: an empty list stays empty while its service is away.
export const hasNone = (asked: Asked<unknown[]>): boolean => (asked.value ? asked.value.length === 0 : !asked.refusal);

// What stands above a list that comes page by page, and the way to its next page.
export function ListState<T>({ list, what }: { list: Paged<T>; what: string }) {
  if (list.refusal && (list.rows === undefined || !list.refusal.isAway)) return <Refused refusal={list.refusal} again={list.again} />;
  return list.rows === undefined ? <Loading what={what} /> : null;
}

export const More = <T,>({ list, word = 'Show more' }: { list: Paged<T>; word?: string }) =>
  (list.hasMore ? <p><button type="button" disabled={list.isAsking} onClick={list.more}>{list.isAsking ? 'Fetching…' : word}</button></p> : null);

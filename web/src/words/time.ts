// Times as people on a shop floor read them: how long ago, and the clock's time in the browser's zone.
import { timestampDate, type Timestamp } from '@bufbuild/protobuf/wkt';

const kNarrow = '\u202f';
export const dateOf = (timestamp: Timestamp | undefined): Date | undefined => (timestamp ? timestampDate(timestamp) : undefined);

export function duration(seconds: number): string {
  const s = Math.max(0, Math.round(seconds));
  if (s < 60) return `${s}${kNarrow}s`;
  if (s < 3600) return `${Math.round(s / 60)}${kNarrow}min`;
  if (s < 36 * 3600) {
    const minutes = Math.round(s / 60);
    return minutes % 60 === 0 ? `${minutes / 60}${kNarrow}h` : `${Math.floor(minutes / 60)}${kNarrow}h ${minutes % 60}${kNarrow}min`;
  }
  return `${(s / 86400).toFixed(s < 20 * 86400 ? 1 : 0)}${kNarrow}d`;
}

export function ago(when: Date | undefined, now: Date): string {
  if (!when) return 'never';
  const seconds = (now.getTime() - when.getTime()) / 1000;
  return seconds < 5 ? 'just now' : `${duration(seconds)} ago`;
}

const clockFormat = new Intl.DateTimeFormat(undefined, { hour: '2-digit', minute: '2-digit' });
const dayFormat = new Intl.DateTimeFormat(undefined, { weekday: 'short', day: 'numeric', month: 'short' });
const fullFormat = new Intl.DateTimeFormat(undefined, { dateStyle: 'medium', timeStyle: 'medium' });

export const clock = (when: Date): string => clockFormat.format(when);
export const day = (when: Date): string => dayFormat.format(when);
export const full = (when: Date | undefined): string => (when ? fullFormat.format(when) : '');

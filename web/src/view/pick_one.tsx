// One of several results, the newest first: which, where there is a choice, and that one. Of none, nothing.
import type { ComponentChildren } from 'preact';

// label: of the choice; words: of each in it; picked: its place.
export function PickOne<T extends { name: string }>({ all, label, picked, onPick, words, children }: { all: T[]; label: string; picked: number; onPick: (place: number) => void; words: (one: T) => string; children: (one: T) => ComponentChildren }) {
  return (
    <>
      {all.length > 1 && <label class="no-print">{label} <select value={picked} onChange={(event) => onPick(Number(event.currentTarget.value))}>
        {all.map((one, i) => <option key={one.name} value={i}>{words(one)}</option>)}</select></label>}
      {all.length > 0 && children(all[Math.min(picked, all.length - 1)]!)}
    </>
  );
}

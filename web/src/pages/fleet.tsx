// The fleet: a tile a machine, the one that needs somebody first.
import { useEffect, useMemo, useState } from 'preact/hooks';
import { timestampFromDate } from '@bufbuild/protobuf/wkt';
import { AlarmKind, BladeStep, FleetService, type MachineState } from '#proto/sixpoint/plant/v1/fleet_pb';
import { client } from '../plant/clients';
import { onEvents } from '../plant/events';
import { recoveries } from '../plant/reach';
import { refusalOf, type Refusal } from '../plant/refusal';
import { setQuery, useRoute } from '../plant/route';
import { doingOf, isUrgent } from '../words/machine';
import { idOf, withoutRevision } from '../words/name';
import { percent, plural } from '../words/quantity';
import { dateOf, duration } from '../words/time';
import { CopyCsv, type Column } from '../view/table';
import { Empty, Loading, Refused } from '../view/states';
import { Heading } from '../view/shell';
import { useNow } from '../view/now';
import { MachineTile, type Happening } from './machine_tile';

const kPageSize = 50;
const kSpans: [hours: number, word: string][] = [[8, 'last 8 hours'], [24, 'last 24 hours'], [168, 'last 7 days'], [720, 'last 30 days']];

type Fleet = { machines: Map<string, MachineState>; isWhole: boolean; refusal?: Refusal | undefined; countedFrom?: Date | undefined };

const spanOf = (hours: number) => ({ from: timestampFromDate(new Date(Date.now() - hours * 3600_000)) });

// Or soon enough where nothing is drawn: behind another tab.
const drawn = () => new Promise<void>((resolve) => { requestAnimationFrame(() => setTimeout(resolve)); setTimeout(resolve, 250); });

// All machines page by page, the first shown as soon as it is there; then one at a time, as events name them.
function useFleet(hours: number): [Fleet, Map<string, Happening>, () => void] {
  const [fleet, setFleet] = useState<Fleet>({ machines: new Map(), isWhole: false });
  const [happenings, setHappenings] = useState(new Map<string, Happening>());
  const [turn, setTurn] = useState(0);

  useEffect(() => {
    const stop = new AbortController();
    let retry: ReturnType<typeof setTimeout> | undefined;
    const load = async () => {
      const machines = new Map<string, MachineState>();
      let pageToken = '';
      const span = spanOf(hours);
      do {
        const page = await client(FleetService).listMachineStates({ pageSize: kPageSize, pageToken, span }, { signal: stop.signal });
        for (const machine of page.machines) machines.set(machine.machine, machine);
        pageToken = page.nextPageToken;
        const isWhole = pageToken === '';
        // While an older state is on the screen it stays whole until the new one is.
        setFleet((old) => (old.machines.size > machines.size && !isWhole
          ? { ...old, refusal: undefined }
          : { machines: new Map(machines), isWhole, countedFrom: dateOf(page.countedFrom) }));
        // The first tiles are on the screen before the next are asked for: what answers them and what draws them may share a processor.
        if (machines.size === page.machines.length) await drawn();
      } while (pageToken !== '');
    };
    load().catch((error: unknown) => {
      if (stop.signal.aborted) return;
      const refusal = refusalOf(error);
      setFleet((old) => ({ ...old, refusal }));
      if (refusal.isAway) retry = setTimeout(() => setTurn((n) => n + 1), 3000);
    });
    return () => { stop.abort(); clearTimeout(retry); };
  }, [hours, turn]);

  useEffect(() => {
    const stop = new AbortController();
    const wanted = new Set<string>();
    let isAsking = false;
    const askWanted = async () => {
      if (isAsking) return;
      isAsking = true;
      try {
        while (wanted.size > 0 && !stop.signal.aborted) {
          const name = wanted.values().next().value!;
          wanted.delete(name);
          const answer = await client(FleetService).listMachineStates({ machine: name, span: spanOf(hours) }, { signal: stop.signal });
          const machine = answer.machines[0];
          if (machine) setFleet((old) => ({ ...old, machines: new Map(old.machines).set(name, machine) }));
        }
      } catch { wanted.clear(); /* said by the notice; all is asked again when it recovers */ } finally { isAsking = false; }
    };
    const quiet = onEvents((events) => {
      const news = new Map<string, Happening>();
      for (const { entry } of events) {
        if (!entry?.machine) continue;
        const name = withoutRevision(entry.machine);
        news.set(name, { kind: entry.kind, blade: entry.blade, verdict: entry.verdict, at: dateOf(entry.recordedAt) ?? new Date() });
        wanted.add(name);
      }
      if (news.size === 0) return;
      setHappenings((old) => new Map([...old, ...news]));
      void askWanted();
    });
    // What changes by the clock alone (a stalled upload, an expiry) has no event.
    const slowly = setInterval(() => { if (document.visibilityState === 'visible') setTurn((n) => n + 1); }, 60_000);
    const recovered = recoveries.listen(() => setTurn((n) => n + 1));
    return () => { stop.abort(); quiet(); recovered(); clearInterval(slowly); };
  }, [hours]);

  return [fleet, happenings, () => setTurn((n) => n + 1)];
}

const urgency = (machine: MachineState): number => (machine.alarms.some((alarm) => isUrgent(alarm.kind)) ? 0 : machine.alarms.length > 0 ? 1 : 2);

const kShows: Record<string, [word: string, lets: (machine: MachineState, now: Date) => boolean]> = {
  all: ['All', () => true],
  attention: ['Need attention', (machine) => machine.alarms.length > 0],
  working: ['Working', (machine, now) => doingOf(machine, now).isWorking],
  standing: ['Not working', (machine, now) => !doingOf(machine, now).isWorking],
};

const seconds = (machine: MachineState, step: BladeStep) => machine.steps.find((one) => one.step === step);

const kCsv: Column<MachineState>[] = [
  { head: 'machine', cell: () => '', csv: (m) => idOf(m.machine) },
  { head: 'last contact', cell: () => '', csv: (m) => dateOf(m.lastContact)?.toISOString() },
  { head: 'blades in work', cell: () => '', csv: (m) => m.bladesInWorkCount },
  { head: 'blades judged', cell: () => '', csv: (m) => m.throughput?.bladesJudgedCount },
  { head: 'conform', cell: () => '', csv: (m) => m.yield?.conformCount },
  { head: 'not conform', cell: () => '', csv: (m) => m.yield?.notConformCount },
  { head: 'undecidable', cell: () => '', csv: (m) => m.yield?.undecidableCount },
  { head: 'not measured', cell: () => '', csv: (m) => m.yield?.notMeasuredCount },
  { head: 'cycle median', unit: 's', cell: () => '', csv: (m) => seconds(m, BladeStep.FIRST_SCAN_TO_VERDICT)?.p50S },
  { head: 'cycle 95 %', unit: 's', cell: () => '', csv: (m) => seconds(m, BladeStep.FIRST_SCAN_TO_VERDICT)?.p95S },
  { head: 'wait for program median', unit: 's', cell: () => '', csv: (m) => seconds(m, BladeStep.CORRECTION_TO_FETCH)?.p50S },
  { head: 'alarms', cell: () => '', csv: (m) => m.alarms.map((alarm) => alarm.message).join(' | ') },
];

function Sums({ machines, now, word }: { machines: MachineState[]; now: Date; word: string }) {
  let working = 0, attention = 0, judged = 0n, conform = 0n, verdicts = 0n, waits = 0;
  for (const machine of machines) {
    const doing = doingOf(machine, now);
    if (doing.isWorking) working += 1;
    if (machine.alarms.some((alarm) => alarm.kind === AlarmKind.CORRECTION_AWAITS)) waits += 1;
    if (machine.alarms.length > 0) attention += 1;
    judged += machine.throughput?.bladesJudgedCount ?? 0n;
    const y = machine.yield;
    conform += y?.conformCount ?? 0n;
    verdicts += (y?.conformCount ?? 0n) + (y?.notConformCount ?? 0n) + (y?.undecidableCount ?? 0n) + (y?.notMeasuredCount ?? 0n);
  }
  return (
    <dl class="sums">
      <div><dt>Working now</dt><dd>{working} <span class="muted">of {machines.length}</span></dd></div>
      <div><dt>Wait for a person</dt><dd><a href="/corrections">{waits}</a></dd></div>
      <div><dt>Need attention</dt><dd>{attention}</dd></div>
      <div><dt>Blades judged, {word}</dt><dd>{String(judged)}</dd></div>
      <div><dt>Conform, {word}</dt><dd>{verdicts > 0n ? percent(Number(conform) / Number(verdicts)) : 'no verdict'} <span class="muted">{verdicts > 0n ? `${conform} of ${verdicts}` : ''}</span></dd></div>
    </dl>
  );
}

export default function FleetPage() {
  const { query } = useRoute();
  const hours = kSpans.find(([h]) => String(h) === query.get('hours'))?.[0] ?? 24;
  const spanWord = kSpans.find(([h]) => h === hours)![1];
  const show = kShows[query.get('show') ?? 'all'] ? (query.get('show') ?? 'all') : 'all';
  const text = query.get('find') ?? '';
  const byName = query.get('sort') === 'name';
  const [fleet, happenings, again] = useFleet(hours);
  const now = useNow();
  const all = useMemo(() => [...fleet.machines.values()], [fleet.machines]);

  const shown = useMemo(() => {
    const wanted = text.toLowerCase();
    return all
      .filter((machine) => kShows[show]![1](machine, now))
      .filter((machine) => wanted === '' || idOf(machine.machine).toLowerCase().includes(wanted)
        || machine.uploads.some((upload) => upload.subject.toLowerCase().includes(wanted)))
      .sort((a, b) => (byName ? 0 : urgency(a) - urgency(b)) || a.machine.localeCompare(b.machine, undefined, { numeric: true }));
  }, [all, show, text, byName, now]);

  return (
    <>
      <div class="page-head">
        <Heading title="Fleet">Fleet</Heading>
        <div class="filters" role="group" aria-label="Which machines, and of which time">
          <label>Find <input type="search" value={text} placeholder="machine or blade" onInput={(event) => setQuery({ find: event.currentTarget.value })} /></label>
          <label>Show <select value={show} onChange={(event) => setQuery({ show: event.currentTarget.value === 'all' ? '' : event.currentTarget.value })}>
            {Object.entries(kShows).map(([value, [word]]) => <option key={value} value={value}>{word}</option>)}
          </select></label>
          <label>Counted <select value={String(hours)} onChange={(event) => setQuery({ hours: event.currentTarget.value === '24' ? '' : event.currentTarget.value })}>
            {kSpans.map(([h, word]) => <option key={h} value={String(h)}>{word}</option>)}
          </select></label>
          <label>Order <select value={byName ? 'name' : ''} onChange={(event) => setQuery({ sort: event.currentTarget.value })}>
            <option value="">Urgent first</option><option value="name">By name</option>
          </select></label>
          <CopyCsv columns={kCsv} rows={shown} what="the machines shown" />
        </div>
      </div>
      {all.length > 0 && <Sums machines={all} now={now} word={spanWord} />}
      {fleet.refusal && all.length === 0 && <Refused refusal={fleet.refusal} again={again} />}
      {!fleet.refusal && all.length === 0 && (fleet.isWhole
        ? <Empty title="No machine is registered yet">A machine shows here once it is: <code>sixpoint machine add FILE</code>.</Empty>
        : <Loading what="the machines" />)}
      {all.length > 0 && shown.length === 0 && <Empty title="No machine is like that">{plural(all.length, 'machine')} {all.length === 1 ? 'is' : 'are'} left out by the filter. <a href="/">Show all</a></Empty>}
      {shown.length > 0 && (
        <>
          <p class="small muted" role="status">{shown.length === all.length ? plural(all.length, 'machine') : `${shown.length} of ${all.length} machines`}{!fleet.isWhole && ', more are being fetched'}.
            {' '}Times are medians, known to 9&#8239;%. Counted since {fleet.countedFrom ? `${duration((now.getTime() - fleet.countedFrom.getTime()) / 1000)} ago` : spanWord}, in whole hours.
            {' '}<span class="key"><span class="swatch strip-good" /> conform <span class="swatch strip-bad" /> not conform <span class="swatch strip-unsure" /> undecidable or not measured, on top of each other hour by hour; <span class="swatch strip-work" /> below: work.</span></p>
          <ul class="tiles">{shown.map((machine) => (
            <MachineTile key={machine.machine} state={machine} happening={happenings.get(machine.machine)} hours={hours} now={now} />
          ))}</ul>
        </>
      )}
    </>
  );
}

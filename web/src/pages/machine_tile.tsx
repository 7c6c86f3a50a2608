// One machine of the fleet. What is off the screen costs nothing: its time line is fetched when it is first seen.
import { timestampFromDate } from '@bufbuild/protobuf/wkt';
import { memo } from '../view/memo';
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { BladeStep, FleetService, type ActivityHour, type MachineCalibration, type MachineState, type StepTime } from '#proto/sixpoint/plant/v1/fleet_pb';
import { client } from '../plant/clients';
import { refusalOf } from '../plant/refusal';
import { alarmPage, alarmWord, calibrationWord, doingOf, happened, isUrgent, kStepWords, parameterWords, stepOf } from '../words/machine';
import { idOf, pageOf } from '../words/name';
import { number, percent, plural, pointCount } from '../words/quantity';
import { ago, clock, dateOf, day, duration, full } from '../words/time';
import { Mark, verdictWords } from '../view/mark';
import { Table, type Column } from '../view/table';

export type Happening = { kind: string; blade: string; verdict: string; at: Date };

function Age({ one }: { one: MachineCalibration }) {
  const drift = one.drift;
  const isFlagged = (drift?.flaggedParameters.length ?? 0) > 0;
  const words = drift ? parameterWords(drift.parameter) : undefined;
  const title = [`${one.name}, valid until ${full(dateOf(one.validUntil))}.`,
    drift && words ? `Moved most since the one before: ${words.name} by ${drift.change.toPrecision(3)} ${words.unit}, ${drift.changeRatio.toFixed(1)} combined standard uncertainties; more than 3 is flagged.` : 'There was none before.'].join(' ');
  return (
    <tr title={title}>
      <th scope="row"><a href={pageOf(one.name)}>{calibrationWord(one)}</a></th>
      <td class="num">{one.inForce ? duration(one.ageDays * 86400) : <span class="tone-bad">over</span>}</td>
      <td class={`num${isFlagged ? ' tone-unsure' : ''}`}>{drift ? <>{isFlagged && '▲ '}{number(drift.changeRatio, 1)}&#8239;u</> : 'first'}</td>
    </tr>
  );
}

const Times = ({ word, step }: { word: string; step: StepTime | undefined }) => (
  <div><dt>{word}</dt><dd>{step ? duration(step.p50S) : <span class="muted">none</span>}{step && <span class="muted small"> 95&#8239;% {duration(step.p95S)}</span>}</dd></div>
);

// Hour by hour, what ended: verdicts as bars, work without a verdict as a line below.
function useActivity(machine: string, hours: number, isSeen: boolean, happening: Happening | undefined) {
  const [activity, setActivity] = useState<{ hours: ActivityHour[]; from: Date; until: Date } | string>();
  const span = Math.min(hours, 48);
  const turn = happening?.at.getTime() ?? 0;
  useEffect(() => {
    if (!isSeen) return;
    const stop = new AbortController();
    client(FleetService).getMachineActivity({ machine, span: { from: timestampFromDate(new Date(Date.now() - span * 3600_000)) } }, { signal: stop.signal }).then(
      (answer) => setActivity({ hours: answer.hours, from: dateOf(answer.countedFrom)!, until: dateOf(answer.countedUntil)! }),
      (error: unknown) => { if (!stop.signal.aborted) setActivity((old) => old ?? refusalOf(error).title); });
    return () => stop.abort();
  }, [machine, span, isSeen, turn]);
  return activity;
}

type Slot = { at: Date; hour: ActivityHour | undefined };

function slotsOf(activity: { hours: ActivityHour[]; from: Date; until: Date }): Slot[] {
  const byTime = new Map(activity.hours.map((hour) => [dateOf(hour.beginsAt)!.getTime(), hour]));
  const slots: Slot[] = [];
  for (let t = activity.from.getTime(); t < activity.until.getTime() && slots.length < 72; t += 3600_000) slots.push({ at: new Date(t), hour: byTime.get(t) });
  return slots;
}

const work = (hour: ActivityHour): number => {
  const t = hour.throughput;
  return t ? Number(t.scanCount + t.registrationCount + t.correctionCount + t.fetchCount + t.cutCount + t.inspectionCount) : 0;
};

function Strip({ slots, name }: { slots: Slot[]; name: string }) {
  const kHigh = 26, kLine = 4;
  const most = Math.max(3, ...slots.map(({ hour }) => Number((hour?.yield?.conformCount ?? 0n) + (hour?.yield?.notConformCount ?? 0n) + (hour?.yield?.undecidableCount ?? 0n) + (hour?.yield?.notMeasuredCount ?? 0n))));
  const mostWork = Math.max(1, ...slots.map(({ hour }) => (hour ? work(hour) : 0)));
  let good = 0, other = 0, idle = 0;
  const bars = slots.map(({ hour }, i) => {
    if (!hour || work(hour) === 0) { idle += 1; return null; }
    const g = Number(hour.yield?.conformCount ?? 0n), b = Number(hour.yield?.notConformCount ?? 0n);
    const u = Number((hour.yield?.undecidableCount ?? 0n) + (hour.yield?.notMeasuredCount ?? 0n));
    good += g; other += b + u;
    const unit = kHigh / most;
    const strength = work(hour) / mostWork;
    return (
      <g key={i}>
        <rect class="strip-work" x={i + 0.06} width={0.88} y={kHigh + 2} height={kLine} opacity={0.35 + 0.65 * strength} />
        {g > 0 && <rect class="strip-good" x={i + 0.12} width={0.76} y={kHigh - g * unit} height={g * unit} />}
        {u > 0 && <rect class="strip-unsure" x={i + 0.12} width={0.76} y={kHigh - (g + u) * unit} height={u * unit} />}
        {b > 0 && <rect class="strip-bad" x={i + 0.12} width={0.76} y={kHigh - (g + u + b) * unit} height={b * unit} />}
      </g>
    );
  });
  const words = `${name}, hour by hour: ${good} conform, ${other} other verdicts, ${idle} of ${slots.length} hours without work.`;
  return (
    <figure class="strip">
      <svg viewBox={`0 0 ${slots.length} ${kHigh + kLine + 2}`} preserveAspectRatio="none" role="img" aria-label={words}>
        <line class="strip-base" x1="0" x2={slots.length} y1={kHigh + 0.5} y2={kHigh + 0.5} />{bars}
      </svg>
      <figcaption class="small muted"><span>{slots[0] ? (slots.length > 24 ? `${day(slots[0].at)} ` : '') + clock(slots[0].at) : ''}</span><span>now</span></figcaption>
    </figure>
  );
}

const kHours: Column<Slot>[] = [
  { head: 'Hour', cell: ({ at }) => `${day(at)} ${clock(at)}`, csv: ({ at }) => at.toISOString() },
  { head: 'Scans', isNumber: true, cell: ({ hour }) => String(hour?.throughput?.scanCount ?? 0), csv: ({ hour }) => hour?.throughput?.scanCount ?? 0 },
  { head: 'Corrections', isNumber: true, cell: ({ hour }) => String(hour?.throughput?.correctionCount ?? 0), csv: ({ hour }) => hour?.throughput?.correctionCount ?? 0 },
  { head: 'Programs', isNumber: true, cell: ({ hour }) => String(hour?.throughput?.fetchCount ?? 0), csv: ({ hour }) => hour?.throughput?.fetchCount ?? 0 },
  { head: 'Judged', isNumber: true, cell: ({ hour }) => String(hour?.throughput?.inspectionCount ?? 0), csv: ({ hour }) => hour?.throughput?.inspectionCount ?? 0 },
  { head: 'Conform', isNumber: true, cell: ({ hour }) => String(hour?.yield?.conformCount ?? 0), csv: ({ hour }) => hour?.yield?.conformCount ?? 0 },
  { head: 'Not conform', isNumber: true, cell: ({ hour }) => String(hour?.yield?.notConformCount ?? 0), csv: ({ hour }) => hour?.yield?.notConformCount ?? 0 },
];

const kStepColumns: Column<StepTime>[] = [
  { head: 'Step', cell: (step) => kStepWords[step.step], csv: (step) => kStepWords[step.step] },
  { head: 'Ended', isNumber: true, cell: (step) => String(step.count), csv: (step) => step.count },
  { head: 'Median', isNumber: true, cell: (step) => duration(step.p50S), csv: (step) => step.p50S },
  { head: 'Mean', isNumber: true, cell: (step) => duration(step.meanS), csv: (step) => step.meanS },
  { head: '95 %', isNumber: true, cell: (step) => duration(step.p95S), csv: (step) => step.p95S },
];

function Tile({ state, happening, hours, now }: { state: MachineState; happening: Happening | undefined; hours: number; now: Date }) {
  const place = useRef<HTMLLIElement>(null);
  const [isSeen, setSeen] = useState(false);
  const [isOpen, setOpen] = useState(false);
  useEffect(() => {
    const watcher = new IntersectionObserver(([entry]) => { if (entry!.isIntersecting) setSeen(true); }, { rootMargin: '200px' });
    watcher.observe(place.current!);
    return () => watcher.disconnect();
  }, []);
  const activity = useActivity(state.machine, hours, isSeen, happening);
  const slots = useMemo(() => (activity && typeof activity !== 'string' ? slotsOf(activity) : []), [activity]);
  const id = idOf(state.machine);
  const doing = doingOf(state, now);
  const y = state.yield;
  const verdicts = y ? y.conformCount + y.notConformCount + y.undecidableCount + y.notMeasuredCount : 0n;
  const upload = state.uploads[0];
  const news = happening && now.getTime() - happening.at.getTime() < 30_000 ? happening : undefined;
  const href = news?.blade ? pageOf(news.blade) : undefined;
  const isBad = state.alarms.some((alarm) => isUrgent(alarm.kind));

  return (
    <li ref={place} class={`tile${isBad ? ' tile-urgent' : ''}${news ? ' tile-news' : ''}`} data-machine={id} aria-labelledby={`tile-${id}`}>
      <div class="tile-head"><h2 id={`tile-${id}`}><a href={pageOf(state.machine)}>{id}</a></h2><Mark tone={doing.tone}>{doing.word}</Mark></div>
      <p class="tile-now small">
        {news ? <>{href ? <a href={href}>{happened(news.kind, news.blade)}</a> : happened(news.kind, news.blade)}{news.verdict && `: ${verdictWords(news.verdict).toLowerCase()}`}</>
          : upload ? <>{doing.detail || 'a scan'}, {pointCount(upload.pointCount)} so far</>
          : <>{doing.detail || 'last heard'}</>}
        <span class="muted"> · {news ? ago(news.at, now) : ago(dateOf(state.lastContact), now)}</span>
      </p>
      {typeof activity === 'string' ? <p class="strip small muted">Time line: {activity.toLowerCase()}.</p>
        : slots.length > 0 ? <Strip slots={slots} name={id} /> : <div class="strip strip-loading" aria-hidden="true" />}
      <dl class="facts">
        <Times word="Cycle" step={stepOf(state, BladeStep.FIRST_SCAN_TO_VERDICT)} />
        <Times word="Program waits" step={stepOf(state, BladeStep.CORRECTION_TO_FETCH)} />
        <div><dt>Conform</dt><dd>{verdicts > 0n ? <>{percent(y!.conformShare)}<span class="muted small"> {String(y!.conformCount)} of {String(verdicts)}</span></> : <span class="muted">no verdict</span>}</dd></div>
        <div><dt>In work</dt><dd>{plural(state.bladesInWorkCount, 'blade')}</dd></div>
      </dl>
      <table class="ages"><caption class="hidden">Calibrations of {id}: age, and drift in combined standard uncertainties u</caption>
        <thead><tr><th scope="col">Calibration</th><th scope="col" class="num">age</th><th scope="col" class="num" title="Of the parameter that moved most since the calibration before, in combined standard uncertainties u">drift</th></tr></thead>
        <tbody>{state.calibrations.length === 0 ? <tr><td class="muted">No calibration</td></tr> : state.calibrations.map((one) => <Age key={one.name} one={one} />)}</tbody></table>
      {state.alarms.length > 0 && (
        <ul class="alarms">{state.alarms.map((alarm) => (
          <li key={`${alarm.kind}${alarm.subject}`} class={isUrgent(alarm.kind) ? 'urgent' : ''}>
            <strong><a href={alarmPage(alarm.subject, state.machine)}>{alarmWord(alarm.kind)}</a></strong> <span class="small">{alarm.message} <em>{alarm.action}</em> <span class="muted">Since {ago(dateOf(alarm.since), now).replace(' ago', '')}.</span></span>
          </li>
        ))}</ul>
      )}
      <details onToggle={(event) => setOpen(event.currentTarget.open)}>
        <summary>Shift in figures</summary>
        {isOpen && <>
          <Table caption={`Hours of ${id}`} showCaption={false} columns={kHours} rows={slots.filter(({ hour }) => hour)} rowKey={({ at }) => at.toISOString()} />
          <Table caption={`Steps of ${id}`} showCaption={false} columns={kStepColumns} rows={state.steps} rowKey={(step) => String(step.step)} />
        </>}
      </details>
    </li>
  );
}

// Drawn again when its own state, its news or the minute changes; not with every other machine's.
export const MachineTile = memo(Tile, (a, b) => a.state === b.state && a.happening === b.happening && a.hours === b.hours
  && Math.floor(a.now.getTime() / 15_000) === Math.floor(b.now.getTime() / 15_000));

// The values of a machine's calibrations over time, each with U, what a step may be, its slope and a person's limit.
import { useEffect, useRef, useState } from 'preact/hooks';
import { CalibrationService, type Calibration } from '#proto/sixpoint/calibration/v1/calibration_pb';
import { CalibrationState } from '#proto/sixpoint/calibration/v1/state_pb';
import type { CalibrationTrend, ParameterTrend, TrendPoint } from '#proto/sixpoint/calibration/v1/trend_pb';
import { useAsked } from '../plant/asked';
import { useCell } from '../plant/cell';
import { client } from '../plant/clients';
import type { Paged } from '../plant/paged';
import { go, setQuery, useRoute } from '../plant/route';
import { axisOf, parameterName, parametersOf } from '../words/calibration';
import { parameterWords } from '../words/machine';
import { pageOf, shortId } from '../words/name';
import { decimalsFor, number, quantity, withUncertainty } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { Mark, verdictWords } from '../view/mark';
import { download, fileNameOf, sheetOf } from '../view/picture';
import { Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import { isDark } from '../view/theme';

const kMost = 200;
const kAlarms: Record<string, string> = { STEP: 'Step', TREND: 'Slope', LIMIT: 'Beyond its limit' };

const isOfTrend = ({ state }: Calibration) => state !== CalibrationState.DRAFT && state !== CalibrationState.WITHDRAWN;

// Of all of its kind that came into force; not asked where there is none, which the plant refuses. Anew when one of them came or changed.
export function useTrend(calibration: Calibration | undefined, history: Paged<Calibration>) {
  const { query } = useRoute();
  const limits = [...query.entries()].flatMap(([key, text]) => (key.startsWith('limit_') && Number(text) > 0 ? [{ parameter: key.slice(6), limit: Number(text) }] : []));
  const machine = calibration?.machine ?? '', kind = calibration?.kind ?? 0, axis = calibration ? axisOf(calibration) : '';
  const rows = history.rows ?? [], isAsked = calibration !== undefined && (history.hasMore || rows.some(isOfTrend));
  return useAsked([machine, kind, axis, limits, isAsked, rows.map(({ name, state }) => `${name} ${state}`)], async (signal) => (isAsked ? client(CalibrationService).getCalibrationTrend({ machine, kind, axis, limits, mostCount: kMost }, { signal }) : undefined));
}

const nameOf = (trend: ParameterTrend) => parameterName(parameterWords(trend.parameter).name);
const unitOf = (trend: ParameterTrend) => parameterWords(trend.parameter).unit;

const kColumns: Column<ParameterTrend>[] = [
  { head: 'Parameter', cell: nameOf, csv: (p) => p.parameter },
  { head: 'Newest ± U', isNumber: true, cell: (p) => { const last = p.points.at(-1); return last ? withUncertainty(last.value, 2 * last.standardUncertainty, unitOf(p)) : ''; }, csv: (p) => p.points.at(-1)?.value },
  { head: 'Change', isNumber: true, cell: (p) => { const last = p.points.at(-1); return last?.change === undefined ? 'the first' : quantity(last.change, unitOf(p), decimalsFor(2 * last.standardUncertainty, 4)); }, csv: (p) => p.points.at(-1)?.change },
  { head: 'Change over u', isNumber: true, cell: (p) => number(p.points.at(-1)?.changeRatio, 1).replace('not measured', ''), csv: (p) => p.points.at(-1)?.changeRatio },
  { head: 'Slope a day ± U', isNumber: true, cell: (p) => (p.slopePerDay === undefined ? 'fewer than 3' : withUncertainty(p.slopePerDay, 2 * (p.slopeStandardUncertaintyPerDay ?? 0), unitOf(p))), csv: (p) => p.slopePerDay },
  { head: 't', isNumber: true, cell: (p) => (p.slopeT === undefined ? '' : `${number(p.slopeT, 1)} of ${number(p.slopeTLimit, 1)}`), csv: (p) => p.slopeT },
  { head: 'Scatter over stated', isNumber: true, cell: (p) => number(p.scatterRatio, 2).replace('not measured', ''), csv: (p) => p.scatterRatio },
  { head: 'Alarm', cell: (p) => (p.alarms.length > 0 ? <Mark tone="unsure">{p.alarms.map((alarm) => kAlarms[alarm] ?? alarm).join(', ')}</Mark> : <Mark tone="good">None</Mark>), csv: (p) => p.alarms.join(' ') },
];
type Row = { parameter: string; point: TrendPoint };
const kPoints: Column<Row>[] = [
  { head: 'Parameter', cell: (r) => parameterName(parameterWords(r.parameter).name), csv: (r) => r.parameter }, { head: 'Calibration', cell: (r) => <a href={pageOf(r.point.calibration)}>{shortId(r.point.calibration)}</a>, csv: (r) => r.point.calibration },
  { head: 'Valid from', cell: (r) => full(dateOf(r.point.validFrom)), csv: (r) => dateOf(r.point.validFrom)?.toISOString() },
  { head: 'Value ± U', isNumber: true, cell: (r) => withUncertainty(r.point.value, 2 * r.point.standardUncertainty, parameterWords(r.parameter).unit), csv: (r) => r.point.value },
  { head: 'u', isNumber: true, cell: (r) => quantity(r.point.standardUncertainty, parameterWords(r.parameter).unit, decimalsFor(r.point.standardUncertainty, 5)), csv: (r) => r.point.standardUncertainty },
  { head: 'Change over u', isNumber: true, cell: (r) => (r.point.changeRatio === undefined ? '' : number(r.point.changeRatio, 1)), csv: (r) => r.point.changeRatio },
  { head: 'Temperature', unit: '°C', isNumber: true, cell: (r) => (r.point.temperatureC === undefined ? '' : number(r.point.temperatureC, 1)), csv: (r) => r.point.temperatureC },
  { head: 'Alarm', cell: (r) => (r.point.alarm ? 'yes' : ''), csv: (r) => (r.point.alarm ? 'yes' : '') },
];

type Inks = import('../view/trend_chart').TrendInk;
export function inksNow(): Inks {
  const style = getComputedStyle(document.documentElement), of = (name: string) => style.getPropertyValue(name).trim();
  return { ink: of('--ink'), faint: of('--ink-2'), line: of('--line'), value: of('--accent'), alarm: of('--bad'), band: of('--news-wash'), limit: of('--unsure') };
}

function Chart({ trend, of, history, coverageFactor }: { trend: ParameterTrend; of: Calibration; history: Calibration[]; coverageFactor: number }) {
  const place = useRef<HTMLDivElement>(null), canvas = useRef<() => HTMLCanvasElement>();
  const dark = useCell(isDark), { query } = useRoute();
  const [problem, setProblem] = useState('');
  const key = `limit_${trend.parameter}`, limit = Number(query.get(key)) > 0 ? Number(query.get(key)) : undefined;
  const unit = unitOf(trend), name = nameOf(trend), last = trend.points.at(-1)!;
  const decimals = decimalsFor(2 * last.standardUncertainty, 4);
  useEffect(() => {
    let stop: (() => void) | undefined, isOver = false;
    const inTrend = new Set(trend.points.map(({ calibration }) => calibration));
    void import('../view/trend_chart').then((module) => {
      if (isOver) return;
      const drawn = module.drawTrend(place.current!, {
        dots: trend.points.map((point, i) => {
          const before = trend.points[i - 1], reach = before && coverageFactor * Math.hypot(before.standardUncertainty, point.standardUncertainty);
          return { at: dateOf(point.validFrom)!, value: point.value, standardUncertainty: point.standardUncertainty, isAlarm: point.alarm, name: point.calibration, step: before && reach !== undefined ? { low: before.value - reach, high: before.value + reach } : undefined };
        }),
        aside: history.filter((one) => !inTrend.has(one.name) && (one.state === CalibrationState.WITHDRAWN || one.state === CalibrationState.DRAFT)).flatMap((one) => {
          const own = parametersOf(one).find(({ parameter }) => parameter === trend.parameter), at = dateOf(one.validFrom);
          return own && at ? [{ at, value: own.value, word: verdictWords(CalibrationState[one.state]!) }] : [];
        }),
        slopePerDay: trend.slopePerDay, isTrendAlarm: trend.alarms.includes('TREND'), limit, current: of.name, decimals, unit,
      }, inksNow(), (picked) => { const page = pageOf(picked); if (page) go(page); });
      stop = drawn.stop;
      canvas.current = drawn.canvas;
    }, () => setProblem('The drawing could not be fetched.'));
    return () => { isOver = true; stop?.(); };
  }, [trend, history, dark, limit, of.name]);
  const title = `${name}${unit && `, ${unit}`}`;
  return (
    <figure class="sheet picture">
      <figcaption class="table-head"><h3>{title} {trend.alarms.length > 0 && <Mark tone="unsure">{trend.alarms.map((alarm) => kAlarms[alarm] ?? alarm).join(', ')}</Mark>}</h3>
        <span class="no-print"><label class="small">Limit ± <input class="short" type="number" min="0" step="any" value={query.get(key) ?? ''} aria-label={`Limit of ${name} from the first value${unit && `, ${unit}`}`} onChange={(event) => setQuery({ [key]: event.currentTarget.value })} /> {unit}</label>
          <button type="button" class="quiet" aria-label={`Download PNG: ${title}`} onClick={() => {
            const style = getComputedStyle(document.documentElement), words = `${of.machine} ${title}`;
            if (canvas.current) void sheetOf([canvas.current()], words, style.getPropertyValue('--sheet'), style.getPropertyValue('--ink')).then((blob) => download(blob, fileNameOf(words)));
          }}>PNG</button></span></figcaption>
      <div ref={place} class="trend-place" role="img" aria-label={`${title} of ${trend.points.length} calibrations. Newest ${withUncertainty(last.value, 2 * last.standardUncertainty, unit)}. The same in figures: the table of values.`} />
      {problem && <p class="problem">{problem}</p>}
    </figure>
  );
}

export function Trend({ of, trend, history }: { of: Calibration; trend: ReturnType<typeof useTrend>; history: Calibration[] }) {
  return (
    <section class="section" aria-labelledby="trend-title">
      <h2 id="trend-title">Trend</h2>
      <Shown asked={trend} what="the trend">{(value: CalibrationTrend | undefined) => {
        const parameters = value?.parameters.filter(({ points }) => points.length > 0) ?? [];
        if (!value || parameters.length === 0) return <p class="muted">No calibration of this kind was released that says how certain it is.</p>;
        return (
          <>
            <p class="small muted">Value ± U (k = 2). Pale bars: where a value may lie without being a step from the one before, {number(value.coverageFactor, 1)} combined standard uncertainties. Triangles: alarms. Dotted: the weighted slope. Crosses: withdrawn, or drafts. Ring: this one. {value.rule}</p>
            <div class="charts">{parameters.map((one) => <Chart key={one.parameter} trend={one} of={of} history={history} coverageFactor={value.coverageFactor} />)}</div>
            <Table caption="Trend in figures" columns={kColumns} rows={parameters} rowKey={(p) => p.parameter} />
            <details><summary>Every value</summary><Table caption="Values of the trend" showCaption={false} columns={kPoints} rows={parameters.flatMap(({ parameter, points }) => points.map((point) => ({ parameter, point })))} rowKey={(r) => `${r.parameter} ${r.point.calibration}`} /></details>
          </>
        );
      }}</Shown>
    </section>
  );
}

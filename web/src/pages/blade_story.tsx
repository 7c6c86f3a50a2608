// What happened to a blade, step by step: when, what, by whom, from what.
import type { JsonObject } from '@bufbuild/protobuf';
import type { RecordEntry } from '#proto/sixpoint/plant/v1/record_pb';
import { kindOf, pageOf, personOf, shortId, withoutRevision } from '../words/name';
import { count, number, plural, pointCount } from '../words/quantity';
import { clock, dateOf, day, duration, full } from '../words/time';
import { Shape, VerdictMark, verdictTone, type Tone } from '../view/mark';
import { CopyCsv, type Column } from '../view/table';

const kScanKinds: Record<string, string> = { airfoil: 'Airfoil scanned', local: 'Region scanned', pins: 'Scanned with pins', artefact: 'Artefact scanned', arm: 'Artefact scanned, arm swung' };
const kMethods: Record<string, string> = {
  SIX_POINT: 'six-point', SIX_POINT_NORMALS: 'six-point nest',
};
const kFates: Record<string, string> = { MACHINABLE: 'can be machined', DISCARD: 'discard', UNDECIDED: 'open whether it can be machined' };
export const methodWords = (method: string): string => kMethods[method.replace(/^METHOD_/, '')] ?? method.replace(/^METHOD_/, '').toLowerCase().replaceAll('_', ' ');

const numberIn = (summary: JsonObject, key: string): number | undefined => (typeof summary[key] === 'number' ? (summary[key] as number) : undefined);
const textIn = (summary: JsonObject, key: string): string => (typeof summary[key] === 'string' ? (summary[key] as string) : '');

// Title and figures of an entry, from the few that the journal keeps with it.
export function stepWords(entry: RecordEntry): { title: string; figures: string } {
  const s = (entry.summary ?? {}) as JsonObject;
  const joined = (...parts: (string | undefined | false)[]) => parts.filter(Boolean).join(', ');
  const um = (key: string) => { const value = numberIn(s, key); return value === undefined ? undefined : `${number(value, 2)} µm`; };
  switch (entry.kind) {
    case 'blade': return { title: 'Registered as a blade', figures: '' };
    case 'scan': return { title: kScanKinds[textIn(s, 'kind').toLowerCase()] ?? 'Scanned', figures: joined(numberIn(s, 'point_count') !== undefined && pointCount(numberIn(s, 'point_count')!), um('proven_error_um') && `kept within ${um('proven_error_um')}`) };
    case 'registration': return { title: `Registered, ${methodWords(entry.method)}`, figures: joined(um('residual_sigma_um') && `scatter ${um('residual_sigma_um')}`, numberIn(s, 'points_used') !== undefined && `${count(numberIn(s, 'points_used')!)} points used`, textIn(s, 'remark')) };
    case 'correction': return { title: 'Program corrected', figures: joined(numberIn(s, 'hole_count') !== undefined && plural(numberIn(s, 'hole_count')!, 'hole'), textIn(s, 'release').toLowerCase()) };
    case 'release': return { title: entry.inputs.some((input) => kindOf(input) === 'calibrations') ? 'Calibration released' : 'Program released by a person', figures: textIn(s, 'reason') && `“${textIn(s, 'reason')}”` };
    case 'refusal': return { title: 'Program refused by a person', figures: textIn(s, 'reason') && `“${textIn(s, 'reason')}”` };
    case 'withdrawal': return { title: 'Withdrawn', figures: textIn(s, 'reason') && `“${textIn(s, 'reason')}”` };
    case 'fetch': return { title: 'Program fetched', figures: '' };
    case 'cut': return { title: 'Reported cut', figures: numberIn(s, 'hole_count') !== undefined ? plural(numberIn(s, 'hole_count')!, 'hole') : '' };
    case 'inspection': return { title: `Judged, positioned by ${methodWords(entry.method)}`, figures: um('deviation_rms_um') ? `surface deviation ${um('deviation_rms_um')} rms` : '' };
    case 'reconstruction': return { title: 'Shape looked for in its blank', figures: s['of_part_limits'] === false ? 'with other limits than the part’s' : '' };
    case 'machining_pass': return { title: `Pass ${numberIn(s, 'number') ?? ''} over its shape looked at`, figures: '' };
    case 'repair': return { title: 'Repair planned', figures: joined(numberIn(s, 'repair_line_mm') !== undefined && `above ${number(numberIn(s, 'repair_line_mm')!, 2)} mm`, numberIn(s, 'lap_count') !== undefined && plural(numberIn(s, 'lap_count')!, 'lap')) };
    case 'assessment': return { title: `Judged by its drawing${entry.method ? `, ${entry.method.toLowerCase().replaceAll('_', ' ')}` : ''}`, figures: joined(numberIn(s, 'findings') !== undefined && numberIn(s, 'conform') !== undefined && `${count(numberIn(s, 'conform')!)} of ${plural(numberIn(s, 'findings')!, 'finding')} conform`, kFates[textIn(s, 'fate')], textIn(s, 'reason')) };
    case 'disposition': return { title: 'Decided what becomes of it', figures: joined(entry.method.replace(/^DISPOSITION_KIND_/, '').toLowerCase().replaceAll('_', ' '), textIn(s, 'reason') && `“${textIn(s, 'reason')}”`) };
    case 'assignment': return { title: 'Work order assigned', figures: joined(entry.workOrder, entry.operation) };
    case 'deletion': return { title: 'Points deleted', figures: '' };
    default: return { title: entry.kind, figures: '' };
  }
}

const kColumns: Column<RecordEntry>[] = [
  { head: 'sequence', cell: () => '', csv: (e) => e.recordSequence }, { head: 'recorded at', cell: () => '', csv: (e) => dateOf(e.recordedAt)?.toISOString() },
  { head: 'kind', cell: () => '', csv: (e) => e.kind }, { head: 'name', cell: () => '', csv: (e) => e.name }, { head: 'method', cell: () => '', csv: (e) => e.method },
  { head: 'verdict', cell: () => '', csv: (e) => e.verdict }, { head: 'state', cell: () => '', csv: (e) => e.state }, { head: 'by', cell: () => '', csv: (e) => e.requestedBy },
  { head: 'inputs', cell: () => '', csv: (e) => e.inputs.join(' ') }, { head: 'trace id', cell: () => '', csv: (e) => e.traceId },
];

function toneOf(entry: RecordEntry): Tone {
  if (entry.state === 'WITHDRAWN' || entry.kind === 'refusal' || entry.kind === 'withdrawal') return 'bad';
  return entry.verdict ? verdictTone(entry.verdict) : entry.state && entry.kind !== 'scan' ? verdictTone(entry.state) : entry.kind === 'release' ? 'good' : 'busy';
}

const Named = ({ name }: { name: string }) => {
  const page = pageOf(name);
  const text = <><span class="muted">{kindOf(name).replace(/s$/, '')}</span> {shortId(name)}</>;
  return page ? <a href={page} title={name}>{text}</a> : <span title={name}>{text}</span>;
};

export function Story({ entries }: { entries: RecordEntry[] }) {
  let lastDay = '';
  return (
    <section class="section no-print" aria-labelledby="story-title">
      <div class="table-head"><h2 id="story-title">Its story</h2><CopyCsv columns={kColumns} rows={entries} what="the story" /></div>
      <ol class="story sheet">{entries.map((entry, i) => {
        const at = dateOf(entry.recordedAt)!, before = dateOf(entries[i - 1]?.recordedAt), today = day(at);
        const isNewDay = today !== lastDay;
        lastDay = today;
        const { title, figures } = stepWords(entry), pause = before ? (at.getTime() - before.getTime()) / 1000 : 0;
        const calibrations = entry.inputs.filter((input) => kindOf(input) === 'calibrations');
        return (
          <li key={entry.name}>
            <time dateTime={at.toISOString()} title={full(at)}>{isNewDay && <>{today}<br /></>}{clock(at)}{pause > 600 && <><br /><span class="small">+{duration(pause)}</span></>}</time>
            <span class="knot"><Shape tone={toneOf(entry)} /></span>
            <div>
              <div class="what"><strong>{['registration', 'correction'].includes(entry.kind) ? <a href={pageOf(entry.name)}>{title}</a> : title}</strong>
                {entry.verdict && <VerdictMark verdict={entry.verdict} />}
                {entry.state && !(entry.kind === 'scan' && entry.state === 'KEPT') && <VerdictMark verdict={entry.state} />}
                <span class="muted">by {personOf(entry.requestedBy) || 'unknown'}{entry.machine && !entry.requestedBy.startsWith(withoutRevision(entry.machine)) && ` on ${shortId(entry.machine)}`}</span></div>
              {figures && <div>{figures}</div>}
              {calibrations.length > 0 && <div class="small">with {calibrations.map((name, k) => <span key={name}>{k > 0 && ', '}<Named name={name} /></span>)}</div>}
              <details><summary>What it was made from</summary>
                <ul>{entry.inputs.map((name) => <li key={name} class="plain"><Named name={name} /></li>)}</ul>
                <p class="small muted">{entry.name}{entry.softwareVersion && `, by software ${entry.softwareVersion}`}{entry.traceId && `, trace ${entry.traceId}`}</p>
              </details>
            </div>
          </li>
        );
      })}</ol>
    </section>
  );
}


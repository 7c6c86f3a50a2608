// Corrections that wait for a person, the one that waits longest last as the plant lists them; or one of any state. Each with what lies beyond
// the gate, how its blade stands, and the two ways out.
import { useEffect, useRef, useState } from 'preact/hooks';
import { CorrectionService, CorrectionState, type Correction, type ReleaseCheck } from '#proto/sixpoint/correction/v1/correction_pb';
import { View } from '#proto/sixpoint/list/v1/list_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { RegistrationService } from '#proto/sixpoint/registration/v1/registration_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { usePaged } from '../plant/paged';
import { setQuery, useRoute } from '../plant/route';
import { idOf, pageOf, personOf, shortId, withoutRevision } from '../words/name';
import { number, plural } from '../words/quantity';
import { ago, dateOf, full } from '../words/time';
import { AboutZero, AgainstLimit } from '../view/bars';
import { Mark, VerdictMark } from '../view/mark';
import { Picture } from '../view/picture';
import { useNow } from '../view/now';
import { Heading } from '../view/shell';
import { Empty, ListState, More, Refused, Shown } from '../view/states';
import { CopyCsv, type Column } from '../view/table';
import { displacementOf, type Displacement } from '../scene/displacement';
import { DecisionButtons, GateTable, isLeast, short, unitOf, wordOf } from './decision';

const kPageSize = 20;
const kTouching = new Set(['correction', 'release', 'refusal', 'withdrawal', 'cut']);

const failedOf = (correction: Correction) => correction.checks.filter((check) => !check.passed);
const foundWords = (check: ReleaseCheck) => (check.value === undefined ? 'could not be told' : `${short(check.value)}\u202f${unitOf(check)}`);
const limitWords = (check: ReleaseCheck) => `${isLeast(check) ? 'at least' : 'at most'} ${short(check.limit)}\u202f${unitOf(check)}`;

export function BeyondGate({ correction }: { correction: Correction }) {
  const failed = failedOf(correction);
  if (failed.length === 0) return <p class="muted">{correction.releaseReasons.length > 0 ? correction.releaseReasons.join('; ') : correction.checks.length > 0 ? 'Every check passed.' : 'No check was kept with it: it was made before the gate was asked.'}</p>;
  return (
    <ul class="beyond">{failed.map((check) => (
      <li key={`${check.kind}${check.subject}`}>
        <span><strong>{wordOf(check)}</strong>{check.subject && ` of ${check.subject}`}{check.failedCount > 1 && <span class="muted"> and {check.failedCount - 1} more</span>}</span>
        <AgainstLimit value={check.value} limit={check.limit} isLeast={isLeast(check)} passed={false} words={`${wordOf(check)}: ${foundWords(check)}, ${limitWords(check)}`} />
        <span class="num"><span class="tone-bad">{foundWords(check)}</span> <span class="muted">{limitWords(check)}</span></span>
      </li>
    ))}</ul>
  );
}

type Six = { name: string; unit: string; value: number; expanded: number | undefined };

export function sixOf(d: Displacement): Six[] {
  return [
    ...d.shiftMm.map((value, i) => ({ name: `shift ${'XYZ'[i]}`, unit: 'mm', value, expanded: d.shiftStandardUncertaintyMm && 2 * d.shiftStandardUncertaintyMm[i]! })),
    ...d.turnDeg.map((value, i) => ({ name: `turn ${'XYZ'[i]}`, unit: 'deg', value, expanded: d.turnStandardUncertaintyDeg && 2 * d.turnStandardUncertaintyDeg[i]! })),
  ];
}

const kSix: Column<Six>[] = [
  { head: 'Displacement', cell: () => '', csv: (s) => s.name }, { head: 'Value', cell: () => '', csv: (s) => s.value },
  { head: 'U (k = 2)', cell: () => '', csv: (s) => s.expanded }, { head: 'Unit', cell: () => '', csv: (s) => s.unit },
];

export function SixDegrees({ displacement, of }: { displacement: Displacement; of: string }) {
  const six = sixOf(displacement);
  return (
    <Picture title="How it stands off its nominal pose" file={`${of} displacement`}>
      <AboutZero bars={six.slice(0, 3)} unit="mm" decimals={3} label="Shift" />
      <AboutZero bars={six.slice(3)} unit="deg" decimals={3} label="Turn" />
      <p class="small muted">Machine axes, of the point ({displacement.aboutMm.map((mm) => number(mm, 1)).join(', ')})&#8239;mm of the part. {six[0]!.expanded === undefined ? 'Its uncertainty is not told here.' : 'Whiskers: ± U (k = 2).'}
        {' '}<CopyCsv columns={kSix} rows={six} what={`the displacement of ${of}`} /></p>
    </Picture>
  );
}

function How({ correction }: { correction: Correction }) {
  const asked = useAsked([correction.registration], async (signal) => {
    const registration = await client(RegistrationService).getRegistration({ name: correction.registration }, { signal });
    const part = await client(PlantService).getPart({ name: `${registration.part}@${registration.partRevision}` }, { signal });
    return displacementOf(registration, part);
  });
  return <Shown asked={asked} what="how it stands">{(d) => (d ? <SixDegrees displacement={d} of={idOf(correction.blade)} /> : <p class="muted">Its registration has no pose.</p>)}</Shown>;
}

// Asked for when it is first seen.
function Seen({ correction }: { correction: Correction }) {
  const place = useRef<HTMLDivElement>(null);
  const [isSeen, setSeen] = useState(false);
  useEffect(() => {
    const watcher = new IntersectionObserver(([entry]) => { if (entry!.isIntersecting) setSeen(true); }, { rootMargin: '300px' });
    watcher.observe(place.current!);
    return () => watcher.disconnect();
  }, []);
  return <div ref={place} class="six-place">{isSeen && <How correction={correction} />}</div>;
}

function Facts({ correction }: { correction: Correction }) {
  const now = useNow(), at = dateOf(correction.recordedAt), until = dateOf(correction.usableUntil);
  return (
    <p class="small muted">
      <a href={pageOf(correction.machine)}>{idOf(correction.machine)}</a>{correction.clamping && `, clamping ${correction.clamping}`}, made <span title={full(at)}>{ago(at, now)}</span> by {personOf(correction.requestedBy)},
      {' '}after <a href={pageOf(correction.registration)}>registration {shortId(correction.registration)}</a>{until && <>, usable until {full(until)}</>}
    </p>
  );
}

function Card({ correction, again }: { correction: Correction; again: () => void }) {
  return (
    <li class="sheet card" data-correction={idOf(correction.name)} aria-labelledby={`card-${idOf(correction.name)}`}>
      <div class="table-head"><h2 id={`card-${idOf(correction.name)}`}><a href={pageOf(correction.blade)}>{idOf(correction.blade)}</a></h2>
        <DecisionButtons correction={correction} onDecided={again} /></div>
      <Facts correction={correction} />
      <div class="two">
        <div>
          <h3>Beyond the gate</h3>
          <BeyondGate correction={correction} />
          <p class="small"><a href={pageOf(correction.name)}>All {plural(correction.checks.length, 'question')} of the gate</a></p>
        </div>
        <Seen correction={correction} />
      </div>
    </li>
  );
}

const kCsv: Column<{ correction: Correction; check: ReleaseCheck | undefined }>[] = [
  { head: 'correction', cell: () => '', csv: ({ correction }) => correction.name }, { head: 'blade', cell: () => '', csv: ({ correction }) => idOf(correction.blade) },
  { head: 'machine', cell: () => '', csv: ({ correction }) => idOf(correction.machine) }, { head: 'made at', cell: () => '', csv: ({ correction }) => dateOf(correction.recordedAt)?.toISOString() },
  { head: 'question', cell: () => '', csv: ({ check }) => check && wordOf(check) }, { head: 'where', cell: () => '', csv: ({ check }) => check?.subject },
  { head: 'found', cell: () => '', csv: ({ check }) => check?.value }, { head: 'limit', cell: () => '', csv: ({ check }) => check?.limit }, { head: 'unit', cell: () => '', csv: ({ check }) => check && unitOf(check) },
];

function Waiting() {
  const { query } = useRoute();
  const machine = query.get('machine') ?? '', part = query.get('part') ?? '';
  const list = usePaged([machine, part], async (pageToken, signal) => {
    const page = await client(CorrectionService).listCorrections({
      state: CorrectionState.DRAFT, pageSize: kPageSize, pageToken, view: View.BASIC, machine: machine && `machines/${machine}`, part: part && `parts/${part}`,
    }, { signal });
    return { rows: page.corrections, nextPageToken: page.nextPageToken };
  }, ({ entry }) => kTouching.has(entry?.kind ?? ''));
  const rows = list.rows ?? [];
  const field = (name: string, text: string, value: string) => (
    <label>{text} <input type="search" value={value} maxLength={64} spellcheck={false} autocomplete="off" onChange={(event) => setQuery({ [name]: event.currentTarget.value.trim() })} /></label>
  );
  return (
    <>
      <div class="page-head">
        <Heading title="Corrections">Corrections that wait for a person</Heading>
        <form class="filters" role="search" aria-label="Corrections" onSubmit={(event) => event.preventDefault()}>
          {field('machine', 'Machine', machine)}{field('part', 'Part', part)}
          <CopyCsv columns={kCsv} rows={rows.flatMap((correction) => failedOf(correction).map((check) => ({ correction, check })))} what="what lies beyond the gate" />
        </form>
      </div>
      <ListState list={list} what="the corrections" />
      {list.rows?.length === 0 && (machine || part
        ? <Empty title="None of these waits"><a href="/corrections">Show all that wait</a></Empty>
        : <Empty title="No correction waits for a person">What passes every check of the gate is released at once. What does not shows here as it is made.</Empty>)}
      {rows.length > 0 && <>
        <p class="small muted" role="status">{plural(rows.length, 'correction')} {rows.length === 1 ? 'waits' : 'wait'}{list.hasMore && ', and more'}. The newest first. In each bar the line is the limit.</p>
        <ul class="cards">{rows.map((correction) => <Card key={correction.name} correction={correction} again={list.again} />)}</ul>
        <More list={list} />
      </>}
    </>
  );
}

function One({ id }: { id: string }) {
  const name = `corrections/${id}`, blade = useRef<string>();
  const asked = useAsked([name], (signal) => client(CorrectionService).getCorrection({ name }, { signal }), ({ entry }) => (entry?.inputs.includes(name) ?? false) || (kTouching.has(entry?.kind ?? '') && (entry?.kind === 'withdrawal' || entry?.blade === blade.current)));
  blade.current = asked.value?.blade;
  const decided = (word: string, one: Correction['released']) => one && <><dt>{word}</dt><dd>{full(dateOf(one.recordedAt))} by {personOf(one.requestedBy)}: “{one.reason}”</dd></>;
  return (
    <>
      <div class="page-head"><Heading title={`Correction ${shortId(name)}`}>Correction {shortId(name)}</Heading><a href="/corrections">All that wait</a></div>
      {asked.refusal && asked.value && !asked.refusal.isAway && <Refused refusal={asked.refusal} again={asked.again} />}
      <Shown asked={asked} what="the correction">{(correction) => (
        <>
          <div class="blade-top">
            <div class="sheet">
              <div class="table-head"><VerdictMark verdict={CorrectionState[correction.state] ?? ''} big />{correction.state === CorrectionState.DRAFT && <DecisionButtons correction={correction} onDecided={asked.again} />}</div>
              <p>Of blade <a href={pageOf(correction.blade)}>{idOf(correction.blade)}</a></p>
              <Facts correction={correction} />
              <dl class="pairs">
                {decided('Released', correction.released)}{decided('Refused', correction.refused)}
                {correction.supersededBy && <><dt>Superseded by</dt><dd><a href={pageOf(correction.supersededBy)}>{shortId(correction.supersededBy)}</a></dd></>}
                <dt>Rotary axes</dt><dd><a href={pageOf(correction.rotationCalibration)}>calibration {shortId(correction.rotationCalibration)}</a></dd>
                {correction.machiningModel && <><dt>Machining model</dt><dd>{idOf(withoutRevision(correction.machiningModel))}, revision {correction.machiningModel.split('@')[1]}</dd></>}
                {correction.repair && <><dt>Along the laps of</dt><dd><a href={pageOf(correction.blade)}>repair {shortId(correction.repair)}</a></dd></>}
                {correction.reconstruction && <><dt>On the shape of</dt><dd><a href={pageOf(correction.blade)}>reconstruction {shortId(correction.reconstruction)}</a></dd></>}
                {correction.machiningPass && <><dt>By what was left after</dt><dd>machining pass {shortId(correction.machiningPass)}</dd></>}
                {correction.groups.map(({ group, adaptation }) => adaptation && <><dt>{group} beside its template</dt><dd>up to {number(adaptation.greatestShiftMm, 3)}&#8239;mm and {number(adaptation.greatestTurnDeg, 2)}&#8239;° off; cuts up to {number(adaptation.gougeUm, 1)}&#8239;µm deeper, leaves up to {number(adaptation.restUm, 1)}&#8239;µm more{adaptation.deepestCompensationUm !== undefined && `; commanded up to ${number(adaptation.deepestCompensationUm, 1)}\u202fµm deeper by the pass before`}</dd></>)}
                {correction.proof && <><dt>Program read back</dt><dd>{plural(correction.proof.poseCount, 'pose')}, greatest difference {number(correction.proof.greatestDifferenceUm, 2)}&#8239;µm of at most 1</dd></>}
              </dl>
              <h2>Beyond the gate</h2>
              <BeyondGate correction={correction} />
            </div>
            <div class="sheet"><How correction={correction} /></div>
          </div>
          <section class="section"><GateTable correction={correction} /></section>
          {correction.checks.length === 0 && <Mark tone="none">No check was kept with it</Mark>}
        </>
      )}</Shown>
    </>
  );
}

export default function CorrectionsPage({ argument }: { argument: string }) {
  return argument ? <One id={argument} /> : <Waiting />;
}

// One blade: the verdict first, then what it rests on, the blade itself, its holes, its story.
import { useMemo, useState } from 'preact/hooks';
import type { Calibration } from '#proto/sixpoint/calibration/v1/calibration_pb';
import { CalibrationState } from '#proto/sixpoint/calibration/v1/state_pb';
import { CorrectionState } from '#proto/sixpoint/correction/v1/correction_pb';
import type { Assessment } from '#proto/sixpoint/inspection/v1/assessment_pb';
import { DispositionKind } from '#proto/sixpoint/inspection/v1/disposition_pb';
import { Verdict } from '#proto/sixpoint/inspection/v1/inspection_pb';
import { Method } from '#proto/sixpoint/registration/v1/method_pb';
import { useAsked } from '../plant/asked';
import { idOf, pageOf, personOf, shortId, withoutRevision } from '../words/name';
import { count, plural, quantity, withUncertainty } from '../words/quantity';
import { dateOf, duration, full } from '../words/time';
import { Mark, VerdictMark } from '../view/mark';
import { Heading } from '../view/shell';
import { Refused, Shown } from '../view/states';
import { AssessedLine, AssessedMark, AssessmentSection, newestOf, useAssessments } from './assessment';
import { AsCut, Changes, PickedHole, verdictName } from './blade_holes';
import { factsOf, holesOf, type BladeFacts, type HoleFacts } from './blade_facts';
import { methodWords, Story } from './blade_story';
import { BladeView } from './blade_view';
import { Decision } from './decision';
import { Deviation } from './deviation';
import { Passes } from './passes';
import { Reconstruction } from './reconstruction';
import { Repair } from './repair';
import { Sections } from './section';

const dispositionWords = (kind: DispositionKind) => (DispositionKind[kind] ?? '').toLowerCase().replaceAll('_', ' ');

const share = ({ result }: HoleFacts): number => (result?.positionErrorMm === undefined ? -1 : result.positionErrorMm / result.positionToleranceMm);

// Of those measured, the one whose position takes most of its tolerance.
export function worstOf(holes: HoleFacts[]): HoleFacts | undefined {
  return holes.filter((hole) => share(hole) >= 0).sort((a, b) => share(b) - share(a))[0];
}

// In one sentence, why the verdict is what it is.
export function verdictSentence(facts: BladeFacts, holes: HoleFacts[]): string {
  const judged = holes.filter((hole) => hole.result);
  const conform = judged.filter((hole) => hole.result!.verdict === Verdict.CONFORM).length;
  const worst = worstOf(holes);
  if (!facts.inspection) return 'It was not inspected yet.';
  const lacking = judged.filter((hole) => hole.result!.verdict === Verdict.NOT_MEASURED).length;
  const sum = `${conform} of ${plural(judged.length, 'hole')} conform${lacking > 0 ? `, ${lacking} not measured` : ''}.`;
  if (!worst) return sum;
  const { result } = worst;
  return `${sum} Worst position: ${worst.key} with ${withUncertainty(result!.positionErrorMm, result!.positionExpandedUncertaintyUm === undefined ? undefined : result!.positionExpandedUncertaintyUm / 1000, 'mm')} of at most ${quantity(result!.positionToleranceMm, 'mm', 3)}.`;
}

// Holes' verdict; of a blade whose holes were not inspected what its drawing says.
function Judged({ facts, assessment }: { facts: BladeFacts; assessment: Assessment | undefined }) {
  if (facts.inspection) return <VerdictMark verdict={verdictName(facts.inspection.verdict)} big />;
  return assessment ? <AssessedMark assessment={assessment} big /> : <Mark tone="none" big>Not judged yet</Mark>;
}

function Top({ facts, holes, assessment }: { facts: BladeFacts; holes: HoleFacts[]; assessment: Assessment | undefined }) {
  const { inspection, blade, part, correction } = facts;
  const disposition = inspection?.dispositions[0], positioning = inspection?.positioning, deviation = inspection?.deviation;
  return (
    <div class="blade-top">
      <div class="sheet">
        <Judged facts={facts} assessment={assessment} />
        {(inspection || !assessment) && <p>{verdictSentence(facts, holes)}</p>}
        {assessment && <AssessedLine assessment={assessment} isFirst={!inspection} />}
        {disposition && <p><Mark tone="wait">Decided: {dispositionWords(disposition.kind)}</Mark> by {personOf(disposition.requestedBy)}: “{disposition.reason}”{disposition.reference && ` (${disposition.reference})`}</p>}
        {positioning?.disagrees && <p><Mark tone="unsure">Its shape leaves open how it is positioned</Mark> Two ways differ by {quantity(positioning.disagreementUm, 'µm', 1)}; {positioning.covered ? 'the uncertainties of the holes hold that.' : 'the uncertainties of the holes may be too small.'}</p>}
        {correction && correction.state !== CorrectionState.UNSPECIFIED && !inspection && <p>Its program: <VerdictMark verdict={CorrectionState[correction.state]!} /></p>}
        <dl class="pairs">
          <dt>Part</dt><dd><a href={pageOf(part ? `${part.name}@${part.revision}` : blade.part)}>{idOf(withoutRevision(blade.part))}</a>{part && <span class="muted"> revision {part.revision}</span>}</dd>
          {facts.machine && <><dt>Machine</dt><dd><a href={pageOf(facts.machine.name)}>{idOf(facts.machine.name)}</a></dd></>}
          <dt>Work order</dt><dd>{blade.workOrder ? `${blade.workOrder}${blade.operation && `, ${blade.operation}`}` : <span class="muted">none was assigned</span>}</dd>
          {inspection && <><dt>Judged</dt><dd>{full(dateOf(inspection.recordedAt))} by {personOf(inspection.requestedBy)}</dd></>}
        </dl>
      </div>
      <div class="sheet">
        <h2>Surface, and what it rests on</h2>
        <dl class="pairs">
          {deviation && <><dt>Deviation</dt><dd>rms {quantity(deviation.rmsUm, 'µm', 1)}, 5 to 95&#8239;% {quantity(deviation.p05Um, 'µm', 1)} to {quantity(deviation.p95Um, 'µm', 1)}<span class="muted"> ({count(deviation.pointCount)} points, {count(deviation.excludedCount)} set aside)</span></dd></>}
          {!deviation && <><dt>Deviation</dt><dd class="muted">not measured</dd></>}
          {facts.after && <><dt>Positioned</dt><dd><a href={pageOf(facts.after.name)}>{methodWords(Method[facts.after.method] ?? '')}</a>, scatter {quantity(facts.after.evidence?.residualRmsUm, 'µm', 1)}, weakest {facts.after.evidence?.weakestDirectionInWords || 'direction'} u = {quantity(facts.after.evidence?.weakestStandardUncertaintyUm, 'µm', 2)}</dd></>}
          {[...facts.calibrations.values()].map((calibration) => <Rests key={calibration.name} calibration={calibration} />)}
        </dl>
        {facts.missing.length > 0 && <ul class="small tone-unsure">{facts.missing.map((line) => <li key={line}>{line}</li>)}</ul>}
      </div>
    </div>
  );
}

function Rests({ calibration }: { calibration: Calibration }) {
  const word = calibration.result.case === 'sensor' ? 'Scanner' : calibration.result.case === 'rotation' ? 'Rotary axes' : 'Calibration';
  const isOver = calibration.state === CalibrationState.WITHDRAWN;
  const from = dateOf(calibration.validFrom);
  return (
    <><dt>{word}</dt><dd title={calibration.name}>{isOver ? <><Mark tone="bad">Withdrawn</Mark> “{calibration.withdrawal?.reason}”</> : <VerdictMark verdict={CalibrationState[calibration.state] ?? ''} />}
      <span class="muted"> <a href={pageOf(calibration.name)}>{shortId(calibration.name)}</a>, calibrated {from ? `${duration((Date.now() - from.getTime()) / 1000)} ago` : 'at an unknown time'}</span></dd></>
  );
}

// Before its verdict: that stands on something which must not be used.
function Withdrawn({ calibrations }: { calibrations: Calibration[] }) {
  const gone = calibrations.filter(({ state }) => state === CalibrationState.WITHDRAWN);
  if (gone.length === 0) return null;
  return (
    <div class="state state-refused withdrawn" role="alert"><strong>It rests on a calibration that was withdrawn</strong>
      {gone.map(({ name, withdrawal }) => <p key={name}><a href={pageOf(name)}>{shortId(name)}</a>{withdrawal && <>, {full(dateOf(withdrawal.recordedAt))} by {personOf(withdrawal.requestedBy)}: “{withdrawal.reason}”</>}</p>)}
      <p>What was found with it says nothing of the blade. Judge it anew, by what is in force now.</p></div>
  );
}

function Blade({ facts, again }: { facts: BladeFacts; again: () => void }) {
  const holes = useMemo(() => holesOf(facts), [facts]);
  const assessments = useAssessments(facts.blade.name);
  const [picked, setPicked] = useState<string>();
  const pick = (key: string) => setPicked((old) => (old === key ? undefined : key));
  return (
    <>
      <Withdrawn calibrations={[...facts.calibrations.values()]} />
      <Top facts={facts} holes={holes} assessment={newestOf(assessments)} />
      {facts.correction && <Decision correction={facts.correction} onDecided={again} />}
      <div class="blade-body section">
        <BladeView facts={facts} holes={holes} picked={picked} onPick={pick} />
        <div class="no-print"><PickedHole hole={holes.find((hole) => hole.key === picked) ?? worstOf(holes)} correction={facts.correction} isPicked={picked !== undefined} /></div>
      </div>
      {facts.inspection && <AsCut holes={holes.filter((hole) => hole.result)} pitches={facts.inspection.pitches} picked={picked} onPick={pick} />}
      {facts.correction && facts.correction.groups.length > 0 && <Changes holes={holes} correction={facts.correction} />}
      <AssessmentSection assessments={assessments} facts={facts} />
      <Deviation facts={facts} />
      <Reconstruction facts={facts} />
      <Passes facts={facts} />
      <Repair facts={facts} />
      <Sections facts={facts} />
      <Story entries={facts.entries} />
    </>
  );
}

export default function BladePage({ argument: serial }: { argument: string }) {
  const asked = useAsked([serial], (signal) => factsOf(serial, signal), ({ entry }) => entry?.blade === `blades/${serial}` || entry?.kind === 'withdrawal');
  return (
    <>
      <div class="page-head">
        <Heading title={serial}>{serial}</Heading>
        <span class="no-print"><button type="button" onClick={() => window.print()}>Print report</button></span>
        <p class="print-only small">Report of blade {serial}, printed {full(new Date())}. Values ± expanded uncertainty U (95&#8239;%).</p>
      </div>
      {asked.refusal && asked.value && !asked.refusal.isAway && <Refused refusal={asked.refusal} again={asked.again} />}
      <Shown asked={asked} what={`the record of ${serial}`}>{(facts) => <Blade facts={facts} again={asked.again} />}</Shown>
    </>
  );
}

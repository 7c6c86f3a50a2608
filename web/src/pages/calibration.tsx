// One calibration: its state and values with U, how they moved, its residuals, what rests on it; released and withdrawn by a person.
import { useRef, useState } from 'preact/hooks';
import { CalibrationService, type Calibration, type WithdrawCalibrationResponse } from '#proto/sixpoint/calibration/v1/calibration_pb';
import { CalibrationState, type CalibrationEvent } from '#proto/sixpoint/calibration/v1/state_pb';
import { StudyVerdict } from '#proto/sixpoint/calibration/v1/verdict_pb';
import type { Event } from '#proto/sixpoint/plant/v1/event_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { usePaged } from '../plant/paged';
import { axisOf, kindWord, parameterName, parametersOf, type Parameter } from '../words/calibration';
import { parameterWords } from '../words/machine';
import { idOf, pageOf, personOf, shortId, withoutRevision } from '../words/name';
import { count, number, plural, quantity, withUncertainty } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { AskWhy } from '../view/ask_why';
import { Mark, VerdictMark } from '../view/mark';
import { Heading } from '../view/shell';
import { More, Refused, Shown } from '../view/states';
import { CopyCsv, Table, type Column } from '../view/table';
import { Residuals } from './calibration_residuals';
import { Trend, useTrend } from './calibration_trend';
import { kCalibrationColumns, residualOf, stateName } from './calibrations';
import { Rejudge, Resting } from './resting';

const kTouching = new Set(['calibration', 'release', 'withdrawal', 'study']);

const kValues: Column<Parameter>[] = [
  { head: 'Parameter', cell: (p) => parameterName(parameterWords(p.parameter).name), csv: (p) => p.parameter },
  { head: 'Value ± U', isNumber: true, cell: (p) => withUncertainty(p.value, p.standardUncertainty === undefined ? undefined : 2 * p.standardUncertainty, parameterWords(p.parameter).unit, 4), csv: (p) => p.value },
  { head: 'Standard uncertainty', isNumber: true, cell: (p) => (p.standardUncertainty === undefined ? 'not told' : `${p.standardUncertainty.toPrecision(2)}\u202f${parameterWords(p.parameter).unit}`), csv: (p) => p.standardUncertainty },
];

function Decided({ word, event }: { word: string; event: CalibrationEvent | undefined }) {
  return event ? <><dt>{word}</dt><dd>{full(dateOf(event.recordedAt))} by {personOf(event.requestedBy)}{event.reason && `: “${event.reason}”`}</dd></> : null;
}

// What the plant answered to a withdrawal: it is told once.
function Meant({ answer }: { answer: WithdrawCalibrationResponse }) {
  return (
    <div class="state state-refused" role="status">
      <strong>It is withdrawn for ever.</strong>
      <p>{plural(answer.restingCount, 'result')} of {plural(answer.blades.length, 'blade')} {answer.restingCount === 1n ? 'rests' : 'rest'} on it. {answer.inForce
        ? <>In force from now on: <a href={pageOf(answer.inForce)}>{shortId(answer.inForce)}</a>. Where the cause concerns that one too, withdraw it as well.</>
        : 'Nothing is in force any more: calibrate the machine.'}</p>
      {answer.blades.length > 0 && <details><summary>The blades</summary><ul class="names">{answer.blades.slice(0, 1000).map((blade) => <li key={blade}><a href={pageOf(blade)}>{idOf(blade)}</a></li>)}</ul>{answer.blades.length > 1000 && <p>and {count(answer.blades.length - 1000)} more; all are listed below</p>}</details>}
    </div>
  );
}

function Top({ calibration, parameters, again }: { calibration: Calibration; parameters: Parameter[]; again: () => void }) {
  const mayRelease = useMay(CalibrationService.method.releaseCalibration), mayWithdraw = useMay(CalibrationService.method.withdrawCalibration);
  const [meant, setMeant] = useState<WithdrawCalibrationResponse>();
  const { state, environment, interimCheck, result, name } = calibration;
  const conditionNumber = result.case === 'sensor' || result.case === 'rotation' || result.case === 'probe' ? result.value.conditionNumber : undefined;
  const freedom = result.case === 'sensor' || result.case === 'rotation' ? result.value.degreesOfFreedom : undefined;
  return (
    <>
      {meant && <Meant answer={meant} />}
      <div class="blade-top">
        <div class="sheet">
          <div class="table-head"><VerdictMark verdict={stateName(state)} big />
            <span class="buttons no-print">
              {mayWithdraw && state !== CalibrationState.WITHDRAWN && <AskWhy button="Withdraw…" title="Withdraw this calibration for ever" verb="Withdraw"
                act={async (reason, requestId) => { setMeant(await client(CalibrationService).withdrawCalibration({ name, reason, requestId })); again(); }}>
                Nothing is computed with it any more, programs that rest on it do not leave, and an older one that is still valid comes back into force. Your name and reason stay in the record.</AskWhy>}
              {mayRelease && state === CalibrationState.DRAFT && <AskWhy isMain button="Release…" title="Release this calibration" verb="Release" reason="optional"
                act={async (reason, requestId) => { await client(CalibrationService).releaseCalibration({ name, reason, requestId }); again(); }}>
                It comes into force, and results are computed with it from now on. Your name and reason stay in the record.</AskWhy>}
            </span></div>
          {state === CalibrationState.DRAFT && <p><Mark tone="wait">Waits for a person</Mark> {calibration.judgements.some(({ agrees }) => !agrees) ? 'Its residuals are not what its uncertainty explains.' : 'It was made as a draft.'}</p>}
          <dl class="pairs">
            <dt>Machine</dt><dd><a href={pageOf(calibration.machine)}>{idOf(calibration.machine)}</a></dd>
            <dt>Valid</dt><dd>{full(dateOf(calibration.validFrom))} until {full(dateOf(calibration.validUntil))}</dd>
            <dt>Made</dt><dd>{full(dateOf(calibration.recordedAt))} by {personOf(calibration.requestedBy)}, method {calibration.method.toLowerCase().replaceAll('_', ' ')}</dd>
            <Decided word="Released" event={calibration.release} /><Decided word="Withdrawn" event={calibration.withdrawal} />
            {calibration.supersededBy && <><dt>Superseded by</dt><dd><a href={pageOf(calibration.supersededBy)}>{shortId(calibration.supersededBy)}</a></dd></>}
            {environment?.temperatureC !== undefined && <><dt>Temperature</dt><dd>{withUncertainty(environment.temperatureC, environment.temperatureStandardUncertaintyC === undefined ? undefined : 2 * environment.temperatureStandardUncertaintyC, '°C', 1)}{environment.humidityPercent !== undefined && `, ${number(environment.humidityPercent, 0)} % humidity`}</dd></>}
            {environment?.note && <><dt>Note</dt><dd>{environment.note}</dd></>}
            {interimCheck && <><dt>Interim check</dt><dd><a href={`${pageOf(calibration.machine)}#checks`}><VerdictMark verdict={StudyVerdict[interimCheck.verdict] ?? ''} /></a>{interimCheck.stoodUntil && <span class="muted"> stood as calibrated until {full(dateOf(interimCheck.stoodUntil))}</span>}</dd></>}
          </dl>
          <details><summary>What it was made from</summary><ul>{calibration.inputs.map((input) => { const page = pageOf(input); return <li key={input}>{page ? <a href={page}>{input}</a> : input}</li>; })}</ul>
            <p class="small muted">{name}, by software {calibration.softwareVersion}</p></details>
        </div>
        <div class="sheet">
          <Table caption="What it says" columns={kValues} rows={parameters} rowKey={(p) => p.parameter} />
          <dl class="pairs">
            {result.case === 'sensor' && result.value.certificate && <><dt>Stated by</dt><dd>{result.value.certificate}</dd></>}
            {residualOf(calibration) !== undefined && <><dt>Residual</dt><dd>rms {quantity(residualOf(calibration), 'µm', 2)} of what the fit used</dd></>}
            {result.case === 'rotation' && result.value.checkRmsUm !== undefined && <><dt>Held out</dt><dd>rms {quantity(result.value.checkRmsUm, 'µm', 2)} of {plural(result.value.checkCount, 'pose')}</dd></>}
            {result.case === 'sensor' && result.value.fieldLeftUm !== undefined && <><dt>Field of the scanner</dt><dd>{quantity(result.value.fieldLeftUm, 'µm', 2)} rms left over the measuring field</dd></>}
            {conditionNumber !== undefined && conditionNumber > 0 && <><dt>Condition number</dt><dd>{number(conditionNumber, 1)}</dd></>}
            {freedom !== undefined && <><dt>Degrees of freedom</dt><dd>{number(freedom, 1)}, of the covariance</dd></>}
          </dl>
          <p class="small muted">U: expanded uncertainty, k = 2.</p>
        </div>
      </div>
    </>
  );
}

function History({ of, list }: { of: Calibration; list: ReturnType<typeof usePaged<Calibration>> }) {
  const rows = list.rows ?? [];
  if (rows.length === 0) return null;
  return (
    <section class="section" aria-labelledby="history-title">
      <div class="table-head"><h2 id="history-title">All of {kindWord(of).toLowerCase()} on {idOf(of.machine)}</h2><CopyCsv columns={kCalibrationColumns} rows={rows} what="all of this kind" /></div>
      <Table caption="All of this kind" showCaption={false} isCopied={false} columns={kCalibrationColumns.filter(({ head }) => head !== 'Machine' && head !== 'Kind')} rows={rows} rowKey={(c) => c.name} picked={of.name} />
      <More list={list} />
    </section>
  );
}

export default function CalibrationPage({ argument: id }: { argument: string }) {
  const name = `calibrations/${id}`, machine = useRef<string>();
  const touches = ({ entry }: Event) => entry !== undefined && kTouching.has(entry.kind) && (entry.machine === '' || withoutRevision(entry.machine) === machine.current);
  const asked = useAsked([name], (signal) => client(CalibrationService).getCalibration({ name }, { signal }), touches);
  const calibration = asked.value;
  machine.current = calibration?.machine;
  const history = usePaged([calibration?.machine, calibration?.kind, calibration && axisOf(calibration)], async (pageToken, signal) => {
    if (!calibration) return { rows: [], nextPageToken: '' };
    const page = await client(CalibrationService).listCalibrations({ machine: calibration.machine, kind: calibration.kind, axis: axisOf(calibration), pageSize: 100, pageToken }, { signal });
    return { rows: page.calibrations, nextPageToken: page.nextPageToken };
  }, touches);
  const trend = useTrend(calibration, history);
  // By the trend, which knows more of them; its own figures where it is not part of it.
  const inTrend: Parameter[] = trend.value?.parameters.flatMap(({ parameter, points }) => points.filter((point) => point.calibration === name).map(({ value, standardUncertainty }) => ({ parameter, value, standardUncertainty }))) ?? [];
  const title = calibration ? `${kindWord(calibration)} of ${idOf(calibration.machine)}` : 'Calibration';
  return (
    <>
      <div class="page-head"><Heading title={title}>{title} <span class="muted">{shortId(name)}</span></Heading><a class="no-print" href={calibration ? `/calibrations?machine=${encodeURIComponent(idOf(calibration.machine))}` : '/calibrations'}>All calibrations{calibration && ` of ${idOf(calibration.machine)}`}</a></div>
      {asked.refusal && asked.value && !asked.refusal.isAway && <Refused refusal={asked.refusal} again={asked.again} />}
      <Shown asked={asked} what="the calibration">{(one) => (
        <>
          <Top calibration={one} parameters={inTrend.length > 0 ? inTrend : parametersOf(one)} again={asked.again} />
          <Trend of={one} trend={trend} history={history.rows ?? []} />
          <Residuals calibration={one} />
          <Resting name={name} />
          <Rejudge name={name} />
          <History of={one} list={history} />
        </>
      )}</Shown>
    </>
  );
}

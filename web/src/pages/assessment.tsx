// A blade against its drawing: verdict, what becomes of a blank and why, place by place, characteristic by characteristic.
import { useMemo, useState } from 'preact/hooks';
import { AssessmentService, BlankFate, type Assessment, type AssessmentGroup, type ListAssessmentsResponse } from '#proto/sixpoint/inspection/v1/assessment_pb';
import { DrawingService, type Drawing } from '#proto/sixpoint/plant/v1/drawing_pb';
import { useAsked, type Asked } from '../plant/asked';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { countsSentence, drawingWords, groupWords, kFateWords, kStageWords } from '../words/assessment';
import { personOf, shortId } from '../words/name';
import { count } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { Mark, VerdictMark, verdictWords } from '../view/mark';
import { Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import { Conflicts } from './assessment_conflicts';
import { Findings } from './assessment_findings';
import type { BladeFacts } from './blade_facts';
import { verdictName } from './blade_holes';

const kMost = 100;

export type Assessments = { may: boolean; asked: Asked<ListAssessmentsResponse | undefined> };

export function useAssessments(blade: string): Assessments {
  const may = useMay(AssessmentService.method.listAssessments);
  const asked = useAsked([blade, may], async (signal) => (may ? client(AssessmentService).listAssessments({ blade, pageSize: kMost }, { signal }) : undefined),
    ({ entry }) => entry?.kind === 'assessment' && entry.blade === blade);
  return { may, asked };
}

export const newestOf = ({ asked }: Assessments): Assessment | undefined => asked.value?.assessments[0];

// A blank's fate is what counts of it; of a machined blade its verdict.
export const AssessedMark = ({ assessment: { fate, verdict }, big }: { assessment: Assessment; big?: boolean }) => (fate === BlankFate.UNSPECIFIED
  ? <VerdictMark verdict={verdictName(verdict)} {...(big ? { big } : {})} /> : <Mark tone={kFateWords[fate][0]} {...(big ? { big } : {})}>{kFateWords[fate][1]}</Mark>);

// For the head of the blade's page.
export function AssessedLine({ assessment, isFirst }: { assessment: Assessment; isFirst: boolean }) {
  return (
    <p>{!isFirst && <AssessedMark assessment={assessment} />} By <a href="#assessment">its drawing</a> <span class="muted">{drawingWords(assessment.drawing)}, {kStageWords[assessment.stage]}</span>{assessment.fateReason ? `: ${assessment.fateReason}` : '.'}</p>
  );
}

type Of = { assessment: Assessment; drawing: Drawing | undefined };

// The drawing says at what place a characteristic is; without it there is only no choice by place.
async function assessmentOf(name: string, signal: AbortSignal): Promise<Of> {
  const assessment = await client(AssessmentService).getAssessment({ name }, { signal });
  const drawing = await client(DrawingService).getDrawing({ name: assessment.drawing }, { signal }).catch(() => undefined);
  return { assessment, drawing };
}

export const placesOf = (drawing: Drawing): Map<string, string> => new Map(drawing.characteristics.map((one) => [one.characteristic, one.holeGroup || one.section || one.region || 'part']));

const kGroups: Column<AssessmentGroup>[] = [
  { head: 'Group', cell: (g) => groupWords(g.group), csv: (g) => g.group },
  { head: 'Verdict', cell: (g) => <VerdictMark verdict={verdictName(g.verdict)} />, csv: (g) => verdictName(g.verdict) },
  { head: 'Conform', isNumber: true, cell: (g) => count(g.conformCount), csv: (g) => g.conformCount },
  { head: 'of', isNumber: true, cell: (g) => count(g.findingCount), csv: (g) => g.findingCount },
];

function Summary({ assessment, drawing }: Of) {
  return (
    <div class="sheet assessed">
      <AssessedMark assessment={assessment} />
      {assessment.fateReason && <p>{assessment.fateReason}</p>}
      <dl class="pairs">
        {assessment.fate !== BlankFate.UNSPECIFIED && <><dt>Verdict</dt><dd><VerdictMark verdict={verdictName(assessment.verdict)} /></dd></>}
        <dt>Findings</dt><dd>{countsSentence(assessment.findings)}</dd>
        <dt>Stage</dt><dd>{kStageWords[assessment.stage]}</dd>
        <dt>Drawing</dt><dd title={assessment.drawing}>{drawingWords(assessment.drawing)}{drawing && <span class="muted"> ({drawing.drawingNumber}, revision {drawing.drawingRevision})</span>}</dd>
        <dt>Judged</dt><dd>{full(dateOf(assessment.recordedAt))} by {personOf(assessment.requestedBy)}<span class="muted" title={assessment.results.join(' ')}>, part revision {assessment.partRevision}, {shortId(assessment.name)}</span></dd>
      </dl>
    </div>
  );
}

function One({ assessment, drawing, facts }: Of & { facts: BladeFacts }) {
  const [group, setGroup] = useState('');
  const places = useMemo(() => drawing && placesOf(drawing), [drawing]);
  return (
    <>
      <div class="two">
        <Summary assessment={assessment} drawing={drawing} />
        <Table caption="By place" columns={kGroups} rows={assessment.groups} rowKey={(g) => g.group} picked={group || undefined}
          {...(places ? { onPick: (g: AssessmentGroup) => setGroup(g.group === group ? '' : g.group) } : {})} />
      </div>
      {assessment.conflicts.length > 0 && <Conflicts assessment={assessment} part={facts.part} />}
      <Findings assessment={assessment} places={places} group={group} onGroup={setGroup} />
    </>
  );
}

function Picked({ name, facts }: { name: string; facts: BladeFacts }) {
  const asked = useAsked([name], (signal) => assessmentOf(name, signal));
  return <Shown asked={asked} what="the assessment">{(of) => <One key={of.assessment.name} {...of} facts={facts} />}</Shown>;
}

const optionWords = (one: Assessment): string => [full(dateOf(one.recordedAt)), kStageWords[one.stage], drawingWords(one.drawing), verdictWords(verdictName(one.verdict))].join(', ');

export function AssessmentSection({ assessments: { may, asked }, facts }: { assessments: Assessments; facts: BladeFacts }) {
  const [picked, setPicked] = useState('');
  if (!may) return null;
  return (
    <section class="section no-print" aria-labelledby="assessment-title" id="assessment">
      <h2 id="assessment-title">Against its drawing</h2>
      <Shown asked={asked} what="assessments">{(list) => {
        const all = list?.assessments ?? [], shown = all.find(({ name }) => name === picked) ?? all[0];
        if (!shown) return <p class="muted">It was not judged by a drawing yet.</p>;
        return (
          <>
            {all.length > 1 && <label>Assessment <select value={shown.name} onChange={(event) => setPicked(event.currentTarget.value)}>
              {all.map((one) => <option key={one.name} value={one.name}>{optionWords(one)}</option>)}</select>{list?.nextPageToken && <span class="muted"> the newest {kMost}</span>}</label>}
            <Picked name={shown.name} facts={facts} />
          </>
        );
      }}</Shown>
    </section>
  );
}

// Airfoil sections of a blade: the newest measurement, section by section, as a plot beside the CAD's outline and as a table.
import { useState } from 'preact/hooks';
import { SectionEnd, SectionParameter, SectionService, SectionUnit, type Section, type SectionMeasurement, type SectionOutline, type SectionValue } from '#proto/sixpoint/inspection/v1/section_pb';
import { Method } from '#proto/sixpoint/registration/v1/method_pb';
import { View } from '#proto/sixpoint/list/v1/list_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { refusalOf } from '../plant/refusal';
import { newRequestId } from '../plant/request_id';
import { pageOf, personOf } from '../words/name';
import { count, decimalsFor, number, percent, plural } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { Picture } from '../view/picture';
import { Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import type { BladeFacts } from './blade_facts';
import { methodWords } from './blade_story';
import { exaggerated, pathsOf } from './section_plot';

const kUnits: Record<SectionUnit, string> = { [SectionUnit.UNSPECIFIED]: '', [SectionUnit.MM]: 'mm', [SectionUnit.DEG]: '°', [SectionUnit.RATIO]: '' };
const kEnds: Record<SectionEnd, string> = { [SectionEnd.UNSPECIFIED]: 'not found', [SectionEnd.ROUND]: 'round', [SectionEnd.SQUARE]: 'square', [SectionEnd.SHARP]: 'sharp', [SectionEnd.NOT_SEEN]: 'not seen' };
const wordsOf = (value: SectionValue): string => (SectionParameter[value.parameter] ?? '').toLowerCase().replaceAll('_', ' ');
const figure = (value: SectionValue, of: number | undefined): string => (of === undefined ? '' : number(of, decimalsFor(value.expandedUncertainty, 4)));

const kValues: Column<SectionValue>[] = [
  { head: 'Parameter', cell: wordsOf, csv: (v) => SectionParameter[v.parameter] },
  { head: 'Unit', cell: (v) => kUnits[v.unit], csv: (v) => SectionUnit[v.unit] },
  { head: 'CAD', isNumber: true, cell: (v) => figure(v, v.nominal), csv: (v) => v.nominal },
  { head: 'Measured', isNumber: true, cell: (v) => (v.value === undefined ? 'not measured' : figure(v, v.value)), csv: (v) => v.value },
  { head: 'Deviation', isNumber: true, cell: (v) => (v.value === undefined || v.nominal === undefined ? '' : figure(v, v.value - v.nominal)), csv: (v) => (v.value === undefined || v.nominal === undefined ? undefined : v.value - v.nominal) },
  { head: 'U (95 %)', isNumber: true, cell: (v) => figure(v, v.expandedUncertainty), csv: (v) => v.expandedUncertainty },
  { head: 'Why', cell: (v) => v.reason, csv: (v) => v.reason },
];

const kFactors = [1, 10, 30, 100];

function Plot({ outline, title }: { outline: SectionOutline; title: string }) {
  const [factor, setFactor] = useState(30);
  const { viewBox, nominal, measured, width } = pathsOf(outline, factor);
  const least = Math.min(0, ...outline.deviationsUm), greatest = Math.max(0, ...outline.deviationsUm);
  return (
    <div>
      <label class="no-print">Deviations drawn <select value={factor} onChange={(event) => setFactor(Number(event.currentTarget.value))}>
        {kFactors.map((times) => <option key={times} value={times}>{times === 1 ? 'as they are' : `${times} times`}</option>)}</select></label>
      <Picture title={`${title}, deviations ${exaggerated(factor)}`} file={title}>
        <svg class="section-plot" viewBox={viewBox} role="img"
          aria-label={`${title}: the CAD's outline and, with deviations drawn ${exaggerated(factor)}, the measured one. ${measured.length === 0 ? 'No outline was measured.' : `Deviations from ${number(least, 1)} to ${number(greatest, 1)} µm; ${plural(outline.gapsBefore.length, 'gap')}.`}`}>
          <path class="outline-nominal" d={nominal} stroke-width={width} />
          {measured.map((d) => <path key={d} class="outline-measured" d={d} stroke-width={1.4 * width} />)}
        </svg>
      </Picture>
    </div>
  );
}

function One({ section, outline, blade }: { section: Section; outline: SectionOutline | undefined; blade: string }) {
  const name = section.plane?.section ?? '';
  return (
    <>
      {section.reason ? <p class="problem">Not measured: {section.reason}</p> : (
        <p class="small">{count(section.pointCount)} points, noise {number(section.noiseUm, 2)}&#8239;µm, wavers by {number(section.waverUm, 2)}&#8239;µm over {number(section.waverLengthMm, 1)}&#8239;mm;
          leading end {kEnds[section.leading]}, trailing end {kEnds[section.trailing]}{(section.gapShare ?? 0) > 0 && `; ${percent(section.gapShare)} of the outline not seen`}.</p>)}
      {outline && <Plot outline={outline} title={`Section ${name} of ${blade}`} />}
      <Table caption={`Section ${name}`} columns={kValues} rows={section.values} rowKey={(v) => String(v.parameter)} />
    </>
  );
}

function Measurement({ measurement }: { measurement: SectionMeasurement }) {
  const [picked, setPicked] = useState(0);
  const outlines = useAsked([measurement.name], async (signal) => {
    const all: SectionOutline[] = [];
    for await (const outline of client(SectionService).downloadSectionOutlines({ name: measurement.name }, { signal })) all.push(outline);
    return all;
  });
  const section = measurement.sections[Math.min(picked, measurement.sections.length - 1)]!;
  return (
    <>
      <p class="small">{full(dateOf(measurement.recordedAt))} by {personOf(measurement.requestedBy)}; positioned by <a href={pageOf(measurement.registration)}>{methodWords(Method[measurement.method] ?? '')}</a>; twist from {measurement.referenceSection}.</p>
      {measurement.sections.length > 1 && <label class="no-print">Section <select value={picked} onChange={(event) => setPicked(Number(event.currentTarget.value))}>
        {measurement.sections.map((one, i) => <option key={one.plane?.section} value={i}>{one.plane?.section}{one.reason && ' (not measured)'}</option>)}</select></label>}
      <Shown asked={outlines} what="outlines">{(all) => <One section={section} outline={all.find((one) => one.section === section.plane?.section)} blade={measurement.blade} />}</Shown>
    </>
  );
}

export function Sections({ facts }: { facts: BladeFacts }) {
  const blade = facts.blade.name, of = facts.after ?? facts.before;
  const may = useMay(SectionService.method.listSectionMeasurements), mayMeasure = useMay(SectionService.method.measureSections);
  const [doing, setDoing] = useState(''), [heights, setHeights] = useState('');
  const asked = useAsked([blade, may], async (signal) => (may ? (await client(SectionService).listSectionMeasurements({ blade, pageSize: 1, view: View.FULL }, { signal })).sections : []),
    ({ entry }) => entry?.kind === 'section' && entry.blade === blade);
  if (!may) return null;
  const measure = async () => {
    const wanted = heights.split(/[\s,;]+/).filter(Boolean).map(Number);
    if (wanted.length === 0 || wanted.some((height) => !Number.isFinite(height))) { setDoing('Heights are numbers along the part’s Z, in mm: 15, 22.5, 30'); return; }
    setDoing('Cutting the blade…');
    try {
      await client(SectionService).measureSections({ registration: of!.name, requestId: newRequestId(),
        sections: wanted.map((zMm) => ({ section: `z ${zMm}`, originInPartMm: { xMm: 0, yMm: 0, zMm } })) });
      setDoing('');
      asked.again();
    } catch (error) {
      setDoing(refusalOf(error).text);
    }
  };
  return (
    <section class="section no-print" aria-labelledby="sections-title" id="sections">
      <div class="table-head"><h2 id="sections-title">Sections</h2>
        {mayMeasure && of?.zeroFromPart && <form class="buttons no-print" onSubmit={(event) => { event.preventDefault(); void measure(); }}>
          <label>Heights, mm <input value={heights} onInput={(event) => setHeights(event.currentTarget.value)} placeholder="15, 22.5, 30" /></label>
          <button type="submit" disabled={doing.endsWith('…')}>Measure</button></form>}</div>
      <p role="status" class="small">{doing}</p>
      <Shown asked={asked} what="sections">{(list) => (list.length === 0 ? <p class="muted">Its sections were not measured yet.</p> : <Measurement key={list[0]!.name} measurement={list[0]!} />)}</Shown>
    </section>
  );
}

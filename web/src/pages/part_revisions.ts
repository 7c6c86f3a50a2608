// What differs between two revisions of a part, value by value.
import { CadFormat, PositionZone, ShapeRegionKind, type Part } from '#proto/sixpoint/plant/v1/part_pb';
import { directionOf, minus, length, vectorOf, type Vector } from '../scene/frames';

export type Difference = { of: string; what: string; before: string; now: string; unit: string };

const kSameMm = 1e-9;
const text = (value: number | undefined): string => (value === undefined ? 'none' : String(Number(value.toPrecision(9))));
const place = (p: Vector): string => p.map((mm) => String(Number(mm.toFixed(6)))).join(', ');

type Values = Record<string, [text: string, unit: string]>;

// By name, so that what has moved in a list has not changed.
function factsOf(part: Part): Map<string, Values> {
  const facts = new Map<string, Values>(), surface = part.surface;
  facts.set('CAD', {
    format: [CadFormat[part.cadFormat] ?? '', ''], 'unit of its numbers': [text(part.cadUnitMm || 1), 'mm'], 'digest of the file': [surface?.cadSha256.slice(0, 16) ?? 'none', ''], triangles: [text(Number(surface?.triangleCount ?? 0)), ''],
    'chordal error': [text(surface?.chordalErrorUm), 'µm'], 'encloses a volume': [surface?.closed ? 'yes' : 'no', ''], 'least corner': [place(vectorOf(surface?.minimumMm)), 'mm'], 'greatest corner': [place(vectorOf(surface?.maximumMm)), 'mm'],
  });
  const pose = part.zeroFromPartNominal;
  facts.set('Nominal pose', { rotation: [(pose?.rotation ?? []).map((x) => String(Number(x.toFixed(9)))).join(', '), ''], shift: [place(vectorOf(pose?.translationMm)), 'mm'] });
  facts.set('Part', { customer: [part.customer || 'nobody’s', ''], 'thermal expansion': [text(part.thermalExpansion?.umPerMK), 'µm/(m K)'] });
  for (const group of part.holeGroups) {
    facts.set(`Group ${group.group}`, {
      diameter: [text(group.diameterMm), 'mm'], depth: [text(group.depthMm), 'mm'], 'first axis': [text(group.aNominalDeg), 'deg'], 'second axis': [text(group.bNominalDeg), 'deg'], axis: [place(directionOf(group.axisInPart)), ''],
      'position tolerance': [`${text(group.positionToleranceMm)} ${(PositionZone[group.positionZone] ?? '').toLowerCase()}`, 'mm'], 'inclination tolerance': [text(group.inclinationToleranceDeg), 'deg'], 'gauge pin': [text(group.gaugePin?.diameterMm), 'mm'],
    });
    for (const hole of group.holes) facts.set(`Hole ${group.group}/${hole.hole}`, { start: [place(vectorOf(hole.startInPartMm)), 'mm'], normal: [place(directionOf(hole.normalInPart)), ''] });
  }
  for (const datum of part.sixPoints) facts.set(`Datum ${datum.datum}`, { point: [place(vectorOf(datum.pointInPartMm)), 'mm'], normal: [place(directionOf(datum.normalInPart)), ''] });
  for (const { station, zeroFromPartNominal: at, captureMm } of part.stations) {
    facts.set(`Station ${station}`, { rotation: [(at?.rotation ?? []).map((x) => String(Number(x.toFixed(9)))).join(', '), ''], shift: [place(vectorOf(at?.translationMm)), 'mm'], 'captures within': [text(captureMm), 'mm'] });
  }
  for (const { region, kind, rest, minimumInPartMm: low, maximumInPartMm: high, facingInPart: facing, ...of } of part.shapeRegions) {
    facts.set(`Shape region ${region}`, {
      becomes: [(ShapeRegionKind[kind] ?? '').toLowerCase(), ''], where: [rest ? 'the rest' : `${low ? place(vectorOf(low)) : 'open'} to ${high ? place(vectorOf(high)) : 'open'}`, rest ? '' : 'mm'],
      'looks to': [facing ? place(directionOf(facing)) : 'any way', ''], within: [text(of.facingWithinDeg), 'deg'], allowance: [text(of.allowanceMm), 'mm'], lower: [text(of.lowerMm), 'mm'], upper: [text(of.upperMm), 'mm'],
    });
  }
  return facts;
}

export function differencesOf(before: Part, now: Part): Difference[] {
  const a = factsOf(before), b = factsOf(now), found: Difference[] = [];
  for (const of of new Set([...a.keys(), ...b.keys()])) {
    const old = a.get(of), fresh = b.get(of);
    if (!old || !fresh) { found.push({ of, what: '', before: old ? 'there' : 'not there', now: fresh ? 'there' : 'not there', unit: '' }); continue; }
    for (const [what, [value, unit]] of Object.entries(fresh)) if (old[what]![0] !== value) found.push({ of, what, before: old[what]![0], now: value, unit });
  }
  return found;
}

// How far each start has moved, where it has.
export function movedStarts(before: Part, now: Part): { key: string; fromMm: Vector; toMm: Vector }[] {
  const old = new Map<string, Vector>(before.holeGroups.flatMap((group) => group.holes.map((hole) => [`${group.group}/${hole.hole}`, vectorOf(hole.startInPartMm)] as const)));
  return now.holeGroups.flatMap((group) => group.holes.flatMap((hole) => {
    const key = `${group.group}/${hole.hole}`, fromMm = old.get(key), toMm = vectorOf(hole.startInPartMm);
    return fromMm && length(minus(toMm, fromMm)) > kSameMm ? [{ key, fromMm, toMm }] : [];
  }));
}

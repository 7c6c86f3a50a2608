// A section's outlines as paths of SVG, deviations drawn larger than they are. Section frame, mm; y points up.
import type { SectionOutline } from '#proto/sixpoint/inspection/v1/section_pb';

type Drawn = Pick<SectionOutline, 'nominalMm' | 'measuredMm' | 'deviationsUm' | 'gapsBefore'>;

export const exaggerated = (factor: number): string => (factor === 1 ? 'as they are' : `${factor} times`);

// Each place moved along the outline's own outward normal, by what the factor adds.
export function movedMm(outline: Drawn, factor: number): [number, number][] {
  const at = (i: number): [number, number] => [outline.measuredMm[2 * i]!, outline.measuredMm[2 * i + 1]!];
  const n = outline.deviationsUm.length;
  return outline.deviationsUm.map((um, i) => {
    const [x, y] = at(i), [ax, ay] = at((i + n - 1) % n), [bx, by] = at((i + 1) % n);
    const along = [bx - ax, by - ay] as const, length = Math.hypot(...along) || 1;
    const by_ = ((factor - 1) * um) / 1000 / length;  // counter-clockwise about the solid: outward is to the right
    return [x + by_ * along[1], y - by_ * along[0]];
  });
}

const text = (value: number): string => value.toFixed(4);
const line = (points: [number, number][]): string => points.map(([x, y], i) => `${i === 0 ? 'M' : 'L'}${text(x)} ${text(-y)}`).join('');

export function pathsOf(outline: Drawn, factor: number): { viewBox: string; nominal: string; measured: string[]; width: number } {
  const nominal: [number, number][] = [];
  for (let i = 0; 2 * i + 1 < outline.nominalMm.length; ++i) nominal.push([outline.nominalMm[2 * i]!, outline.nominalMm[2 * i + 1]!]);
  const moved = movedMm(outline, factor), gaps = new Set(outline.gapsBefore);
  const pieces: [number, number][][] = [];
  moved.forEach((point, i) => { if (i === 0 || gaps.has(i)) pieces.push([]); pieces.at(-1)!.push(point); });
  // The last place is followed by the first.
  if (moved.length > 0 && !gaps.has(0)) pieces.length > 1 ? pieces[0]!.unshift(...pieces.pop()!) : pieces[0]!.push(moved[0]!);
  const all = [...nominal, ...moved], x = all.map((p) => p[0]), y = all.map((p) => -p[1]);
  const left = Math.min(...x), right = Math.max(...x), top = Math.min(...y), bottom = Math.max(...y), margin = 0.05 * Math.max(right - left, bottom - top);
  return {
    viewBox: `${text(left - margin)} ${text(top - margin)} ${text(right - left + 2 * margin)} ${text(bottom - top + 2 * margin)}`,
    nominal: nominal.length > 0 ? `${line(nominal)}Z` : '', measured: pieces.map(line), width: (right - left) / 500,
  };
}

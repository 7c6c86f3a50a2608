// One parameter over time, drawn by uPlot: in a file of its own, which only who looks at a trend loads.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';

export type TrendDot = { at: Date; value: number; standardUncertainty: number; isAlarm: boolean; name: string; step: { low: number; high: number } | undefined };
export type TrendInk = { ink: string; faint: string; line: string; value: string; alarm: string; band: string; limit: string };
export type TrendDrawn = {
  dots: TrendDot[];
  aside: { at: Date; value: number; word: string }[];  // withdrawn ones and drafts: not part of the trend
  slopePerDay: number | undefined;
  isTrendAlarm: boolean;
  limit: number | undefined;  // from the first value
  current: string;  // calibrations/{uuid} that is looked at
  decimals: number;
  unit: string;
};

// Where the weighted line with that slope goes through: the middle of the values by their weights.
function middleOf(dots: TrendDot[]): { at: number; value: number } {
  let sum = 0, at = 0, value = 0;
  for (const dot of dots) {
    const weight = 1 / Math.max(1e-30, dot.standardUncertainty ** 2);
    sum += weight; at += weight * dot.at.getTime(); value += weight * dot.value;
  }
  return { at: at / sum / 1000, value: value / sum };
}

export function drawTrend(place: HTMLElement, drawn: TrendDrawn, inks: TrendInk, onPick: (name: string) => void): { stop: () => void; canvas: () => HTMLCanvasElement } {
  const { dots, aside, limit } = drawn;
  const times = dots.map((dot) => dot.at.getTime() / 1000), first = dots[0]?.value ?? 0;
  const low = Math.min(...dots.map((dot) => Math.min(dot.value - 2 * dot.standardUncertainty, dot.step?.low ?? Infinity)), ...aside.map(({ value }) => value), ...(limit === undefined ? [] : [first - limit]));
  const high = Math.max(...dots.map((dot) => Math.max(dot.value + 2 * dot.standardUncertainty, dot.step?.high ?? -Infinity)), ...aside.map(({ value }) => value), ...(limit === undefined ? [] : [first + limit]));
  const pad = (high - low || Math.abs(high) || 1) * 0.08;
  const seconds = [...times, ...aside.map(({ at }) => at.getTime() / 1000)], from = Math.min(...seconds), until = Math.max(...seconds), side = (until - from || 86400) * 0.04;
  const draw = (u: uPlot) => {
    const pen = u.ctx, ratio = devicePixelRatio || 1;
    const x = (t: number) => u.valToPos(t, 'x', true), y = (value: number) => u.valToPos(value, 'y', true);
    pen.save();
    dots.forEach((dot, i) => {
      if (!dot.step) return;
      pen.fillStyle = inks.band;
      pen.fillRect(x(times[i]!) - 6 * ratio, y(dot.step.high), 12 * ratio, y(dot.step.low) - y(dot.step.high));
    });
    pen.lineWidth = ratio;
    if (limit !== undefined) {
      pen.strokeStyle = inks.limit;
      pen.setLineDash([6 * ratio, 4 * ratio]);
      for (const value of [first - limit, first + limit]) { pen.beginPath(); pen.moveTo(u.bbox.left, y(value)); pen.lineTo(u.bbox.left + u.bbox.width, y(value)); pen.stroke(); }
      pen.setLineDash([]);
    }
    if (drawn.slopePerDay !== undefined && dots.length > 0) {
      const middle = middleOf(dots), at = (t: number) => middle.value + (drawn.slopePerDay! * (t - middle.at)) / 86400;
      pen.strokeStyle = drawn.isTrendAlarm ? inks.alarm : inks.faint;
      pen.setLineDash([2 * ratio, 3 * ratio]);
      pen.beginPath(); pen.moveTo(x(times[0]!), y(at(times[0]!))); pen.lineTo(x(times.at(-1)!), y(at(times.at(-1)!))); pen.stroke();
      pen.setLineDash([]);
    }
    dots.forEach((dot, i) => {
      const px = x(times[i]!), py = y(dot.value), r = 3.6 * ratio;
      pen.strokeStyle = pen.fillStyle = dot.isAlarm ? inks.alarm : inks.value;
      pen.lineWidth = 1.4 * ratio;
      pen.beginPath();
      pen.moveTo(px, y(dot.value - 2 * dot.standardUncertainty)); pen.lineTo(px, y(dot.value + 2 * dot.standardUncertainty));
      pen.stroke();
      pen.beginPath();
      if (dot.isAlarm) { pen.moveTo(px, py - 1.4 * r); pen.lineTo(px + 1.3 * r, py + r); pen.lineTo(px - 1.3 * r, py + r); pen.closePath(); } else pen.arc(px, py, r, 0, 2 * Math.PI);
      pen.fill();
      if (dot.name === drawn.current) { pen.strokeStyle = inks.ink; pen.lineWidth = 2 * ratio; pen.beginPath(); pen.arc(px, py, 2.1 * r, 0, 2 * Math.PI); pen.stroke(); }
    });
    pen.strokeStyle = inks.faint;
    pen.lineWidth = 1.6 * ratio;
    for (const { at, value } of aside) {
      const px = x(at.getTime() / 1000), py = y(value), r = 3.6 * ratio;
      pen.beginPath(); pen.moveTo(px - r, py - r); pen.lineTo(px + r, py + r); pen.moveTo(px + r, py - r); pen.lineTo(px - r, py + r); pen.stroke();
    }
    pen.restore();
  };
  const axis = { stroke: inks.faint, grid: { stroke: inks.line, width: 1 }, ticks: { stroke: inks.line, width: 1 }, font: '12px system-ui, sans-serif' };
  const chart = new uPlot({
    width: place.clientWidth || 400, height: 190, legend: { show: false }, cursor: { y: false, points: { show: false } },
    scales: { x: { time: true, range: [from - side, until + side] }, y: { range: [low - pad, high + pad] } },
    axes: [axis, { ...axis, size: 88, values: (_, splits) => splits.map((value) => value.toFixed(Math.min(6, drawn.decimals)).replace('-', '\u2212')) }],
    series: [{}, { stroke: inks.line, width: 1, points: { show: false } }],
    hooks: { draw: [draw] },
  }, [times, dots.map((dot) => dot.value)], place);
  chart.over.addEventListener('click', () => { const dot = dots[chart.cursor.idx ?? -1]; if (dot) onPick(dot.name); });
  const watcher = new ResizeObserver(() => { if (place.clientWidth > 0 && place.clientWidth !== chart.width) chart.setSize({ width: place.clientWidth, height: 190 }); });
  watcher.observe(place);
  return { stop: () => { watcher.disconnect(); chart.destroy(); }, canvas: () => chart.ctx.canvas };
}

// A value with its expanded uncertainty between its limits. Limits stand at the same place of each, so that many below each other compare.
import type { Tone } from './mark';

const kWide = 144, kHigh = 18, kMiddle = kHigh / 2, kLow = 44, kUp = 100, kEdge = 5;

export type Limited = { value: number | undefined; expanded: number | undefined; lower: number | undefined; upper: number | undefined; isZeroBest: boolean };

// What the limits' places stand for. A side without a limit reaches as far as the value lies from the other one.
export function scaleOf({ value, expanded, lower, upper, isZeroBest }: Limited): { low: number; high: number } | undefined {
  if (lower !== undefined && upper !== undefined) return upper > lower ? { low: lower, high: upper } : undefined;
  const limit = lower ?? upper;
  if (limit === undefined) return undefined;
  if (isZeroBest && lower === undefined && limit > 0) return { low: 0, high: limit };
  const reach = (value === undefined ? Math.abs(limit) : Math.abs(value - limit) + (expanded ?? 0)) || 1;
  return lower === undefined ? { low: limit - reach, high: limit } : { low: limit, high: limit + reach };
}

const within = (x: number) => Math.min(kWide - kEdge, Math.max(kEdge, x));

// Of the line to one side; its end is drawn only where it is reached.
const reachOf = (from: number, to: number): string => `M${from} ${kMiddle}H${Math.min(kWide, Math.max(0, to))}${to >= 0 && to <= kWide ? `m0 -3v6` : ''}`;

// Round: within; a square on its corner: out; hollow: open. An arrow where it lies beyond what is drawn.
function Knot({ x, tone }: { x: number; tone: Tone }) {
  const at = within(x);
  if (x !== at) return <path class={`knot-${tone}`} d={x < at ? `M1 ${kMiddle}l8 -5v10z` : `M${kWide - 1} ${kMiddle}l-8 -5v10z`} />;
  return tone === 'bad' ? <path class="knot-bad" d={`M${at} ${kMiddle - 5}l5 5l-5 5l-5 -5z`} /> : <circle class={`knot-${tone}`} cx={at} cy={kMiddle} r={tone === 'unsure' ? 3.4 : 4} />;
}

export function WithinLimits({ limited, tone, words }: { limited: Limited; tone: Tone; words: string }) {
  const { value, expanded, lower, upper, isZeroBest } = limited, scale = scaleOf(limited);
  if (!scale) return null;
  const x = (of: number) => kLow + ((kUp - kLow) * (of - scale.low)) / (scale.high - scale.low);
  const from = lower !== undefined || isZeroBest ? kLow : 0, to = upper !== undefined ? kUp : kWide;
  return (
    <svg class="within" viewBox={`0 0 ${kWide} ${kHigh}`} width={kWide} height={kHigh} role="img" aria-label={words}>
      <rect class="within-base" x={0} y={4} width={kWide} height={kHigh - 8} />
      <rect class="within-zone" x={from} y={4} width={to - from} height={kHigh - 8} />
      {lower !== undefined && <path class="within-limit" d={`M${kLow} 1V${kHigh - 1}`} />}
      {upper !== undefined && <path class="within-limit" d={`M${kUp} 1V${kHigh - 1}`} />}
      {value !== undefined && expanded !== undefined && within(x(value)) === x(value) && <path class="within-whisker" d={`${reachOf(x(value), x(value - expanded))}${reachOf(x(value), x(value + expanded))}`} />}
      {value !== undefined && <Knot x={x(value)} tone={tone} />}
    </svg>
  );
}

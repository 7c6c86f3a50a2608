// Values as bars: against a limit, or about zero with their expanded uncertainty. Each says in words what it shows.
import { number, withUncertainty } from '../words/quantity';

const kWide = 200;

// The limit stands at the same place of each, so that many below each other compare.
export function AgainstLimit({ value, limit, isLeast, passed, words }: { value: number | undefined; limit: number; isLeast: boolean; passed: boolean; words: string }) {
  const ratio = value === undefined || !Number.isFinite(value) ? undefined : limit > 0 ? Math.max(0, value / limit) : passed ? 0 : 2;
  const x = (r: number) => kWide * Math.min(1, r / 2);  // the limit in the middle, twice of it at the end
  return (
    <svg class="against" viewBox={`0 0 ${kWide} 14`} preserveAspectRatio="none" role="img" aria-label={words}>
      <rect class="bar-base" x={0} y={3} width={kWide} height={8} />
      {ratio !== undefined && <rect class={passed ? 'bar-good' : 'bar-bad'} x={0} y={3} width={Math.max(1, x(ratio))} height={8} />}
      {isLeast && <rect class="bar-least" x={x(1)} y={3} width={kWide - x(1)} height={8} />}
      <line class="bar-limit" x1={x(1)} x2={x(1)} y1={0} y2={14} />
    </svg>
  );
}

export type ZeroBar = { name: string; value: number; expanded?: number | undefined; tone?: 'good' | 'bad' | undefined };

// Bars about zero, one scale for all of them; whiskers are ± U.
export function AboutZero({ bars, unit, decimals, label }: { bars: ZeroBar[]; unit: string; decimals: number; label: string }) {
  const kRow = 22, kName = 62, kBar = 220, kText = 178, middle = kName + kBar / 2;
  const most = Math.max(1e-9, ...bars.map(({ value, expanded }) => Math.abs(value) + (expanded ?? 0)));
  const x = (value: number) => middle + (kBar / 2) * (value / most) * 0.97;
  return (
    <svg class="chart" viewBox={`0 0 ${kName + kBar + kText} ${kRow * bars.length + 4}`} role="img"
      aria-label={`${label}: ${bars.map(({ name, value, expanded }) => `${name} ${withUncertainty(value, expanded, unit, decimals)}`).join('; ')}`}>
      <line class="axis" x1={middle} x2={middle} y1={0} y2={kRow * bars.length} />
      {bars.map(({ name, value, expanded, tone }, i) => {
        const y = kRow * i + kRow / 2 + 2;
        return (
          <g key={name}>
            <text x={kName - 6} y={y + 4} text-anchor="end">{name}</text>
            <rect class={tone === 'bad' ? 'bar-bad' : 'bar-value'} x={Math.min(middle, x(value))} y={y - 6} width={Math.max(0.5, Math.abs(x(value) - middle))} height={12} />
            {expanded !== undefined && <path class="whisker" d={`M${x(value - expanded)} ${y - 4}v8M${x(value + expanded)} ${y - 4}v8M${x(value - expanded)} ${y}H${x(value + expanded)}`} />}
            <text x={kName + kBar + 8} y={y + 4}>{expanded === undefined ? `${number(value, decimals)}\u202f${unit}` : withUncertainty(value, expanded, unit)}</text>
          </g>
        );
      })}
    </svg>
  );
}

export type Dot = { value: number; isHollow?: boolean; title: string };

// Many values of one unit as dots about zero, a row a group; hollow ones took no part in the fit.
export function DotStrips({ strips, unit, decimals, label }: { strips: { name: string; dots: Dot[] }[]; unit: string; decimals: number; label: string }) {
  const kRow = 30, kName = 128, kBar = 330, kFoot = 20;
  const values = strips.flatMap(({ dots }) => dots.map(({ value }) => value));
  const most = Math.max(1e-9, ...values.map(Math.abs)) * 1.06, isSigned = values.some((value) => value < 0);
  const x = (value: number) => kName + (isSigned ? (kBar * (value / most + 1)) / 2 : (kBar * value) / most);
  const high = kRow * strips.length;
  const words = strips.map(({ name, dots }) => `${name}: ${dots.length} values, rms ${number(Math.sqrt(dots.reduce((sum, { value }) => sum + value * value, 0) / Math.max(1, dots.length)), decimals)} ${unit}`).join('; ');
  return (
    <svg class="chart" viewBox={`0 0 ${kName + kBar + 20} ${high + kFoot}`} role="img" aria-label={`${label}. ${words}`}>
      {(isSigned ? [-most, 0, most] : [0, most]).map((value) => (
        <g key={value}><line class="axis" x1={x(value)} x2={x(value)} y1={0} y2={high} /><text class="faint" x={x(value)} y={high + 14} text-anchor={value === most ? 'end' : 'middle'}>{number(value, decimals)}&#8239;{unit}</text></g>
      ))}
      {strips.map(({ name, dots }, row) => {
        const y = kRow * row + kRow / 2, rms = Math.sqrt(dots.reduce((sum, { value }) => sum + value * value, 0) / Math.max(1, dots.length));
        return (
          <g key={name}>
            <text x={kName - 8} y={y + 4} text-anchor="end">{name}</text>
            {dots.map((dot, i) => <circle key={i} class={dot.isHollow ? 'dot-hollow' : 'dot-full'} cx={x(dot.value)} cy={y + ((i * 7) % 13) - 6} r={2.6}><title>{dot.title}</title></circle>)}
            {dots.length > 1 && <path class="whisker" d={isSigned ? `M${x(-rms)} ${y + 10}v4M${x(rms)} ${y + 10}v4M${x(-rms)} ${y + 12}H${x(rms)}` : `M${x(rms)} ${y - 12}v24`} />}
          </g>
        );
      })}
    </svg>
  );
}

export type Curve = { name: string; className: string; values: number[] };

// Values at equal steps, one curve over the other.
export function Curves({ curves, fromX, stepX, unitX, unit, decimals, label, limits = [] }: {
  curves: Curve[]; fromX: number; stepX: number; unitX: string; unit: string; decimals: number; label: string; limits?: number[];
}) {
  const kLeft = 66, kWide = 500, kHigh = 150, kFoot = 34;
  const all = [...curves.flatMap(({ values }) => values), ...limits], low = Math.min(0, ...all), high = Math.max(0, ...all), reach = Math.max(1e-12, high - low);
  const count = Math.max(2, ...curves.map(({ values }) => values.length));
  const x = (i: number) => kLeft + (kWide * i) / count, y = (value: number) => 8 + kHigh * (1 - (value - low) / reach);
  return (
    <svg class="chart" viewBox={`0 0 ${kLeft + kWide + 14} ${kHigh + kFoot + 8}`} role="img"
      aria-label={`${label}: ${curves.map(({ name, values }) => `${name} from ${number(Math.min(...values), decimals)} to ${number(Math.max(...values), decimals)} ${unit}`).join('; ')}`}>
      {[low, 0, high].filter((value, i, some) => some.indexOf(value) === i).map((value) => (
        <g key={value}><line class="axis" x1={kLeft} x2={kLeft + kWide} y1={y(value)} y2={y(value)} /><text class="faint" x={kLeft - 6} y={y(value) + 4} text-anchor="end">{number(value, decimals)}</text></g>
      ))}
      {limits.map((value) => <line key={value} class="limit" x1={kLeft} x2={kLeft + kWide} y1={y(value)} y2={y(value)} />)}
      {[0, 0.25, 0.5, 0.75, 1].map((share) => <text key={share} class="faint" x={kLeft + share * kWide} y={kHigh + 24} text-anchor="middle">{number(fromX + share * count * stepX, 0)}</text>)}
      <text class="faint" x={kLeft + kWide} y={kHigh + 39} text-anchor="end">{unitX}</text><text class="faint" x={kLeft} y={kHigh + 39}>{unit}</text>
      {curves.map(({ name, className, values }) => <path key={name} class={className} d={values.map((value, i) => `${i === 0 ? 'M' : 'L'}${x(i).toFixed(1)} ${y(value).toFixed(1)}`).join('')} />)}
      {curves.map(({ name, className }, i) => <g key={name}><path class={className} d={`M${kLeft + 60 + 150 * i} ${kHigh + 35}h22`} /><text x={kLeft + 88 + 150 * i} y={kHigh + 39}>{name}</text></g>)}
    </svg>
  );
}

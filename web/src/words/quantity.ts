// How values are written: unit and expanded uncertainty U (95 %) beside each, as many digits as U has two of, and what was not measured in words.
export const kNotMeasured = 'not measured';
const kNarrow = '\u202f';  // between a number and its unit, so that they stay together

export function decimalsFor(uncertainty: number | undefined, fallback: number): number {
  if (uncertainty === undefined || !(uncertainty > 0)) return fallback;
  return Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(uncertainty) + 1e-9)));
}

export function number(value: number | undefined, decimals: number): string {
  if (value === undefined || !Number.isFinite(value)) return kNotMeasured;
  const text = value.toFixed(decimals);
  return (Number(text) === 0 ? text.replace('-', '') : text).replace('-', '\u2212');
}

// Of a field in which 0 says that it was not determined.
export function orNone(value: number): number | undefined {
  return value === 0 ? undefined : value;
}

export function quantity(value: number | undefined, unit: string, decimals: number): string {
  const text = number(value, decimals);
  return text === kNotMeasured ? text : `${text}${kNarrow}${unit}`;
}

// 0.0123 ± 0.0021 mm
export function withUncertainty(value: number | undefined, expanded: number | undefined, unit: string, fallback = 3): string {
  if (value === undefined) return kNotMeasured;
  const decimals = decimalsFor(expanded, fallback);
  if (expanded === undefined) return `${quantity(value, unit, decimals)} (U not known)`;
  return `${number(value, decimals)} ± ${number(expanded, decimals)}${kNarrow}${unit}`;
}

const kThousands = /\B(?=(\d{3})+$)/g;
export const count = (value: number | bigint): string => String(value).replace(kThousands, kNarrow);

export function pointCount(value: number | bigint): string {
  const n = Number(value);
  return n >= 1e6 ? `${(n / 1e6).toFixed(1)}${kNarrow}M points` : n >= 1e4 ? `${Math.round(n / 1e3)}${kNarrow}k points` : `${count(n)} points`;
}

export const percent = (share: number | undefined): string => (share === undefined ? kNotMeasured : `${(100 * share).toFixed(share < 0.995 && share > 0.9 ? 1 : 0)}${kNarrow}%`);

export const plural = (n: number | bigint, one: string, many = one + 's'): string => `${count(n)} ${Number(n) === 1 ? one : many}`;

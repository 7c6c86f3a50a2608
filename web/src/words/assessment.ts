// What a blade is by its drawing, in words: stages, fates, limits, rules, and whose value it is.
import { AssessmentStage, BlankFate, Cure, type CharacteristicFinding, type OtherValue } from '#proto/sixpoint/inspection/v1/assessment_pb';
import { Verdict } from '#proto/sixpoint/inspection/v1/inspection_pb';
import { CharacteristicClass, CharacteristicQuantity, CharacteristicUnit, DecisionRuleKind, type DecisionRule } from '#proto/sixpoint/plant/v1/drawing_pb';
import type { Tone } from '../view/mark';
import { idOf, kindOf, shortId, withoutRevision } from './name';
import { count, number, percent, plural, withUncertainty } from './quantity';

export const kStageWords: Record<AssessmentStage, string> = {
  [AssessmentStage.UNSPECIFIED]: '', [AssessmentStage.BEFORE_MACHINING]: 'before machining', [AssessmentStage.MACHINED]: 'machined',
};
export const kFateWords: Record<BlankFate, [Tone, string]> = {
  [BlankFate.UNSPECIFIED]: ['none', ''], [BlankFate.MACHINABLE]: ['good', 'Can be machined'], [BlankFate.DISCARD]: ['bad', 'Discard'], [BlankFate.UNDECIDED]: ['unsure', 'Open whether it can be machined'],
};
export const kCureWords: Record<Cure, string> = {
  [Cure.UNSPECIFIED]: '', [Cure.POSSIBLE]: 'a correction cures it', [Cure.NONE]: 'no motion cures it', [Cure.UNKNOWN]: 'not known',
};
export const kClassWords: Record<CharacteristicClass, string> = {
  [CharacteristicClass.UNSPECIFIED]: '', [CharacteristicClass.MINOR]: 'minor', [CharacteristicClass.MAJOR]: 'major', [CharacteristicClass.CRITICAL]: 'critical',
};
const kUnits: Record<CharacteristicUnit, string> = {
  [CharacteristicUnit.UNSPECIFIED]: '', [CharacteristicUnit.MM]: 'mm', [CharacteristicUnit.UM]: 'µm', [CharacteristicUnit.DEG]: 'deg', [CharacteristicUnit.RATIO]: '',
};
// Never negative, and best at 0.
const kZeroIsBest = new Set([CharacteristicQuantity.HOLE_POSITION, CharacteristicQuantity.HOLE_INCLINATION, CharacteristicQuantity.SECTION_LEADING_EDGE_FORM, CharacteristicQuantity.SECTION_TRAILING_EDGE_FORM]);
export const isZeroBest = ({ quantity }: CharacteristicFinding): boolean => kZeroIsBest.has(quantity);

// The worst first, as the contract orders verdicts.
export const kWorstFirst = [Verdict.NOT_CONFORM, Verdict.NOT_MEASURED, Verdict.UNDECIDABLE, Verdict.CONFORM];
const kCounted: Partial<Record<Verdict, string>> = { [Verdict.NOT_CONFORM]: 'not conform', [Verdict.NOT_MEASURED]: 'not measured', [Verdict.UNDECIDABLE]: 'undecidable' };

export const countsOf = (findings: CharacteristicFinding[]): Map<Verdict, number> =>
  new Map(kWorstFirst.map((verdict) => [verdict, findings.filter((one) => one.verdict === verdict).length]));

// "41 of 45 findings conform, 1 not conform, 2 not measured, 1 undecidable."
export function countsSentence(findings: CharacteristicFinding[]): string {
  const counts = countsOf(findings), rest = kWorstFirst.filter((verdict) => kCounted[verdict] && counts.get(verdict)! > 0);
  return `${[`${count(counts.get(Verdict.CONFORM)!)} of ${plural(findings.length, 'finding')} conform`, ...rest.map((verdict) => `${count(counts.get(verdict)!)} ${kCounted[verdict]}`)].join(', ')}.`;
}

// What is drawn is not rounded: as many decimals as it has.
const decimalsOf = (value: number): number => (String(Number(value.toFixed(6))).split('.')[1] ?? '').length;
const decimalsIn = ({ unit }: CharacteristicFinding): number => (unit === CharacteristicUnit.UM ? 1 : 4);

export function limitsWords(one: CharacteristicFinding): string {
  const { lowerLimit: lower, upperLimit: upper } = one, unit = kUnits[one.unit], of = unit && `\u202f${unit}`;
  const decimals = Math.max(...[lower, upper].map((limit) => (limit === undefined ? 0 : decimalsOf(limit))));
  if (lower !== undefined && upper !== undefined) return `${number(lower, decimals)} to ${number(upper, decimals)}${of}`;
  if (upper !== undefined) return `at most ${number(upper, decimals)}${of}`;
  return lower === undefined ? 'no limit' : `at least ${number(lower, decimals)}${of}`;
}

const written = (one: CharacteristicFinding, value: number | undefined, expanded: number | undefined): string => withUncertainty(value, expanded, kUnits[one.unit], decimalsIn(one)).trim();
export const valueWords = (one: CharacteristicFinding): string => written(one, one.value, one.expandedUncertainty);

export function ruleWords(rule: DecisionRule | undefined): string {
  switch (rule?.kind) {
    case DecisionRuleKind.ISO_14253_1: return `ISO 14253-1:${rule.edition}`;
    case DecisionRuleKind.SIMPLE_ACCEPTANCE: return 'simple acceptance';
    case DecisionRuleKind.GUARD_FACTOR: return `guard band ${rule.guardFactor === undefined ? 'not told' : percent(rule.guardFactor)} of U`;
    default: return 'not told';
  }
}

// By the fit; what another instrument brought has none.
export const byWords = (result: string, method: string): string => (result === '' ? '' : method !== '' ? method : `${kindOf(result).replace(/s$/, '')} ${shortId(result)}`);
export const otherWords = (one: CharacteristicFinding, other: OtherValue, method: string): string => `${written(one, other.value, other.expandedUncertainty)} by ${byWords(other.result, method)}`;

export const drawingWords = (drawing: string): string => `${idOf(withoutRevision(drawing))} rev. ${drawing.slice(drawing.lastIndexOf('@') + 1)}`;
export const groupWords = (group: string): string => (group === 'part' ? 'the whole part' : group);

// Verdicts and states: a shape, a word and a colour, so that none has to be seen alone.
import type { ComponentChildren } from 'preact';

export type Tone = 'good' | 'bad' | 'unsure' | 'none' | 'busy' | 'wait';

const kShapes: Record<Tone, ComponentChildren> = {
  good: <path d="M4 8.5 7 11.5 12.5 5" />,
  bad: <path d="M4.5 4.5 11.5 11.5M11.5 4.5 4.5 11.5" />,
  unsure: <path d="M5.5 6a2.6 2.6 0 1 1 3.6 2.3c-.8.4-1.1.8-1.1 1.6M8 12.6v.2" />,
  none: <path d="M4 8h8" />,
  busy: <path d="M6 4.5v7l5.5-3.5z" fill="currentColor" />,
  wait: <path d="M8 4v4.2l2.6 1.8" />,
};

export const Shape = ({ tone }: { tone: Tone }) => (
  <svg class={`shape tone-${tone}`} viewBox="0 0 16 16" width="16" height="16" aria-hidden="true">
    <circle cx="8" cy="8" r="7.2" class="ring" />
    <g fill="none" stroke="currentColor" stroke-width="1.8" stroke-linecap="round" stroke-linejoin="round">{kShapes[tone]}</g>
  </svg>
);

export const Mark = ({ tone, children, big }: { tone: Tone; children: ComponentChildren; big?: boolean }) => (
  <span class={`mark tone-${tone}${big ? ' mark-big' : ''}`}><Shape tone={tone} />{children}</span>
);

const kVerdicts: Record<string, [Tone, string]> = {
  CONFORM: ['good', 'Conform'],
  NOT_CONFORM: ['bad', 'Not conform'],
  UNDECIDABLE: ['unsure', 'Undecidable'],
  NOT_MEASURED: ['none', 'Not measured'],
  ACCEPTED: ['good', 'Accepted'],
  REJECTED: ['bad', 'Rejected'],
  REPORTED: ['none', 'Reported'],
  CONVERGED: ['good', 'Converged'],
  NOT_CONVERGED: ['bad', 'Not converged'],
  NOT_DETERMINED: ['bad', 'Not determined'],
  RECONSTRUCTED: ['good', 'Shape found'],
  TOO_LITTLE_OVERLAP: ['bad', 'Too little overlap'],
  INFEASIBLE: ['bad', 'Infeasible'],
  DRAFT: ['wait', 'Waits for a person'],
  RELEASED: ['good', 'Released'],
  REFUSED: ['bad', 'Refused'],
  SUPERSEDED: ['none', 'Superseded'],
  EXPIRED: ['none', 'Expired'],
  WITHDRAWN: ['bad', 'Withdrawn'],
  CUT: ['good', 'Cut'],
  IN_FORCE: ['good', 'In force'],
  NOT_YET_VALID: ['wait', 'Not valid yet'],
  KEPT: ['good', 'Points kept'],
  POINTS_DELETED: ['none', 'Points deleted'],
};

export const verdictWords = (verdict: string): string => kVerdicts[verdict]?.[1] ?? verdict;
export const verdictTone = (verdict: string): Tone => kVerdicts[verdict]?.[0] ?? 'none';

export const VerdictMark = ({ verdict, big }: { verdict: string; big?: boolean }) => (
  <Mark tone={verdictTone(verdict)} {...(big ? { big } : {})}>{verdictWords(verdict)}</Mark>
);

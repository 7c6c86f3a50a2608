// Who is signed in. The token is in a cookie that scripts cannot read; the gateway says whose it is.
import { Code, ConnectError } from '@connectrpc/connect';
import { Cell } from './cell';
import { refusalFromJson } from './refusal';

export type Session = {
  name: string;  // users/jane
  roles: string[];  // ENGINEER, ...
  renewableUntil: Date;
};

export type SessionState =
  | { is: 'unknown' }  // not asked yet
  | { is: 'away' }  // the gateway did not answer when it was asked first
  | { is: 'out'; wasIn: boolean }  // wasIn: a session that was there is over
  | { is: 'in'; session: Session };

export const sessionState = new Cell<SessionState>({ is: 'unknown' });

const kRenewEveryMs = 4 * 60_000;  // a token holds 15 min, and the gateway renews it in its last 5

type SessionJson = { name: string; roles: string[]; renewable_until: string };

function takeIn(json: SessionJson): void {
  const session = { name: json.name, roles: json.roles, renewableUntil: new Date(json.renewable_until) };
  sessionState.set({ is: 'in', session });
}

async function ask(method: string, body?: unknown): Promise<Response> {
  try {
    return await fetch('/session', {
      method,
      headers: body === undefined ? {} : { 'content-type': 'application/json' },
      ...(body === undefined ? {} : { body: JSON.stringify(body) }),
    });
  } catch {
    throw new ConnectError('The gateway does not answer.', Code.Unavailable);
  }
}

// Also renews. An answer that is neither yes nor no (the gateway is away) changes nothing for who is signed in.
export async function lookAtSession(): Promise<void> {
  let response: Response | undefined;
  try {
    response = await ask('GET');
  } catch {
    response = undefined;
  }
  if (response?.ok) takeIn((await response.json()) as SessionJson);
  else if (response?.status === 401) sessionIsOver();
  else if (sessionState.value.is === 'unknown') sessionState.set({ is: 'away' });
}

export function sessionIsOver(): void {
  const state = sessionState.value;
  if (state.is !== 'out') sessionState.set({ is: 'out', wasIn: state.is === 'in' });
}

export async function signIn(name: string, password: string): Promise<void> {
  const response = await ask('POST', { name: name.includes('/') ? name : `users/${name}`, password });
  if (!response.ok) throw await refusalFromJson(response);
  takeIn((await response.json()) as SessionJson);
}

export async function signOut(): Promise<void> {
  const response = await ask('DELETE');
  if (!response.ok && response.status !== 401) throw await refusalFromJson(response);
  sessionState.set({ is: 'out', wasIn: false });
}

export function keepSessionAlive(): void {
  setInterval(() => {
    if (sessionState.value.is === 'in') void lookAtSession();
  }, kRenewEveryMs);
  // A computer that slept may come back with a token that is over.
  document.addEventListener('visibilitychange', () => {
    if (document.visibilityState === 'visible' && sessionState.value.is === 'in') void lookAtSession();
  });
}

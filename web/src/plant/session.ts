// Who is signed in. The token is in a cookie that scripts cannot read; the gateway says whose it is.
import { Code, ConnectError } from '@connectrpc/connect';
import { fromJson, type JsonValue } from '@bufbuild/protobuf';
import { timestampDate } from '@bufbuild/protobuf/wkt';
import { Role } from '#proto/sixpoint/access/v1/access_pb';
import { SessionSchema } from '#proto/sixpoint/plant/v1/account_pb';
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

// plant.v1.Session without its token; {}: nobody is signed in.
function takeIn(json: JsonValue): void {
  const told = fromJson(SessionSchema, json, { ignoreUnknownFields: true });
  if (!told.name || !told.renewableUntil) return sessionIsOver();
  const roles = told.roles.map((role) => Role[role]);
  sessionState.set({ is: 'in', session: { name: told.name, roles, renewableUntil: timestampDate(told.renewableUntil) } });
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
  if (response?.ok) takeIn((await response.json()) as JsonValue);
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
  takeIn((await response.json()) as JsonValue);
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

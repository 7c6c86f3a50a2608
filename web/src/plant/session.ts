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

// plant.v1.Session without its token; {}: nobody is signed in, of those who were when it was asked.
function takeIn(json: JsonValue, asked: number): void {
  const told = fromJson(SessionSchema, json, { ignoreUnknownFields: true });
  if (!told.name || !told.renewableUntil) return sessionIsOver(asked);
  if (sessionState.value.is !== 'in') ++number;
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
  const asked = number;
  try {
    response = await ask('GET');
  } catch {
    response = undefined;
  }
  if (response?.ok) takeIn((await response.json()) as JsonValue, asked);
  else if (response?.status === 401) sessionIsOver(asked);
  else if (sessionState.value.is === 'unknown') sessionState.set({ is: 'away' });
}

// Of the sign-in that holds. A call of the session before may be refused only after the next one began, and says nothing of that.
let number = 0;
export const sessionNumber = (): number => number;

export function sessionIsOver(which = number): void {
  const state = sessionState.value;
  if (which !== number) return;
  if (state.is !== 'out') sessionState.set({ is: 'out', wasIn: state.is === 'in' });
}

export async function signIn(name: string, password: string): Promise<void> {
  const response = await ask('POST', { name: name.includes('/') ? name : `users/${name}`, password });
  if (!response.ok) throw await refusalFromJson(response);
  takeIn((await response.json()) as JsonValue, number);
}

// What people call the house's own sign-in; nothing where there is none, or the gateway does not say.
export async function directoryName(): Promise<string | undefined> {
  try {
    const response = await fetch('/session/provider');
    const told = response.ok ? ((await response.json()) as { name?: unknown }) : {};
    return typeof told.name === 'string' && told.name !== '' ? told.name : undefined;
  } catch {
    return undefined;
  }
}

// There by the gateway, and back to where one is; what the gateway takes for no way back leads to the fleet.
export function signInByDirectory(): void {
  const here = location.pathname + location.search;
  const isWay = here.length <= 1024 && !/\/[/.]/.test(location.pathname);
  location.assign(`/session/start?return=${encodeURIComponent(isWay ? here : '/')}`);
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

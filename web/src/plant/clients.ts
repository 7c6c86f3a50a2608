// The plant's services, by the gateway that served this page.
import { Code, ConnectError, createClient, type Client, type Interceptor } from '@connectrpc/connect';
import { createConnectTransport } from '@connectrpc/connect-web';
import type { DescService } from '@bufbuild/protobuf';
import { areaOf, noteAnswer, noteAway } from './reach';
import { sessionIsOver, sessionNumber } from './session';

function noteFailure(error: unknown, area: string, asked: number): void {
  const refusal = ConnectError.from(error);
  if (refusal.cause instanceof TypeError || error instanceof TypeError) noteAway('gateway');
  else if (refusal.code === Code.Unavailable) noteAway(area);
  else if (refusal.code === Code.Unauthenticated) sessionIsOver(asked);
  else if (refusal.code !== Code.Canceled) noteAnswer(area);
}

// A stream begins before its service was heard, and says how it ends in its last message. One that outlives its token ends, too: that says
// nothing of the session, which may have been renewed.
async function* heard<T>(messages: AsyncIterable<T>, area: string, asked: number): AsyncIterable<T> {
  try {
    for await (const message of messages) {
      noteAnswer(area);
      yield message;
    }
  } catch (error) {
    if (ConnectError.from(error).code !== Code.Unauthenticated) noteFailure(error, area, asked);
    throw error;
  }
}

const watchTheDoor: Interceptor = (next) => async (request) => {
  const area = areaOf(request.service.typeName), asked = sessionNumber();
  try {
    const answer = await next(request);
    if (answer.stream) return { ...answer, message: heard(answer.message, area, asked) };
    noteAnswer(area);
    return answer;
  } catch (error) {
    noteFailure(error, area, asked);
    throw error;
  }
};

// Bytes and not JSON: the gateway then passes answers on as they are, and points and surfaces come without base64.
const transport = createConnectTransport({
  baseUrl: location.origin,
  useBinaryFormat: true,
  useHttpGet: true,
  interceptors: [watchTheDoor],
});

const clients = new Map<DescService, unknown>();

export function client<T extends DescService>(service: T): Client<T> {
  let found = clients.get(service) as Client<T> | undefined;
  if (!found) clients.set(service, (found = createClient(service, transport)));
  return found;
}

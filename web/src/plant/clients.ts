// The plant's services, by the gateway that served this page.
import { Code, ConnectError, createClient, type Client, type Interceptor } from '@connectrpc/connect';
import { createConnectTransport } from '@connectrpc/connect-web';
import type { DescService } from '@bufbuild/protobuf';
import { areaOf, noteAnswer, noteAway } from './reach';
import { sessionIsOver } from './session';

const watchTheDoor: Interceptor = (next) => async (request) => {
  const area = areaOf(request.service.typeName);
  try {
    const answer = await next(request);
    noteAnswer(area);
    return answer;
  } catch (error) {
    const refusal = ConnectError.from(error);
    if (refusal.cause instanceof TypeError || error instanceof TypeError) noteAway('gateway');
    else if (refusal.code === Code.Unavailable) noteAway(area);
    else if (refusal.code === Code.Unauthenticated) sessionIsOver();
    else if (refusal.code !== Code.Canceled) noteAnswer(area);
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

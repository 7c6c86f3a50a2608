// What a refused call says, in words for a person.
import { Code, ConnectError } from '@connectrpc/connect';
import { BadRequestSchema, ErrorInfoSchema } from '#proto/google/rpc/error_details_pb';
import { RefusalSchema } from '#proto/sixpoint/errors/v1/refusal_pb';

export type Refusal = {
  title: string;
  text: string;
  reason: string;  // of sixpoint.errors.v1, or the code's name
  isAway: boolean;  // nothing is wrong with what was asked: again later
  violations: { field: string; value: string; wanted: string }[];
};

const kTitles: Partial<Record<Code, string>> = {
  [Code.Canceled]: 'The call was broken off',
  [Code.InvalidArgument]: 'Something in the request is not right',
  [Code.DeadlineExceeded]: 'The plant took too long',
  [Code.NotFound]: 'Not found',
  [Code.AlreadyExists]: 'It exists already',
  [Code.PermissionDenied]: 'You may not see or do this',
  [Code.ResourceExhausted]: 'The plant is busy',
  [Code.FailedPrecondition]: 'Not possible as things stand',
  [Code.Aborted]: 'Somebody else was faster',
  [Code.Unavailable]: 'A service is away',
  [Code.DataLoss]: 'Stored data is damaged',
  [Code.Unauthenticated]: 'You are not signed in',
};

const kReasons: Record<string, string> = {
  SIGN_IN_REFUSED: 'Name or password is not right. The plant does not say which.',
  CLEARANCE_MISSING: 'This belongs to a part that you are not cleared for, or it is not recorded. Ask who runs the plant.',
  ROLE_MISSING: 'None of your roles may do this. Ask who runs the plant.',
  SESSION_ENDED: 'Your session is over. Sign in again.',
  CORRECTION_DECIDED: 'Somebody has decided about this correction already. Look at its state.',
  CORRECTION_DECIDED_MEANWHILE: 'Somebody decided about this correction at the same moment. Look at it again.',
};

export function refusalOf(error: unknown): Refusal {
  const connect = ConnectError.from(error);
  const info = connect.findDetails(ErrorInfoSchema)[0];
  const parts = connect.findDetails(RefusalSchema).flatMap((refusal) => refusal.violations);
  const fields = connect.findDetails(BadRequestSchema).flatMap((bad) => bad.fieldViolations);
  const reason = info?.reason ?? Code[connect.code] ?? '';
  const waitS = info?.metadata['wait_s'];
  const isNetwork = error instanceof TypeError;  // fetch has no other word for it
  const slowed = reason === 'SIGN_IN_SLOWED' && waitS ? `Too many sign-ins failed. Wait ${waitS} seconds.` : undefined;
  return {
    title: isNetwork ? 'The gateway is away' : (kTitles[connect.code] ?? 'Something went wrong in the plant'),
    text: slowed ?? kReasons[reason] ?? (isNetwork ? 'The page tries again by itself.' : connect.rawMessage),
    reason,
    isAway: isNetwork || connect.code === Code.Unavailable || connect.code === Code.DeadlineExceeded,
    violations: parts.length > 0
      ? parts.map(({ field, value, wanted }) => ({ field, value, wanted }))
      : fields.map(({ field, description }) => ({ field, value: '', wanted: description })),
  };
}

// Of an answer that did not come through a Connect client: {"code", "message", "details"}.
export async function refusalFromJson(response: Response): Promise<ConnectError> {
  try {
    const json = (await response.json()) as { code?: string; message?: string; details?: { type: string; value: string }[] };
    const words = (json.code ?? 'unknown').split('_').map((word) => word[0]!.toUpperCase() + word.slice(1)).join('');
    const code = (Code as unknown as Record<string, Code>)[words] ?? Code.Unknown;
    const error = new ConnectError(json.message ?? '', code);
    for (const detail of json.details ?? []) {
      const value = Uint8Array.from(atob(detail.value), (letter) => letter.charCodeAt(0));
      error.details.push({ type: detail.type, value });
    }
    return error;
  } catch {
    return new ConnectError(`The gateway answered ${response.status}.`, response.status >= 500 ? Code.Unavailable : Code.Unknown);
  }
}

// Who may call what, by the rule that each method has in the contract: the page shows no button that would be refused.
import { getOption, type DescMethod } from '@bufbuild/protobuf';
import { Role, rule } from '#proto/sixpoint/access/v1/access_pb';
import { useCell } from './cell';
import { sessionState } from './session';

export function mayCall(roles: string[], method: DescMethod): boolean {
  const allowed = getOption(method, rule).roles.map((role) => Role[role]);
  return roles.some((role) => allowed.includes(role));
}

export function useMay(method: DescMethod): boolean {
  const state = useCell(sessionState);
  return state.is === 'in' && mayCall(state.session.roles, method);
}

// Resource names: kind/id@revision.
export const idOf = (name: string): string => name.slice(name.indexOf('/') + 1);
export const withoutRevision = (name: string): string => name.replace(/@\d+$/, '');
export const kindOf = (name: string): string => name.slice(0, name.indexOf('/'));

// A UUID's head tells one from another on a page; the whole stands in its title.
export function shortId(name: string): string {
  const id = idOf(name);
  return /^[0-9a-f]{8}-[0-9a-f]{4}-/.test(id) ? id.slice(-8) : id;
}

// The page of a thing, where it has one.
export function pageOf(name: string): string | undefined {
  const id = encodeURIComponent(idOf(withoutRevision(name)));
  switch (kindOf(name)) {
    case 'blades': case 'calibrations': case 'corrections': case 'registrations': case 'machines': return `/${kindOf(name)}/${id}`;
    case 'parts': return `/parts/${id}${/@\d+$/.test(name) ? `?revision=${name.slice(name.lastIndexOf('@') + 1)}` : ''}`;
    default: return undefined;
  }
}

// users/jane via services/gateway -> jane; machines/m1 -> m1
export const personOf = (requestedBy: string): string => {
  const who = requestedBy.replace(/ via services\/gateway$/, '');
  return /^(users|machines)\//.test(who) ? idOf(who) : who;
};

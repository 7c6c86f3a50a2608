// Whether gateway and services answer: what the notice on every page says, and what pages ask again by.
import { Cell } from './cell';
import { route } from './route';

export type Reach = { away: false } | { away: true; what: string; since: Date };

export const reach = new Cell<Reach>({ away: false });

// Grows each time that something which was away answers again: pages then load anew.
export const recoveries = new Cell(0);

const kServices: Record<string, string> = {
  plant: 'the plant service', ingest: 'the scan service', calibration: 'the calibration service',
  registration: 'the registration service', correction: 'the correction service', inspection: 'the inspection service',
};

// By area, so that an answer of one service does not hide that another is away.
const away = new Map<string, Date>();

function say(): void {
  const first = [...away.entries()].sort((a, b) => a[1].getTime() - b[1].getTime())[0];
  if (!first) {
    reach.set({ away: false });
    return;
  }
  const names = away.has('gateway') ? ['the gateway'] : [...away.keys()].map((area) => kServices[area] ?? area);
  reach.set({ away: true, what: names.join(' and '), since: first[1] });
}

export function noteAway(area: string): void {
  if (!away.has(area)) away.set(area, new Date());
  say();
}

export function noteAnswer(area: string): void {
  const wasAway = away.delete(area);
  const gatewayWas = away.delete('gateway');
  if (!wasAway && !gatewayWas) return;
  say();
  recoveries.set(recoveries.value + 1);
}

// Where one goes elsewhere, nobody may ask that service any more, and nothing would say that it is back. All pages follow the plant's events.
let path = route.value.path;
route.listen((now) => {
  if (now.path === path) return;
  path = now.path;
  for (const area of [...away.keys()]) if (area !== 'gateway' && area !== 'plant') away.delete(area);
  say();
});

// sixpoint.plant.v1.FleetService -> plant
export const areaOf = (service: string): string => service.split('.')[1] ?? service;

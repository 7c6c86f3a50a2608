// One clock for all that says how long ago something was.
import { Cell, useCell } from '../plant/cell';

const now = new Cell(new Date());
setInterval(() => { if (document.visibilityState === 'visible') now.set(new Date()); }, 5000);
export const useNow = (): Date => useCell(now);

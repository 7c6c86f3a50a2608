// A start's budget by draws beside the first order: whether a sum of squares is enough for it (GUM Supplement 1).
import { useEffect, useRef, useState } from 'preact/hooks';
import { CorrectionService, type Budget, type BudgetLine } from '#proto/sixpoint/correction/v1/correction_pb';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { refusalOf, type Refusal } from '../plant/refusal';
import { Refused } from '../view/states';
import { Table, type Column } from '../view/table';
import { count, number, percent, quantity } from '../words/quantity';

const kColumns: Column<BudgetLine>[] = [
  { head: 'Source', cell: (line) => line.source, csv: (line) => line.source },
  { head: 'First order', unit: 'µm', isNumber: true, cell: (line) => number(line.standardUncertaintyUm, 2), csv: (line) => line.standardUncertaintyUm },
  { head: 'By draws', unit: 'µm', isNumber: true, cell: (line) => (line.drawnStandardUncertaintyUm === undefined ? 'not drawn' : number(line.drawnStandardUncertaintyUm, 2)), csv: (line) => line.drawnStandardUncertaintyUm },
  { head: 'Share', isNumber: true, cell: (line) => percent(line.share), csv: (line) => line.share },
];

// Drawn when asked for, once for all holes of the correction.
export function DrawnBudget({ correction, group, hole }: { correction: string; group: string; hole: string }) {
  const may = useMay(CorrectionService.method.computeBudget);
  const [budget, setBudget] = useState<Budget>();
  const [refusal, setRefusal] = useState<Refusal>();
  const [isBusy, setBusy] = useState(false);
  const asked = useRef('');
  useEffect(() => { asked.current = correction; setBudget(undefined); setRefusal(undefined); setBusy(false); }, [correction]);
  if (!may) return null;
  const draw = async () => {
    setBusy(true);
    setRefusal(undefined);
    try {
      const drawn = await client(CorrectionService).computeBudget({ name: correction });
      if (asked.current === correction) setBudget(drawn);
    } catch (error) {
      if (asked.current === correction) setRefusal(refusalOf(error));
    } finally {
      if (asked.current === correction) setBusy(false);
    }
  };
  const of = budget?.holes.find((one) => one.group === group && one.hole === hole);
  return (
    <>
      {!budget && <button type="button" class="no-print" disabled={isBusy} onClick={() => void draw()}>{isBusy ? 'Drawing…' : 'Check it by draws'}</button>}
      {refusal && <Refused refusal={refusal} />}
      {budget && !of && <p class="muted">No budget of this hole was drawn.</p>}
      {budget && of && <>
        <p>U = {quantity(of.expandedUncertaintyUm, 'µm', 2)} by first order; {of.drawnExpandedUncertaintyUm === undefined ? 'a path of the tool is not drawn' :
          <>{quantity(of.drawnExpandedUncertaintyUm, 'µm', 2)} by {count(budget.draws)} draws, {number(of.drawnLowUm, 2)} to {quantity(of.drawnHighUm, 'µm', 2)} with 95&#8239;%</>}.
          <span class="muted"> The drawing allows {quantity(of.positionToleranceUm, 'µm', 0)}.</span></p>
        <Table caption="Sources, k = 1" columns={kColumns} rows={of.lines} rowKey={(line) => line.source} />
      </>}
    </>
  );
}

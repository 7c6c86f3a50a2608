// A table that copies as CSV: full figures there, rounded ones here.
import type { ComponentChildren } from 'preact';
import { useState } from 'preact/hooks';

export type Column<Row> = {
  head: string;
  unit?: string;
  isNumber?: boolean;
  cell: (row: Row) => ComponentChildren;
  csv: (row: Row) => string | number | bigint | undefined;
};

export function csvOf<Row>(columns: Column<Row>[], rows: Row[]): string {
  const quoted = (value: string | number | bigint | undefined) => {
    const text = value === undefined ? '' : String(value);
    // A spreadsheet would run what begins so; numbers may begin with a minus.
    const safe = typeof value === 'string' && /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
    return /[",\n\r]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
  };
  const heads = columns.map((column) => quoted(column.unit ? `${column.head} [${column.unit}]` : column.head));
  return [heads.join(','), ...rows.map((row) => columns.map((column) => quoted(column.csv(row))).join(','))].join('\r\n') + '\r\n';
}

export async function copyText(text: string): Promise<void> {
  if (navigator.clipboard && window.isSecureContext) return navigator.clipboard.writeText(text);
  const area = document.createElement('textarea');  // a plant's page over plain http has no clipboard otherwise
  area.value = text;
  document.body.append(area);
  area.select();
  document.execCommand('copy');
  area.remove();
}

export function CopyCsv<Row>({ columns, rows, what }: { columns: Column<Row>[]; rows: Row[]; what: string }) {
  const [said, setSaid] = useState('');
  const copy = () => copyText(csvOf(columns, rows)).then(() => setSaid('Copied'), () => setSaid('The browser did not let it copy'));
  return (
    <span class="copy no-print">
      <button type="button" class="quiet" aria-label={`Copy as CSV: ${what}`}
        onClick={() => { void copy(); setTimeout(() => setSaid(''), 2500); }}>Copy as CSV</button>
      <span role="status" class="small muted">{said}</span>
    </span>
  );
}

export function Table<Row>({ caption, columns, rows, rowKey, onPick, picked, showCaption = true, isCopied = true, copied, copiedColumns }: {
  caption: string; columns: Column<Row>[]; rows: Row[]; rowKey: (row: Row) => string;
  onPick?: (row: Row) => void; picked?: string | undefined; showCaption?: boolean; isCopied?: boolean;
  copied?: Row[];  // where not all rows are shown
  copiedColumns?: Column<Row>[];  // where more is copied than shown
}) {
  return (
    <div class="table-box">
      {(showCaption || isCopied) && <div class="table-head">{showCaption && <h2>{caption}</h2>}{isCopied && <CopyCsv columns={copiedColumns ?? columns} rows={copied ?? rows} what={caption} />}</div>}
      <div class="table-scroll" tabIndex={0} role="region" aria-label={`Table: ${caption}`}>
        <table>
          <caption class="hidden">{caption}</caption>
          <thead><tr>{columns.map((column) => (
            <th key={column.head} scope="col" class={column.isNumber ? 'num' : ''}>{column.head}{column.unit && <span class="unit"> {column.unit}</span>}</th>
          ))}</tr></thead>
          <tbody>{rows.map((row) => {
            const key = rowKey(row);
            return (
              <tr key={key} class={picked === key ? 'picked' : ''}>{columns.map((column, i) => (
                <td key={column.head} class={column.isNumber ? 'num' : ''}>
                  {i === 0 && onPick
                    ? <button type="button" class="link" aria-pressed={picked === key} onClick={() => onPick(row)}>{column.cell(row)}</button>
                    : column.cell(row)}
                </td>
              ))}</tr>
            );
          })}</tbody>
        </table>
      </div>
    </div>
  );
}

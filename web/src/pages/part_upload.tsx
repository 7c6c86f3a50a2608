// A CAD file that becomes a part's next revision, described as the one before or by a file; or a new part. The plant reads it in a limited worker.
import { useLayoutEffect, useId, useRef, useState } from 'preact/hooks';
import { fromJson, type JsonValue } from '@bufbuild/protobuf';
import { CadFormat, PartSchema, type Part } from '#proto/sixpoint/plant/v1/part_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { newRequestId } from '../plant/request_id';
import { refusalOf, type Refusal } from '../plant/refusal';
import { go } from '../plant/route';
import { idOf, withoutRevision } from '../words/name';
import { descriptionOf, formatOf } from './part_description';

const kMostBytes = 48 * 1024 * 1024;  // plant.v1.CreatePartRequest.cad

class NotSent extends Error {}

async function describedBy(file: File): Promise<Part> {
  try {
    return descriptionOf(fromJson(PartSchema, JSON.parse(await file.text()) as JsonValue));
  } catch (error) {
    throw new NotSent(`The description is no Part in JSON: ${error instanceof Error ? error.message : String(error)}`);
  }
}

export function UploadPart({ part }: { part: Part | undefined }) {
  const may = useMay(PlantService.method.createPart);
  const [isOpen, setOpen] = useState(false), [isBusy, setBusy] = useState(false), [byFile, setByFile] = useState(!part), [format, setFormat] = useState<CadFormat>();
  const [refusal, setRefusal] = useState<Refusal>(), [problem, setProblem] = useState('');
  const dialog = useRef<HTMLDialogElement>(null), cad = useRef<HTMLInputElement>(null), description = useRef<HTMLInputElement>(null), newId = useRef<HTMLInputElement>(null), unit = useRef<HTMLSelectElement>(null);
  const requestId = useRef(''), title = useId();
  // Before anything can be chosen in it.
  useLayoutEffect(() => { if (isOpen) { requestId.current = newRequestId(); setRefusal(undefined); setProblem(''); setFormat(undefined); dialog.current!.showModal(); } }, [isOpen]);
  if (!may) return null;
  const send = async (event: Event) => {
    event.preventDefault();
    setBusy(true);
    setRefusal(undefined);
    setProblem('');
    try {
      const file = cad.current!.files![0]!, of = formatOf(file.name);
      if (of === undefined) throw new NotSent('CAD files end in .step, .stp, .iges, .igs or .stl.');
      if (file.size > kMostBytes) throw new NotSent(`The file has ${(file.size / 1024 / 1024).toFixed(1)} MiB; at most 48 are taken.`);
      const described = byFile ? await describedBy(description.current!.files![0]!) : descriptionOf(part!);
      described.cadFormat = of;
      described.cadUnitMm = of === CadFormat.STL ? Number(unit.current!.value) : 0;
      const made = await client(PlantService).createPart({ partId: part ? idOf(withoutRevision(part.name)) : newId.current!.value.trim(), part: described, cad: new Uint8Array(await file.arrayBuffer()), requestId: requestId.current });
      setOpen(false);
      go(`/parts/${encodeURIComponent(idOf(withoutRevision(made.name)))}?revision=${made.revision}${made.revision > 1 ? `&against=${made.revision - 1}` : ''}`);
    } catch (error) {
      if (error instanceof NotSent) setProblem(error.message);
      else setRefusal(refusalOf(error));
    } finally {
      setBusy(false);
    }
  };
  return (
    <span class="no-print">
      <button type="button" onClick={() => setOpen(true)}>{part ? 'New revision…' : 'New part…'}</button>
      {isOpen && <dialog ref={dialog} aria-labelledby={title} onClose={() => setOpen(false)}>
        <form onSubmit={(event) => void send(event)}>
          <h2 id={title}>{part ? `A new revision of ${idOf(withoutRevision(part.name))}` : 'A new part'}</h2>
          {!part && <label>Its id <input ref={newId} required maxLength={64} pattern="[A-Za-z0-9_\-][A-Za-z0-9._\-]*" placeholder="vane-8" spellcheck={false} autocomplete="off" /></label>}
          <label>CAD file <input ref={cad} type="file" required accept=".step,.stp,.p21,.iges,.igs,.stl" onChange={(event) => setFormat(formatOf(event.currentTarget.files?.[0]?.name ?? ''))} /> <span class="small muted">STEP, IGES or STL, at most 48 MiB</span></label>
          {format === CadFormat.STL && <label>Unit of the file’s numbers <select ref={unit}><option value="1">mm</option><option value="10">cm</option><option value="1000">m</option><option value="25.4">inch</option></select></label>}
          {part && <label><input type="checkbox" checked={byFile} onChange={(event) => setByFile(event.currentTarget.checked)} /> Its holes, datum points and nominal pose change too</label>}
          {byFile ? <label>Description <input ref={description} type="file" required accept=".json,application/json" /> <span class="small muted">a plant.v1.Part in JSON: hole groups, datum points, nominal pose. From YAML: <code>sixpoint part add FILE</code></span></label>
            : <p class="small muted">Holes, datum points and nominal pose stay as revision {part!.revision} has them.</p>}
          <div role="alert">{problem && <p class="problem">{problem}</p>}{refusal && <p class="problem"><strong>{refusal.title}.</strong> {refusal.text}</p>}</div>
          <div class="buttons"><button type="button" onClick={() => setOpen(false)}>Leave it</button>
            <button type="submit" class="main" disabled={isBusy}>{isBusy ? 'The plant reads it…' : 'Send'}</button></div>
        </form>
      </dialog>}
    </span>
  );
}

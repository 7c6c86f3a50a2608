// A button that changes something for good: asks why first, sends once, and says what was refused.
import type { ComponentChildren } from 'preact';
import { useEffect, useId, useRef, useState } from 'preact/hooks';
import { refusalOf, type Refusal } from '../plant/refusal';
import { newRequestId } from '../plant/request_id';

export function AskWhy({ button, title, verb, children, isMain, reason: asks = 'required', act }: {
  button: string; title: string; verb: string; children: ComponentChildren; isMain?: boolean; reason?: 'required' | 'optional' | 'none';
  act: (reason: string, requestId: string) => Promise<void>;
}) {
  const dialog = useRef<HTMLDialogElement>(null), reason = useRef<HTMLTextAreaElement>(null);
  const [refusal, setRefusal] = useState<Refusal>();
  const [isOpen, setOpen] = useState(false);
  const [isBusy, setBusy] = useState(false);
  const requestId = useRef('');  // the same for a retry: what was decided is decided once
  const id = useId();
  const open = () => {
    setRefusal(undefined);
    requestId.current = newRequestId();
    setOpen(true);
  };
  useEffect(() => { if (isOpen) dialog.current!.showModal(); }, [isOpen]);
  const send = async (event: Event) => {
    event.preventDefault();
    setBusy(true);
    setRefusal(undefined);
    try {
      await act(reason.current?.value.trim() ?? '', requestId.current);
      setOpen(false);
    } catch (error) {
      setRefusal(refusalOf(error));
    } finally {
      setBusy(false);
    }
  };
  return (
    <>
      <button type="button" class={isMain ? 'main' : ''} onClick={open}>{button}</button>
      {isOpen && <dialog ref={dialog} aria-labelledby={id} onClose={() => setOpen(false)}>
        <form onSubmit={(event) => void send(event)}>
          <h2 id={id}>{title}</h2>
          <p>{children}</p>
          {asks !== 'none' && <label>Why{asks === 'optional' && <span class="muted"> (may stay empty)</span>}<textarea ref={reason} required={asks === 'required'} maxLength={1000} /></label>}
          <div role="alert">{refusal && <p class="problem"><strong>{refusal.title}.</strong> {refusal.text}</p>}</div>
          <div class="buttons"><button type="button" onClick={() => setOpen(false)}>Leave it</button>
            <button type="submit" class="main" disabled={isBusy}>{isBusy ? 'Sending…' : verb}</button></div>
        </form>
      </dialog>}
    </>
  );
}

// Signing in. One comes back to where one was: the URL never changed.
import { useEffect, useRef, useState } from 'preact/hooks';
import { refusalOf, type Refusal } from '../plant/refusal';
import { signIn } from '../plant/session';

export function SignIn({ wasIn }: { wasIn: boolean }) {
  const [refusal, setRefusal] = useState<Refusal>();
  const [isBusy, setBusy] = useState(false);
  const name = useRef<HTMLInputElement>(null);
  const password = useRef<HTMLInputElement>(null);
  useEffect(() => { document.title = 'Sign in – Sixpoint'; name.current?.focus(); }, []);

  const submit = async (event: Event) => {
    event.preventDefault();
    setBusy(true);
    setRefusal(undefined);
    try {
      await signIn(name.current!.value.trim(), password.current!.value);
    } catch (error) {
      setRefusal(refusalOf(error));
      setBusy(false);
      password.current!.value = '';
      password.current!.focus();
    }
  };

  return (
    <main class="sign-in">
      <form onSubmit={(event) => void submit(event)} aria-labelledby="sign-in-title">
        <img src="/icon.svg" alt="" width="40" height="40" />
        <h1 id="sign-in-title">Sixpoint</h1>
        <p class="muted">{wasIn ? 'Your session is over. Sign in to go on where you were.' : 'Sign in with your account of this plant.'}</p>
        <label>Name<input ref={name} name="name" autocomplete="username" autocapitalize="none" spellcheck={false} required /></label>
        <label>Password<input ref={password} name="password" type="password" autocomplete="current-password" required /></label>
        <div role="alert">{refusal && <p class="problem"><strong>{refusal.isAway ? refusal.title : 'Not signed in'}.</strong> {refusal.text}</p>}</div>
        <button type="submit" class="main" disabled={isBusy}>{isBusy ? 'Signing in…' : 'Sign in'}</button>
      </form>
    </main>
  );
}

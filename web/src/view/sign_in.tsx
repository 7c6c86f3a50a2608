// Signing in. One comes back to where one was: the URL never changed.
import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks';
import { refusalOf, type Refusal } from '../plant/refusal';
import { setQuery } from '../plant/route';
import { directoryName, signIn, signInByDirectory } from '../plant/session';

// Why one came back from there without a session, by the gateway's word (services/gateway/directory_sign_in.cc): any other says nothing.
const kCameBack: Record<string, (name: string) => string> = {
  again: () => 'That sign-in took longer than 10 minutes, or was begun elsewhere. Begin it again here.',
  declined: (name) => `${name} signed nobody in.`,
  provider: (name) => `${name} is away, or its answer cannot be read. Try again, or sign in by password.`,
  stranger: (name) => `The plant takes nobody in by that: none of your groups at ${name} gives a role here, or your name is another person's. Ask who runs the plant.`,
  wait: () => 'Too many sign-ins failed or are under way. Wait a minute.',
  settings: (name) => `The plant and ${name} are not set up for each other. Ask who runs the plant.`,
  plant: () => 'A service is away. Try again in a minute.',
};

export function SignIn({ wasIn }: { wasIn: boolean }) {
  const [refusal, setRefusal] = useState<Refusal>();
  const [isBusy, setBusy] = useState(false);
  const [directory, setDirectory] = useState<string>();
  const [cameBack] = useState(() => new URLSearchParams(location.search).get('sign_in') ?? '');
  const name = useRef<HTMLInputElement>(null);
  const password = useRef<HTMLInputElement>(null);
  // Before it is on the screen: later it would take the cursor from who types his password already.
  useLayoutEffect(() => { document.title = 'Sign in – Sixpoint'; name.current?.focus(); }, []);

  useEffect(() => { void directoryName().then(setDirectory); }, []);
  // Said once: neither a link nor the way back repeats it.
  useLayoutEffect(() => { if (cameBack !== '') setQuery({ sign_in: '' }); }, []);
  const why = Object.hasOwn(kCameBack, cameBack) ? kCameBack[cameBack]!(directory ?? 'The house\'s sign-in') : undefined;

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
        <div role="alert">
          {refusal ? <p class="problem"><strong>{refusal.isAway ? refusal.title : 'Not signed in'}.</strong> {refusal.text}</p>
            : why && <p class="problem"><strong>Not signed in.</strong> {why}</p>}
        </div>
        <button type="submit" class="main" disabled={isBusy}>{isBusy ? 'Signing in…' : 'Sign in'}</button>
        {directory && <button type="button" onClick={signInByDirectory}>Sign in with {directory}</button>}
      </form>
    </main>
  );
}

// A value that pages look at and are drawn again by when it changes.
import { useEffect, useState } from 'preact/hooks';

export class Cell<T> {
  private readonly listeners = new Set<(value: T) => void>();
  constructor(private current: T) {}

  get value(): T { return this.current; }

  set(value: T): void {
    if (Object.is(value, this.current)) return;
    this.current = value;
    for (const listener of [...this.listeners]) listener(value);
  }

  listen(listener: (value: T) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}

export function useCell<T>(cell: Cell<T>): T {
  const [value, setValue] = useState(cell.value);
  useEffect(() => {
    setValue(cell.value);  // it may have changed between drawing and now
    return cell.listen(setValue);
  }, [cell]);
  return value;
}

// A component that is drawn again only where its properties say so.
import { Component, h, type ComponentChild, type FunctionComponent } from 'preact';

export function memo<P extends object>(of: FunctionComponent<P>, isSame: (before: P, after: P) => boolean): FunctionComponent<P> {
  class Memo extends Component<P> {
    override shouldComponentUpdate(after: Readonly<P>): boolean { return !isSame(this.props as P, after as P); }
    override render(): ComponentChild { return h(of, this.props as P); }
  }
  return Memo as unknown as FunctionComponent<P>;
}

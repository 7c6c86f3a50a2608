import { render } from 'preact';
import { followTheJournal } from './plant/events';
import { keepSessionAlive } from './plant/session';
import { Shell } from './view/shell';
import './view/style.css';

keepSessionAlive();
followTheJournal();
render(<Shell />, document.getElementById('page')!);

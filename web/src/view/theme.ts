// Dark, light, or as the computer is set.
import { Cell } from '../plant/cell';

export type Theme = 'auto' | 'light' | 'dark';
const kKey = 'sixpoint-theme';

const kept = (): Theme => {
  try {
    const value = localStorage.getItem(kKey);
    return value === 'light' || value === 'dark' ? value : 'auto';
  } catch { return 'auto'; }  // storage may be forbidden
};
export const theme = new Cell<Theme>(kept());

const systemIsDark = window.matchMedia('(prefers-color-scheme: dark)');
export const isDark = new Cell(false);

function apply(): void {
  if (theme.value === 'auto') document.documentElement.removeAttribute('data-theme');
  else document.documentElement.setAttribute('data-theme', theme.value);
  isDark.set(theme.value === 'dark' || (theme.value === 'auto' && systemIsDark.matches));
}

theme.listen((value) => {
  try { localStorage.setItem(kKey, value); } catch { /* it holds until the page is left */ }
  apply();
});
systemIsDark.addEventListener('change', apply);
apply();

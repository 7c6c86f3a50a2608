// A drawing in SVG that downloads as PNG, with its title: what is passed on has to say what it shows.
import type { ComponentChildren } from 'preact';
import { useRef } from 'preact/hooks';

const kCopied = ['fill', 'stroke', 'stroke-width', 'stroke-dasharray', 'stroke-linecap', 'opacity', 'font-size', 'font-weight', 'font-family', 'text-anchor', 'dominant-baseline', 'vector-effect'];

export function download(blob: Blob, fileName: string): void {
  const url = URL.createObjectURL(blob), link = document.createElement('a');
  link.href = url;
  link.download = fileName;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

export const fileNameOf = (title: string): string => `${title.replaceAll(/[^A-Za-z0-9._-]+/g, '_').replaceAll(/^_+|_+$/g, '')}.png`;

const blobOf = (canvas: HTMLCanvasElement): Promise<Blob> =>
  new Promise((resolve, reject) => canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('The browser made no picture.'))), 'image/png'));

// Canvases below each other, under a title.
export function sheetOf(canvases: HTMLCanvasElement[], title: string, paper: string, ink: string): Promise<Blob> {
  const scale = window.devicePixelRatio || 1, head = Math.round(30 * scale);
  const sheet = document.createElement('canvas');
  sheet.width = Math.max(1, ...canvases.map((canvas) => canvas.width));
  sheet.height = head + canvases.reduce((sum, canvas) => sum + canvas.height, 0);
  const pen = sheet.getContext('2d')!;
  pen.fillStyle = paper;
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.fillStyle = ink;
  pen.font = `600 ${Math.round(14 * scale)}px system-ui, sans-serif`;
  pen.fillText(title, 8 * scale, 20 * scale);
  let at = head;
  for (const canvas of canvases) { pen.drawImage(canvas, 0, at); at += canvas.height; }
  return blobOf(sheet);
}

async function drawnOf(svg: SVGSVGElement): Promise<HTMLCanvasElement> {
  const copy = svg.cloneNode(true) as SVGSVGElement, from = [svg, ...svg.querySelectorAll('*')], to = [copy, ...copy.querySelectorAll('*')];
  from.forEach((element, i) => {
    const style = getComputedStyle(element);
    for (const name of kCopied) to[i]!.setAttribute(name, style.getPropertyValue(name));
  });
  const box = svg.getBoundingClientRect(), scale = 2;
  copy.setAttribute('xmlns', 'http://www.w3.org/2000/svg');
  copy.setAttribute('width', String(box.width * scale));
  copy.setAttribute('height', String(box.height * scale));
  const url = URL.createObjectURL(new Blob([new XMLSerializer().serializeToString(copy)], { type: 'image/svg+xml' }));
  try {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = document.createElement('canvas');
    canvas.width = box.width * scale; canvas.height = box.height * scale;
    canvas.getContext('2d')!.drawImage(image, 0, 0, canvas.width, canvas.height);
    return canvas;
  } finally {
    URL.revokeObjectURL(url);
  }
}

async function pngOf(place: HTMLElement, title: string): Promise<Blob> {
  const root = getComputedStyle(document.documentElement), canvases: HTMLCanvasElement[] = [];
  // The page's style sheet does not go along with the file, so what it says is written into each drawing's copy.
  for (const svg of place.querySelectorAll('svg')) canvases.push(await drawnOf(svg));
  return sheetOf(canvases, title, root.getPropertyValue('--sheet'), root.getPropertyValue('--ink'));
}

export function Picture({ title, file, children }: { title: string; file: string; children: ComponentChildren }) {
  const place = useRef<HTMLDivElement>(null);
  return (
    <figure class="picture">
      <figcaption class="table-head"><h3>{title}</h3><button type="button" class="quiet no-print" aria-label={`Download PNG: ${title}`}
        onClick={() => { void pngOf(place.current!, file).then((blob) => download(blob, fileNameOf(file))); }}>Download PNG</button></figcaption>
      <div ref={place}>{children}</div>
    </figure>
  );
}

// The scale of deviations' colours, and the sliders that move it.
import { useEffect, useRef } from 'preact/hooks';
import { number, quantity } from '../words/quantity';

type Module = typeof import('../scene/open');

export function Scale({ module, scaleUm, bandUm }: { module: Module; scaleUm: number; bandUm: number }) {
  const strip = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const pen = strip.current!.getContext('2d')!, table = module.colourTable(scaleUm, bandUm);
    pen.putImageData(new ImageData(new Uint8ClampedArray(table), module.kColourCount, 1), 0, 0);
  }, [scaleUm, bandUm]);
  return (
    <div class="scale">
      <canvas ref={strip} width={module.kColourCount} height={1} role="img" aria-label={`Colours from −${scaleUm} µm, inside the CAD, in blue, over grey within ±${bandUm} µm, to +${scaleUm} µm, outside, in red`} />
      <div class="ticks"><span>−{number(scaleUm, 0)}&#8239;µm inside</span><span>±{number(bandUm, bandUm < 10 ? 1 : 0)}&#8239;µm band</span><span>outside +{number(scaleUm, 0)}&#8239;µm</span></div>
    </div>
  );
}

export function ScaleSliders({ scaleUm, bandUm, onChange }: { scaleUm: number; bandUm: number; onChange: (scaleUm: number, bandUm: number) => void }) {
  return (
    <>
      <label>Scale <input type="range" min={0} max={100} value={Math.round((100 * Math.log(scaleUm / 2)) / Math.log(500))} aria-valuetext={`${scaleUm} micrometres`}
        onInput={(event) => { const um = Number((2 * 500 ** (Number(event.currentTarget.value) / 100)).toPrecision(2)); onChange(um, Math.min(bandUm, um)); }} /> {quantity(scaleUm, 'µm', scaleUm < 10 ? 1 : 0)}</label>
      <label>Band <input type="range" min={0} max={100} value={Math.round((100 * bandUm) / scaleUm)} aria-valuetext={`${bandUm} micrometres`}
        onInput={(event) => onChange(scaleUm, Number(((scaleUm * Number(event.currentTarget.value)) / 100).toPrecision(2)))} /> ±{quantity(bandUm, 'µm', bandUm < 10 ? 1 : 0)}</label>
    </>
  );
}

// Tiles of measured patches on the CAD, each in the colour of its figure: dark where there is none.
import { useEffect, useRef, useState } from 'preact/hooks';
import type { Part } from '#proto/sixpoint/plant/v1/part_pb';
import { refusalOf } from '../plant/refusal';
import type { BladeScene } from '../scene/blade_scene';
import { minus } from '../scene/frames';
import type { Patches } from '../scene/tiles';
import { count } from '../words/quantity';
import { download, fileNameOf } from '../view/picture';
import { Scale, ScaleSliders } from './colour_scale';
import { holesOfPart } from './part_scene';

type Module = typeof import('../scene/open');

// What is drawn: name: of the result (and of what is shown of it), title: of its picture, what: the figure, for who cannot see it; note: under the scale.
export type Tiling = { name: string; title: string; what: string; note: string; patchCount: number; patchMm: number; mostUm: number; fetch: (module: Module, signal: AbortSignal) => Promise<Patches>; fetchLaps?: (module: Module, signal: AbortSignal) => Promise<number[][]> };

export function TiledSurface({ tiling, part }: { tiling: Tiling; part: Part }) {
  const canvas = useRef<HTMLCanvasElement>(null), scene = useRef<BladeScene>();
  const [module, setModule] = useState<Module>();
  const [said, setSaid] = useState('Loading the patches…'), [problem, setProblem] = useState('');
  const [scale, setScale] = useState<[number, number]>([50, 10]);
  useEffect(() => {
    const stop = new AbortController();
    let view: BladeScene | undefined;
    const open = async () => {
      const loaded = await import('../scene/open');
      if (stop.signal.aborted) return;
      view = new loaded.BladeScene(canvas.current!);
      const [surface, patches, laps] = await Promise.all([loaded.fetchSurface(`${part.name}@${part.revision}`, stop.signal), tiling.fetch(loaded, stop.signal), tiling.fetchLaps?.(loaded, stop.signal)]);
      scene.current = view;
      view.setSurface(surface);
      view.setHoles(holesOfPart(part).map((hole) => ({ ...hole, nominalMm: minus(hole.nominalMm, surface.centre) })), [], 1, undefined);
      view.setPatches(patches, surface.centre, tiling.patchMm);
      if (laps) view.setLaps(laps, surface.centre);
      const most = loaded.roundScale(tiling.mostUm);
      setScale([most, most / 5]);
      setModule(loaded);
      setSaid('');
    };
    open().catch((error: unknown) => {
      if (stop.signal.aborted) return;
      setSaid('');
      setProblem(error instanceof Error && error.name !== 'ConnectError' ? error.message : refusalOf(error).text);
    });
    return () => { stop.abort(); view?.stop(); scene.current = undefined; };
  }, [tiling.name, part.name, part.revision]);
  useEffect(() => { scene.current?.setScale(...scale); }, [scale, module]);
  return (
    <div>
      <div class="view3d">
        <canvas ref={canvas} tabIndex={0} role="img" aria-label={`The blade in 3D, ${count(tiling.patchCount)} patches coloured by ${tiling.what}. Arrow keys turn it, plus and minus come nearer and go away, Home shows all. The same in figures: the table of regions.`} />
        {(said || problem) && <div class="over" role="status">{problem ? <span class="tone-bad">{problem}</span> : said}</div>}
      </div>
      <div class="view-tools no-print">
        <button type="button" class="quiet" onClick={() => scene.current?.home()}>Show all</button>
        <button type="button" class="quiet" disabled={!module} aria-label={`Download PNG: ${tiling.title}`} onClick={() => { void scene.current!.picture(tiling.title, scale[1]).then((blob) => download(blob, fileNameOf(tiling.title))); }}>Download PNG</button>
      </div>
      {module && <div class="sheet scale-box"><Scale module={module} scaleUm={scale[0]} bandUm={scale[1]} />
        <div class="view-tools no-print"><ScaleSliders scaleUm={scale[0]} bandUm={scale[1]} onChange={(s, b) => setScale([s, b])} /></div>
        <p class="small muted">{tiling.note}</p></div>}
    </div>
  );
}

// The blade in 3D, with what one may turn on, and the colours' scale.
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { ScanService } from '#proto/sixpoint/ingest/v1/ingest_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { Verdict } from '#proto/sixpoint/inspection/v1/inspection_pb';
import { useMay } from '../plant/may';
import { refusalOf } from '../plant/refusal';
import { count, number, plural, quantity } from '../words/quantity';
import { directionOf, minus, vectorOf } from '../scene/frames';
import type { BladeScene, DrawnHole, DrawnPath, Shows, Which } from '../scene/blade_scene';
import type { Surface } from '../scene/surface';
import type { BladeFacts, HoleFacts } from './blade_facts';
import { Scale, ScaleSliders } from './colour_scale';

type Module = typeof import('../scene/open');
type Cloudy = { drawn: number; isWhole: boolean; rmsUm: number; p05Um: number; p95Um: number } | undefined;

const kTones: Record<Verdict, DrawnHole['tone']> = {
  [Verdict.UNSPECIFIED]: 'none', [Verdict.CONFORM]: 'good', [Verdict.NOT_CONFORM]: 'bad', [Verdict.UNDECIDABLE]: 'unsure', [Verdict.NOT_MEASURED]: 'none',
};

function drawnOf(holes: HoleFacts[], surface: Surface): DrawnHole[] {
  return holes.flatMap(({ key, group, hole, result, withoutCorrection }) => {
    if (!group || !hole) return [];
    return [{
      key, radiusMm: group.diameterMm / 2, normal: directionOf(hole.normalInPart), tone: kTones[result?.verdict ?? Verdict.UNSPECIFIED],
      nominalMm: minus(vectorOf(hole.startInPartMm), surface.centre),
      withoutCorrectionMm: withoutCorrection && minus(withoutCorrection, surface.centre),
      asCutMm: result?.startInPartMm && minus(vectorOf(result.startInPartMm), surface.centre),
    }];
  });
}

const pathsOf = (holes: HoleFacts[], surface: Surface): DrawnPath[] => holes.filter(({ path }) => path.length > 0)
  .map(({ key, path }) => ({ key, poses: path.map(({ tip, axis }) => ({ tipMm: minus(tip, surface.centre), axis })) }));

export function BladeView({ facts, holes, picked, onPick }: { facts: BladeFacts; holes: HoleFacts[]; picked: string | undefined; onPick: (key: string) => void }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [module, setModule] = useState<Module>();
  const scene = useRef<BladeScene>();
  const [surface, setSurface] = useState<Surface>();
  const [clouds, setClouds] = useState<Partial<Record<Which, Cloudy>>>({});
  const [said, setSaid] = useState('Loading the picture…');
  const [problem, setProblem] = useState('');
  const [progress, setProgress] = useState<number>();
  const [shows, setShows] = useState<Shows>({ cad: true, before: !facts.after, after: true, holes: true, datums: true });
  const [scaleUm, setScaleUm] = useState(50);
  const [bandUm, setBandUm] = useState(10);
  const [magnification, setMagnification] = useState(100);
  const paper = useRef<HTMLCanvasElement>(null);
  const wholeAsked = useRef<(() => Promise<void>) | undefined>();
  const maySurface = useMay(PlantService.method.downloadSurface), mayPoints = useMay(ScanService.method.previewScan), mayWhole = useMay(ScanService.method.downloadScan);
  const name = facts.blade.name;

  // By name: what events change of the blade does not fetch its points again.
  const wanted = `${facts.before?.name ?? ''} ${facts.after?.name ?? ''} ${facts.part?.name ?? ''}@${facts.part?.revision ?? ''}`;
  useEffect(() => {
    if (!maySurface || !facts.part) return;
    const stop = new AbortController();
    let opened: BladeScene | undefined, workers: import('../scene/cloud').CloudWorkers | undefined;
    const open = async () => {
      const loaded = await import('../scene/open');
      if (stop.signal.aborted) return;
      const view = new loaded.BladeScene(canvas.current!);
      opened = view;
      scene.current = view;
      setModule(loaded);
      setSaid('Loading the CAD…');
      const fetched = await loaded.fetchSurface(`${facts.part!.name}@${facts.part!.revision}`, stop.signal);
      view.setSurface(fetched);
      view.setDatums(facts.part!.sixPoints.map((datum) => ({ name: datum.datum, pointMm: minus(vectorOf(datum.pointInPartMm), fetched.centre), normal: directionOf(datum.normalInPart) })));
      setSurface(fetched);
      if (!mayPoints) { setSaid(''); return; }
      setSaid('Loading points…');
      const crew = (workers = new loaded.CloudWorkers(fetched));
      const registrations = (['after', 'before'] as const).flatMap((which) => (facts[which]?.zeroFromPart ? [{ which, registration: facts[which]! }] : []));
      const previews = await Promise.all(registrations.map(async ({ which, registration }) => {
        const preview = await loaded.fetchPreview(facts, registration, crew, stop.signal);
        take(which, preview.cloud, false);
        return { which, registration, scans: preview.scans };
      }));
      setSaid('');
      function take(which: Which, cloud: import('../scene/cloud').Cloud, isWhole: boolean): void {
        view.setCloud(which, cloud);
        const statistics = loaded.statisticsOf(cloud);
        setClouds((old) => ({ ...old, [which]: statistics && { drawn: cloud.count, isWhole, ...statistics } }));
        if (statistics && !isWhole && (which === 'after' || !facts.after)) {
          const scale = loaded.roundScale(Math.max(Math.abs(statistics.p05Um), Math.abs(statistics.p95Um)) * 1.25);
          setScaleUm(scale);
          setBandUm(scale / 5);
        }
      }
      if (mayWhole) {
        wholeAsked.current = async () => {
          wholeAsked.current = undefined;
          setProgress(0);
          const total = previews.length;
          for (const [i, { which, registration, scans }] of previews.entries()) {
            const whole = await loaded.fetchWhole(facts, registration, scans, crew, stop.signal, (share) => setProgress((i + share) / total));
            take(which, whole.cloud, true);
          }
          setProgress(undefined);
        };
      }
    };
    open().catch((error: unknown) => {
      if (stop.signal.aborted) return;
      setSaid('');
      setProblem(error instanceof Error && error.name !== 'ConnectError' ? error.message : refusalOf(error).text);
    });
    return () => { stop.abort(); workers?.stop(); opened?.stop(); scene.current = undefined; setSurface(undefined); setClouds({}); };
  }, [wanted, maySurface]);

  const drawn = useMemo(() => (surface ? drawnOf(holes, surface) : []), [holes, surface]);
  const paths = useMemo(() => (surface ? pathsOf(holes, surface) : []), [holes, surface]);
  useEffect(() => { scene.current?.setHoles(drawn, paths, magnification, picked); if (scene.current) scene.current.onPick = onPick; }, [drawn, paths, magnification, picked]);
  useEffect(() => { const hole = drawn.find((one) => one.key === picked); if (hole) scene.current?.lookAt(hole); }, [picked]);
  useEffect(() => { scene.current?.setScale(scaleUm, bandUm); }, [scaleUm, bandUm, module, clouds]);
  useEffect(() => { scene.current?.setShows(shows); }, [shows, surface, clouds]);
  useEffect(() => {
    const before = () => { if (scene.current && paper.current) scene.current.drawInto(paper.current); };
    window.addEventListener('beforeprint', before);
    return () => window.removeEventListener('beforeprint', before);
  }, []);

  if (!maySurface) return <div class="sheet muted">The blade's shape is shown to engineers and quality.</div>;
  if (!facts.part) return <div class="sheet muted">The part's record is not there: the blade cannot be drawn.</div>;
  const box = (key: keyof Shows, text: string, has = true) => (
    <label key={key}><input type="checkbox" checked={shows[key] && has} disabled={!has} onChange={(event) => setShows({ ...shows, [key]: event.currentTarget.checked })} />{text}</label>
  );
  const download = async () => {
    const url = URL.createObjectURL(await scene.current!.picture(`${name}, ${facts.part!.name}@${facts.part!.revision}`, bandUm));
    const link = document.createElement('a');
    link.href = url;
    link.download = `${name.replace('/', '_')}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  };
  const main = clouds.after ?? clouds.before;
  const points = (Object.values(clouds) as Cloudy[]).reduce((sum, one) => sum + (one?.drawn ?? 0), 0);

  return (
    <div>
      <div class="view3d">
        <canvas ref={canvas} tabIndex={0} role="img" aria-label={`The blade in 3D: CAD, ${count(points)} measured points coloured by deviation, ${drawn.length} holes, ${paths.length > 0 ? `${plural(paths.length, 'path')} of the tool, ` : ''}six datum points. Arrow keys turn it, plus and minus come nearer and go away, Home shows all. The same in figures: the table of holes.`} />
        {(said || problem || progress !== undefined) && <div class="over" role="status">{problem ? <span class="tone-bad">{problem}</span> : progress !== undefined ? `Loading all points: ${Math.round(100 * progress)} %` : said}</div>}
      </div>
      <canvas ref={paper} class="print-only view-printed" hidden role="img" aria-label="The blade with the deviations of its points" />
      <div class="view-tools no-print">
        {box('cad', 'CAD')}
        {box('before', clouds.after ? 'Before cutting' : 'Points', clouds.before !== undefined)}
        {box('after', 'As cut', clouds.after !== undefined)}
        {box('holes', paths.length > 0 ? 'Holes and paths' : 'Holes')}{box('datums', 'Datum points', facts.part.sixPoints.length > 0)}
        <button type="button" class="quiet" onClick={() => scene.current?.home()}>Show all</button>
        {wholeAsked.current && <button type="button" class="quiet" onClick={() => { void wholeAsked.current?.().catch((error: unknown) => { setProgress(undefined); setProblem(error instanceof Error ? error.message : String(error)); }); }}>Every point</button>}
        <button type="button" class="quiet" disabled={!surface} onClick={() => void download()}>Download PNG</button>
      </div>
      {module && (
        <div class="sheet scale-box">
          <Scale module={module} scaleUm={scaleUm} bandUm={bandUm} />
          <div class="view-tools no-print">
            <ScaleSliders scaleUm={scaleUm} bandUm={bandUm} onChange={(scale, band) => { setScaleUm(scale); setBandUm(band); }} />
            <label>Arrows <input type="range" min={0} max={100} value={Math.round(100 * Math.log10(magnification) / 3)} aria-valuetext={`magnified ${magnification} times`}
              onInput={(event) => setMagnification(Number((10 ** ((3 * Number(event.currentTarget.value)) / 100)).toPrecision(2)))} /> ×{magnification}</label>
          </div>
          <p class="small muted">Coloured arrows: from the drawn start to the start as cut, ×{magnification}. Grey arrows, true to scale: from where the nominal program would have cut.{paths.length > 0 && ' Blue lines: the tip’s way along a path, with the tool’s direction.'} Violet points: off by 1&#8239;mm or more, set aside.
            {main && <> Points{main.isWhole ? '' : ', thinned'}: {count(main.drawn)}; rms {quantity(main.rmsUm, 'µm', 1)}, 5 to 95&#8239;% {number(main.p05Um, 1)} to {quantity(main.p95Um, 'µm', 1)}, measured here by the page for its colours.</>}</p>
        </div>
      )}
    </div>
  );
}

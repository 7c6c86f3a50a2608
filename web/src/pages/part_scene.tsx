// A part's surface in 3D with its holes, datum points and what a page marks on it: without scans.
import { useEffect, useRef, useState } from 'preact/hooks';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import type { Part } from '#proto/sixpoint/plant/v1/part_pb';
import { useMay } from '../plant/may';
import { refusalOf } from '../plant/refusal';
import { directionOf, minus, plus, vectorOf, type Vector } from '../scene/frames';
import type { BladeScene, DrawnArrow, DrawnEllipsoid, DrawnHole, DrawnMark } from '../scene/blade_scene';
import type { Surface } from '../scene/surface';
import { download, fileNameOf } from '../view/picture';

export type SceneModule = typeof import('../scene/open');
// Places in the part frame; the scene draws about the surface's centre.
export type Drawn = { marks?: DrawnMark[]; arrows?: DrawnArrow[]; ellipsoid?: DrawnEllipsoid | undefined };

const kMostHoles = 2000;  // each is a ring and a target

export const holesOfPart = (part: Part): DrawnHole[] => part.holeGroups.flatMap((group) => group.holes.map((hole) => ({
  key: `${group.group}/${hole.hole}`, nominalMm: vectorOf(hole.startInPartMm), normal: directionOf(hole.normalInPart), radiusMm: group.diameterMm / 2, withoutCorrectionMm: undefined, asCutMm: undefined, tone: 'none' as const,
})));

export function PartScene({ part, title, label, drawn, picked, onPick, markWord }: {
  part: Part; title: string; label: string; markWord?: string; picked?: string | undefined; onPick?: (key: string) => void;
  drawn?: (module: SceneModule, surface: Surface) => Drawn;
}) {
  const canvas = useRef<HTMLCanvasElement>(null), scene = useRef<BladeScene>();
  const [opened, setOpened] = useState<{ module: SceneModule; surface: Surface }>();
  const [said, setSaid] = useState('Loading the CAD…'), [problem, setProblem] = useState('');
  const [shows, setShows] = useState({ cad: true, before: false, after: false, holes: true, datums: true, marks: true });
  const may = useMay(PlantService.method.downloadSurface), name = `${part.name}@${part.revision}`;

  useEffect(() => {
    if (!may) return;
    const stop = new AbortController();
    let view: BladeScene | undefined;
    const open = async () => {
      const module = await import('../scene/open');
      if (stop.signal.aborted) return;
      view = new module.BladeScene(canvas.current!);
      scene.current = view;
      const surface = await module.fetchSurface(name, stop.signal);
      view.setSurface(surface);
      view.setDatums(part.sixPoints.map((datum) => ({ name: datum.datum, pointMm: minus(vectorOf(datum.pointInPartMm), surface.centre), normal: directionOf(datum.normalInPart) })));
      setSaid('');
      setOpened({ module, surface });
    };
    setSaid('Loading the CAD…');
    setProblem('');
    open().catch((error: unknown) => {
      if (stop.signal.aborted) return;
      setSaid('');
      setProblem(error instanceof Error && error.name !== 'ConnectError' ? error.message : refusalOf(error).text);
    });
    return () => { stop.abort(); view?.stop(); scene.current = undefined; setOpened(undefined); };
  }, [name, may]);
  useEffect(() => {
    if (!opened || !scene.current) return;
    const about = (at: Vector) => minus(at, opened.surface.centre);
    scene.current.setHoles(holesOfPart(part).slice(0, kMostHoles).map((hole) => ({ ...hole, nominalMm: about(hole.nominalMm) })), [], 1, picked);
    const more = drawn?.(opened.module, opened.surface) ?? {};
    scene.current.setMarks((more.marks ?? []).map((mark) => ({ ...mark, pointMm: about(mark.pointMm) })), (more.arrows ?? []).map((arrow) => ({ ...arrow, fromMm: about(arrow.fromMm), toMm: about(arrow.toMm) })),
      more.ellipsoid && { ...more.ellipsoid, centreMm: about(more.ellipsoid.centreMm) }, picked);
    scene.current.onPick = (key) => onPick?.(key);
    canvas.current!.dataset['holes'] = String(part.holeGroups.reduce((sum, group) => sum + group.holes.length, 0));
  }, [opened, picked, drawn]);
  useEffect(() => { scene.current?.setShows(shows); }, [shows, opened]);

  if (!may) return <div class="sheet muted">The part's shape is shown to engineers and quality.</div>;
  const box = (key: 'cad' | 'holes' | 'datums' | 'marks', text: string) => <label><input type="checkbox" checked={shows[key]} onChange={(event) => setShows({ ...shows, [key]: event.currentTarget.checked })} />{text}</label>;
  return (
    <div class="part-scene">
      <div class="view3d">
        <canvas ref={canvas} tabIndex={0} role="img" aria-label={`${label} Arrow keys turn it, plus and minus come nearer and go away, Home shows all.`} />
        {(said || problem) && <div class="over" role="status">{problem ? <span class="tone-bad">{problem}</span> : said}</div>}
      </div>
      <div class="view-tools no-print">
        {box('cad', 'CAD')}{part.holeGroups.length > 0 && box('holes', 'Holes')}{part.sixPoints.length > 0 && box('datums', 'Datum points')}{markWord && box('marks', markWord)}
        <button type="button" class="quiet" onClick={() => scene.current?.home()}>Show all</button>
        <button type="button" class="quiet" disabled={!opened} aria-label="Download PNG of the 3D view" onClick={() => { void scene.current!.picture(title, undefined).then((blob) => download(blob, fileNameOf(title))); }}>Download PNG</button>
      </div>
    </div>
  );
}

export const moved = (at: Vector, by: Vector): Vector => plus(at, by);

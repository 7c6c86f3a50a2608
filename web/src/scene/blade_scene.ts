// The blade drawn: CAD, the cloud with its deviations, holes with arrows, datum points. Draws when something changed, and not else.
import {
  AmbientLight, BufferAttribute, BufferGeometry, ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, Group, LineBasicMaterial, LineLoop, LineSegments, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  PerspectiveCamera, Quaternion, Raycaster, RingGeometry, Scene, SphereGeometry, Sprite, Vector2, Vector3, WebGLRenderer, type Object3D,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { Cloud } from './cloud';
import { cloudPointsFor, type CloudPoints, type Which } from './cloud_points';
import { colourTable, kColourCount, type Colour } from './colours';
import type { Vector } from './frames';
import { fillRoom, lookByKey, wordAt } from './looking';
import type { Surface } from './surface';
import { Tiles, type Patches } from './tiles';

export type DrawnHole = {
  key: string;
  nominalMm: Vector; normal: Vector; radiusMm: number;  // about the surface's centre
  withoutCorrectionMm: Vector | undefined;  // where the nominal program would have cut on this blade
  asCutMm: Vector | undefined;  // unset: not measured
  tone: 'good' | 'bad' | 'unsure' | 'none';
};
// The corrected way of a tool's tip, with its direction from the tip to the holder; about the surface's centre.
export type DrawnPath = { key: string; poses: { tipMm: Vector; axis: Vector }[] };
export type DrawnDatum = { name: string; pointMm: Vector; normal: Vector };
export type Shows = { cad: boolean; before: boolean; after: boolean; holes: boolean; datums: boolean; marks?: boolean };
export type { Which } from './cloud_points';
// What a page shows beside: balls, arrows and an ellipsoid, about the surface's centre.
export type DrawnMark = { key: string; pointMm: Vector; colour: Colour; size: number };  // size: of 1 is the usual one
export type DrawnArrow = { fromMm: Vector; toMm: Vector; colour: Colour };
export type DrawnEllipsoid = { centreMm: Vector; semiAxesMm: [Vector, Vector, Vector]; colour: Colour };

const kRestMs = 160;
const kSmoothMs = 80;  // a frame that takes longer while the view turns is drawn coarser from then on: where no graphics processor is, pixels cost
const kCoarse = 0.5;
const kTones = { good: 0x1f9d74, bad: 0xd23b2f, unsure: 0xd08a10, none: 0x8a979d };

export class BladeScene {
  readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(32, 1, 0.1, 5000);
  private readonly controls: OrbitControls;
  private readonly clouds: CloudPoints;
  private cad: Mesh | undefined;
  private holes = new Group();
  private datums = new Group();
  private marks = new Group();
  private markable: Object3D[] = [];
  private radius = 30;
  private hasFront = false;
  private isMoving = false;
  private restTimer: ReturnType<typeof setTimeout> | undefined;
  private frame = 0;
  private readonly watcher: ResizeObserver;
  private pickable: Object3D[] = [];
  onPick: (key: string) => void = () => undefined;
  drawnCount = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: false, alpha: true, preserveDrawingBuffer: false });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.clouds = cloudPointsFor(this.renderer, this.scene);
    const sun = new DirectionalLight(0xffffff, 2.3);
    this.camera.add(sun);
    sun.position.set(0.4, 0.7, 1);
    this.scene.add(this.camera, new AmbientLight(0xffffff, 0.55), this.holes, this.datums, this.marks);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => this.move());
    canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => this.draw());
    canvas.addEventListener('keydown', this.onKey);
    let downAt: [number, number] | undefined;
    canvas.addEventListener('pointerdown', (event) => { downAt = [event.clientX, event.clientY]; });
    canvas.addEventListener('pointerup', (event) => {
      if (downAt && Math.hypot(event.clientX - downAt[0], event.clientY - downAt[1]) < 4) this.pick(event);
    });
    this.watcher = new ResizeObserver(() => this.resize());
    this.watcher.observe(canvas.parentElement!);
    this.resize();
  }

  setSurface(surface: Surface): void {
    this.radius = surface.radius;
    const count = surface.triangles.length, positions = new Float32Array(3 * count);
    for (let i = 0; i < count; ++i) for (let k = 0; k < 3; ++k) positions[3 * i + k] = surface.vertices[3 * surface.triangles[i]! + k]!;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    if (surface.normals) geometry.setAttribute('normal', new BufferAttribute(surface.normals, 3));
    else geometry.computeVertexNormals();
    // A little behind the points that lie on it.
    this.cad = new Mesh(geometry, new MeshLambertMaterial({ color: 0xaab6bb, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4 }));
    this.scene.add(this.cad);
    this.home();
  }

  home(): void {
    this.controls.target.set(0, 0, 0);
    const far = this.radius / Math.sin((this.camera.fov * Math.PI) / 360) * 1.02;
    const front = this.front, side = Math.atan2(front.y, front.x) + 0.38;
    this.camera.position.set(Math.cos(side) * 0.94 * far, Math.sin(side) * 0.94 * far, 0.32 * far);
    this.camera.up.set(0, 0, 1);
    this.camera.near = far / 200;
    this.camera.far = far * 10;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  setCloud(which: Which, cloud: Cloud): void {
    this.clouds.set(which, cloud);
    this.draw();
  }

  // centre: the surface's.
  setPatches(patches: Patches, centre: Vector, patchMm: number): void {
    if (this.tiles) { this.scene.remove(this.tiles.mesh); this.tiles.stop(); }
    this.tiles = new Tiles(patches, centre, patchMm);
    this.scene.add(this.tiles.mesh);
    this.canvas.dataset['tiles'] = String(patches.areasMm2.length);
    this.draw();
  }
  private tiles: Tiles | undefined;

  // Closed lines, three numbers a place; centre: the surface's.
  setLaps(laps: readonly number[][], centre: Vector): void {
    this.stopLaps();
    const material = new LineBasicMaterial({ color: 0x1f2933 });
    for (const lap of laps) {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(Float32Array.from(lap, (value, i) => value - centre[i % 3]!), 3));
      this.laps.add(new LineLoop(geometry, material));
    }
    this.scene.add(this.laps);
    this.canvas.dataset['laps'] = String(laps.length);
    this.draw();
  }
  private readonly laps = new Group();
  private stopLaps(): void {
    for (const lap of this.laps.children as LineLoop[]) { lap.geometry.dispose(); (lap.material as LineBasicMaterial).dispose(); }
    this.laps.clear();
  }

  setScale(scaleUm: number, bandUm: number): void {
    this.clouds.setScale(scaleUm, bandUm);
    this.tiles?.setScale(scaleUm, bandUm);
    this.scaleUm = scaleUm;
    this.draw();
  }
  private scaleUm = 50;
  private front = new Vector3(0, -1, 0);  // where the holes look

  setHoles(holes: DrawnHole[], paths: DrawnPath[], magnification: number, picked: string | undefined): void {
    this.empty(this.holes);
    if (holes.length > 0 && !this.hasFront) {
      this.hasFront = true;
      this.front.set(0, 0, 0);
      for (const hole of holes) this.front.add(new Vector3(...hole.normal));
      this.home();
    }
    this.pickable = [];
    const up = new Vector3(0, 0, 1);
    for (const hole of holes) {
      const normal = new Vector3(...hole.normal), at = new Vector3(...hole.nominalMm).addScaledVector(normal, 0.02 * hole.radiusMm + 0.01);
      const colour = kTones[hole.tone], facing = new Quaternion().setFromUnitVectors(up, normal);
      const isPicked = picked === hole.key;
      const ring = new Mesh(new RingGeometry(hole.radiusMm, hole.radiusMm * (isPicked ? 1.9 : 1.35), 40), new MeshBasicMaterial({ color: isPicked ? 0x0a66c2 : 0x20303a, side: DoubleSide }));
      ring.position.copy(at);
      ring.quaternion.copy(facing);
      const target = new Mesh(new SphereGeometry(Math.max(1.6 * hole.radiusMm, this.radius / 45), 8, 6), new MeshBasicMaterial({ visible: false }));
      target.position.copy(at);
      target.userData['key'] = hole.key;
      this.pickable.push(target);
      this.holes.add(ring, target);
      if (hole.withoutCorrectionMm) this.holes.add(this.arrow(new Vector3(...hole.withoutCorrectionMm).addScaledVector(normal, 0.05), at, 0x5b6d76, this.radius / 260));
      if (hole.asCutMm) {
        const moved = new Vector3(...hole.asCutMm).sub(new Vector3(...hole.nominalMm));
        this.holes.add(this.arrow(at, at.clone().addScaledVector(moved, magnification).addScaledVector(normal, 0.1 * hole.radiusMm), colour, this.radius / 130));
      }
    }
    for (const path of paths) this.addPath(path, picked === path.key);
    this.canvas.dataset['paths'] = String(paths.length);
    this.draw();
  }

  // The way itself, and at some of its poses how the tool stands.
  private addPath({ key, poses }: DrawnPath, isPicked: boolean): void {
    const ends: number[] = [], far = this.radius / 12, every = Math.max(1, Math.ceil(poses.length / 24));
    poses.forEach(({ tipMm, axis }, i) => {
      const next = poses[i + 1];
      if (next) ends.push(...tipMm, ...next.tipMm);
      if (i % every === 0 || !next) ends.push(...tipMm, tipMm[0] + far * axis[0], tipMm[1] + far * axis[1], tipMm[2] + far * axis[2]);
    });
    const lines = new LineSegments(new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(ends), 3)), new LineBasicMaterial({ color: isPicked ? 0x0a66c2 : 0x1f5fa8 }));
    const target = new Mesh(new SphereGeometry(this.radius / 40, 8, 6), new MeshBasicMaterial({ visible: false }));
    target.position.set(...poses[0]!.tipMm);
    target.userData['key'] = key;
    this.pickable.push(target);
    this.holes.add(lines, target);
  }

  setDatums(datums: DrawnDatum[]): void {
    this.empty(this.datums);
    for (const datum of datums) {
      const at = new Vector3(...datum.pointMm), normal = new Vector3(...datum.normal), far = this.radius / 6;
      const ball = new Mesh(new SphereGeometry(this.radius / 70, 16, 12), new MeshBasicMaterial({ color: 0x7a3fa0 }));
      ball.position.copy(at);
      this.datums.add(ball, this.arrow(at.clone().addScaledVector(normal, far), at, 0x7a3fa0, this.radius / 200), this.label(datum.name, at.clone().addScaledVector(normal, far * 1.18)));
    }
    this.draw();
  }

  setMarks(marks: DrawnMark[], arrows: DrawnArrow[], ellipsoid: DrawnEllipsoid | undefined, picked?: string): void {
    this.empty(this.marks);
    const hex = ([r, g, b]: Colour) => (r << 16) | (g << 8) | b;
    this.markable = marks.map(({ key, pointMm, colour, size }) => {
      const isPicked = key === picked, ball = new Mesh(new SphereGeometry((this.radius / 42) * size * (isPicked ? 1.5 : 1), 20, 14), isPicked ? new MeshBasicMaterial({ color: 0x0a66c2 }) : new MeshLambertMaterial({ color: hex(colour) }));
      ball.position.set(...pointMm);
      ball.userData['key'] = key;
      this.marks.add(ball);
      return ball;
    });
    for (const { fromMm, toMm, colour } of arrows) this.marks.add(this.arrow(new Vector3(...fromMm), new Vector3(...toMm), hex(colour), this.radius / 180));
    if (ellipsoid) {
      const shape = new Mesh(new SphereGeometry(1, 48, 32), new MeshLambertMaterial({ color: hex(ellipsoid.colour), transparent: true, opacity: 0.55, depthTest: false }));
      const [a, b, c] = ellipsoid.semiAxesMm, at = ellipsoid.centreMm;
      shape.matrixAutoUpdate = false;
      shape.matrix.set(a[0], b[0], c[0], at[0], a[1], b[1], c[1], at[1], a[2], b[2], c[2], at[2], 0, 0, 0, 1);
      this.marks.add(shape);
    }
    this.canvas.dataset['marks'] = String(marks.length);
    this.draw();
  }

  setShows(shows: Shows): void {
    if (this.cad) this.cad.visible = shows.cad;
    this.holes.visible = shows.holes;
    this.datums.visible = shows.datums;
    this.marks.visible = shows.marks ?? true;
    // Laid over each other, the one before is plain: two clouds of one scale could not be told apart.
    this.clouds.show('before', shows.before, shows.after && this.clouds.has('after'));
    this.clouds.show('after', shows.after, false);
    this.draw();
  }

  lookAt(hole: DrawnHole): void {
    const target = new Vector3(...hole.nominalMm), far = this.camera.position.distanceTo(this.controls.target);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(new Vector3(...hole.normal), Math.min(far, this.radius * 1.1)).add(new Vector3(0, 0, this.radius * 0.12));
    this.controls.update();
    this.draw();
  }

  // A PNG with its legend and title: what is passed on has to say what it shows.
  async picture(title: string, bandUm: number | undefined): Promise<Blob> {
    this.render(false);
    const { width, height } = this.canvas;
    const sheet = document.createElement('canvas');
    const foot = Math.round(height * 0.09);
    sheet.width = width; sheet.height = height + foot;
    const pen = sheet.getContext('2d')!;
    pen.fillStyle = '#ffffff';
    pen.fillRect(0, 0, sheet.width, sheet.height);
    pen.drawImage(this.canvas, 0, 0);
    const left = foot * 0.3, wide = width * 0.4;
    pen.font = `${Math.round(foot * 0.28)}px system-ui, sans-serif`;
    if (bandUm !== undefined) {
      const table = colourTable(this.scaleUm, bandUm);
      for (let i = 0; i < kColourCount; ++i) {
        pen.fillStyle = `rgb(${table[4 * i]} ${table[4 * i + 1]} ${table[4 * i + 2]})`;
        pen.fillRect(left + (wide * i) / kColourCount, height + foot * 0.15, wide / kColourCount + 1, foot * 0.35);
      }
      pen.fillStyle = '#16232a';
      pen.fillText(`−${this.scaleUm} µm`, left, height + foot * 0.85);
      pen.textAlign = 'center';
      pen.fillText(`grey: within ±${bandUm} µm`, left + wide / 2, height + foot * 0.85);
      pen.textAlign = 'right';
      pen.fillText(`+${this.scaleUm} µm`, left + wide, height + foot * 0.85);
    }
    pen.fillStyle = '#16232a';
    pen.textAlign = 'right';
    pen.fillText(title, width - left, height + foot * 0.6);
    return new Promise((resolve, reject) => sheet.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('The browser made no picture.'))), 'image/png'));
  }

  // For print, which waits for nothing: neither for a frame, nor for an image that has to be decoded first.
  drawInto(paper: HTMLCanvasElement): void {
    this.render(false);
    paper.width = this.canvas.width; paper.height = this.canvas.height;
    paper.getContext('2d', { willReadFrequently: true })!.drawImage(this.canvas, 0, 0);
    paper.hidden = false;
  }

  stop(): void {
    cancelAnimationFrame(this.frame);
    clearTimeout(this.restTimer);
    this.watcher.disconnect();
    this.controls.dispose();
    this.clouds.stop();
    this.tiles?.stop();
    this.stopLaps();
    this.renderer.dispose();
  }

  private arrow(from: Vector3, to: Vector3, colour: number, thickness: number): Group {
    const along = to.clone().sub(from), far = along.length(), group = new Group();
    if (far < 1e-6) return group;
    const material = new MeshBasicMaterial({ color: colour }), head = Math.min(far, thickness * 6);
    const shaft = new Mesh(new CylinderGeometry(thickness, thickness, Math.max(1e-6, far - head), 8), material);
    shaft.position.y = (far - head) / 2;
    const tip = new Mesh(new ConeGeometry(thickness * 2.4, head, 12), material);
    tip.position.y = far - head / 2;
    group.add(shaft, tip);
    group.position.copy(from);
    group.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), along.normalize());
    return group;
  }

  private label(text: string, at: Vector3): Sprite {
    const sprite = wordAt(text, at, 128, '600 40px', '#5a2a80');
    sprite.scale.set(this.radius / 5, this.radius / 10, 1);
    return sprite;
  }

  private empty(group: Group): void {
    group.traverse((object) => { if (object instanceof Mesh || object instanceof LineSegments) { object.geometry.dispose(); (object.material as MeshBasicMaterial).dispose(); } });
    group.clear();
  }

  private resize(): void { if (fillRoom(this.canvas, this.renderer, this.camera)) this.draw(); }

  private move(): void {
    this.isMoving = true;
    clearTimeout(this.restTimer);
    this.restTimer = setTimeout(() => { this.isMoving = false; this.draw(); }, kRestMs);
    this.draw();
  }

  private draw(): void {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => { this.frame = 0; this.render(this.isMoving); });
  }

  // Of the pixels that the screen has; all of them at rest.
  private sharpen(isMoving: boolean): void {
    const now = performance.now(), tookMs = now - this.turnedAt;
    if (isMoving && this.turnedAt > 0) this.turnMs = 0.7 * this.turnMs + 0.3 * tookMs;
    this.turnedAt = isMoving ? now : 0;
    const ratio = Math.min(2, window.devicePixelRatio) * (isMoving && this.turnMs > kSmoothMs ? kCoarse : 1);
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
  }
  private turnedAt = 0;
  private turnMs = 0;

  private render(isMoving: boolean): void {
    this.sharpen(isMoving);
    this.drawnCount = this.clouds.prepare(this.renderer, this.camera, isMoving);
    this.renderer.render(this.scene, this.camera);
    this.canvas.dataset['drawn'] = String(this.drawnCount);
  }

  private pick(event: PointerEvent): void {
    const box = this.canvas.getBoundingClientRect(), ray = new Raycaster();
    ray.setFromCamera(new Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2), this.camera);
    const hit = ray.intersectObjects([...this.pickable, ...this.markable], false)[0];
    if (hit) this.onPick(hit.object.userData['key'] as string);
  }

  private readonly onKey = (event: KeyboardEvent): void => {
    if (lookByKey(event, this.camera, this.controls, () => this.home())) this.move();
  };
}

// A machine drawn by its kinematics: rotary axes as lines with their bearings, what they carry, linear axes as rails, the tool, the scanner's field. A schema,
// not the machine's housing, of which the plant knows nothing.
import {
  AmbientLight, BoxGeometry, BufferAttribute, BufferGeometry, ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, GridHelper, Group, Matrix4, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, PerspectiveCamera, Quaternion, Scene, Sprite, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { JointKind, type Machine } from '#proto/sixpoint/plant/v1/machine_pb';
import { fillRoom, lookByKey, wordAt } from './looking';
import { directionOf, vectorOf, type Affine, type Vector } from './frames';
import { chainOf, type Commands } from './kinematics';

export type Field = { nearMm: number; farMm: number; midRangeMm: number; halfAngleRad: number; machineFromSensorRotation: number[] };
const kColours = [0x0f7f95, 0x7a3fa0, 0xb56a00, 0x1f7a4d];

const matrixOf = ({ linear: m, shift }: Affine): Matrix4 => new Matrix4().set(m[0]!, m[1]!, m[2]!, shift[0], m[3]!, m[4]!, m[5]!, shift[1], m[6]!, m[7]!, m[8]!, shift[2], 0, 0, 0, 1);

export class MachineScene {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(32, 1, 1, 20_000);
  private readonly controls: OrbitControls;
  private readonly bodies: Group[] = [];  // of the part's side, one a joint
  private readonly table = new Group();
  private readonly tool = new Group();
  private readonly field = new Group();
  private readonly watcher: ResizeObserver;
  private frame = 0;
  private readonly centre: Vector3;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly machine: Machine, private readonly sizeMm: number) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.centre = new Vector3(...vectorOf(machine.nominalCentreMm));
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(0.5, -0.6, 1);
    this.camera.add(sun);
    this.camera.up.set(0, 0, 1);
    const floor = new GridHelper(sizeMm * 4, 16, 0x8a979d, 0xb9c5cb);
    floor.rotation.x = Math.PI / 2;
    Object.assign(floor.material, { transparent: true, opacity: 0.45 });
    floor.position.copy(this.centre).add(new Vector3(0, 0, -sizeMm * 1.05));
    this.scene.add(this.camera, new AmbientLight(0xffffff, 0.6), floor, this.table, this.tool, this.field);
    this.build();
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => this.draw());
    canvas.addEventListener('keydown', this.onKey);
    this.watcher = new ResizeObserver(() => this.resize());
    this.watcher.observe(canvas.parentElement!);
    this.home();
    this.resize();
  }

  home(): void {
    const far = this.sizeMm * 5.6;
    this.controls.target.copy(this.centre).add(new Vector3(0, 0, this.sizeMm * 0.3));
    this.camera.position.copy(this.controls.target).add(new Vector3(0.62 * far, -0.68 * far, 0.42 * far));
    this.controls.update();
    this.draw();
  }

  setCommands(commands: Commands): void {
    const { partSide = [], toolSide = [] } = this.machine.kinematics ?? {};
    const { carriers, end } = chainOf(partSide, commands);
    this.bodies.forEach((body, i) => { body.matrix.copy(matrixOf(carriers[i]!)); });
    this.table.matrix.copy(matrixOf(end));
    this.tool.matrix.copy(matrixOf(chainOf(toolSide, commands).end));
    this.canvas.dataset['table'] = end.linear.map((x) => x.toFixed(4)).join(' ');
    this.draw();
  }

  setField(field: Field | undefined): void {
    this.field.clear();
    if (field) {
      const corner = (range: number, side: number): Vector => [0, side * range * Math.tan(field.halfAngleRad), field.midRangeMm - range];
      const [a, b, c, d] = [corner(field.nearMm, -1), corner(field.nearMm, 1), corner(field.farMm, 1), corner(field.farMm, -1)], eye: Vector = [0, 0, field.midRangeMm];
      const facet = (points: Vector[], colour: number, opacity: number) => {
        const geometry = new BufferGeometry();
        geometry.setAttribute('position', new BufferAttribute(new Float32Array(points.flat()), 3));
        return new Mesh(geometry, new MeshBasicMaterial({ color: colour, side: DoubleSide, transparent: true, opacity, depthWrite: false }));
      };
      this.field.add(facet([a!, b!, c!, a!, c!, d!], 0xc62f2f, 0.55), facet([eye, a!, b!], 0xc62f2f, 0.16));
      const head = new Mesh(new BoxGeometry(this.sizeMm * 0.28, this.sizeMm * 0.42, this.sizeMm * 0.2), new MeshLambertMaterial({ color: 0x3c4a52 }));
      head.position.set(0, 0, field.midRangeMm + this.sizeMm * 0.1);
      this.field.add(head);
      this.field.matrixAutoUpdate = false;
      this.field.matrix.copy(matrixOf({ linear: field.machineFromSensorRotation.length === 9 ? field.machineFromSensorRotation : [1, 0, 0, 0, 1, 0, 0, 0, 1], shift: [this.centre.x, this.centre.y, this.centre.z + this.sizeMm * 0.42] }));
    }
    this.draw();
  }

  // A PNG on white with its title.
  picture(title: string): Promise<Blob> {
    this.renderer.render(this.scene, this.camera);
    const { width, height } = this.canvas, foot = Math.round(height * 0.07), sheet = document.createElement('canvas');
    sheet.width = width; sheet.height = height + foot;
    const pen = sheet.getContext('2d')!;
    pen.fillStyle = '#ffffff';
    pen.fillRect(0, 0, width, height + foot);
    pen.drawImage(this.canvas, 0, 0);
    pen.fillStyle = '#16232a';
    pen.font = `${Math.round(foot * 0.42)}px system-ui, sans-serif`;
    pen.fillText(title, foot * 0.4, height + foot * 0.62);
    return new Promise((resolve, reject) => sheet.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('The browser made no picture.'))), 'image/png'));
  }

  stop(): void {
    cancelAnimationFrame(this.frame);
    this.watcher.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
  }

  private build(): void {
    const size = this.sizeMm, { partSide = [], toolSide = [] } = this.machine.kinematics ?? {};
    const up = new Vector3(0, 1, 0), rod = (from: Vector3, along: Vector3, length: number, radius: number, colour: number) => {
      const mesh = new Mesh(new CylinderGeometry(radius, radius, length, 32), new MeshLambertMaterial({ color: colour }));
      mesh.position.copy(from);
      mesh.quaternion.copy(new Quaternion().setFromUnitVectors(up, along.clone().normalize()));
      return mesh;
    };
    partSide.forEach((joint, i) => {
      const body = new Group(), colour = kColours[i % kColours.length]!, along = new Vector3(...directionOf(joint.direction));
      body.matrixAutoUpdate = false;
      if (joint.kind === JointKind.ROTARY) {
        const at = new Vector3(...vectorOf(joint.pointMm)), reach = size * (i === 0 ? 1.15 : 0.85);
        body.add(rod(at, along, 2 * reach, size * 0.012, colour));
        for (const side of [-1, 1]) body.add(rod(at.clone().addScaledVector(along, side * reach * 0.86), along, size * 0.2, size * 0.17, colour));
        body.add(this.label(joint.axis, at.clone().addScaledVector(along, reach * 1.14), colour));
      } else {
        const at = this.centre.clone().add(new Vector3(0, 0, -size * (0.95 - 0.1 * i)));
        body.add(rod(at, along, size * 2.4, size * 0.045, colour), this.label(joint.axis, at.clone().addScaledVector(along, size * 1.32), colour));
      }
      this.bodies.push(body);
      this.scene.add(body);
    });
    this.table.matrixAutoUpdate = false;
    const plate = new Mesh(new BoxGeometry(size * 1.1, size * 0.62, size * 0.09), new MeshLambertMaterial({ color: 0x9aa8ae }));
    plate.position.copy(this.centre).add(new Vector3(0, 0, -size * 0.13));
    const block = new Mesh(new BoxGeometry(size * 0.34, size * 0.16, size * 0.5), new MeshLambertMaterial({ color: 0xc9a06a }));
    block.position.copy(this.centre).add(new Vector3(0, 0, size * 0.17));
    this.table.add(plate, block);
    this.tool.matrixAutoUpdate = false;
    if (toolSide.length > 0) {
      const tip = new Mesh(new ConeGeometry(size * 0.035, size * 0.28, 24), new MeshLambertMaterial({ color: 0x2f3b42 }));
      tip.rotation.x = -Math.PI / 2;
      tip.position.set(0, 0, size * 0.14);
      const spindle = rod(new Vector3(0, 0, size * 0.55), new Vector3(0, 0, 1), size * 0.55, size * 0.13, 0x5d6c74);
      this.tool.add(tip, spindle);
      toolSide.forEach((joint, i) => {
        if (joint.kind !== JointKind.LINEAR) return;
        const along = new Vector3(...directionOf(joint.direction)), colour = kColours[(partSide.length + i) % kColours.length]!, from = new Vector3(0, 0, size * 0.84);
        const mesh = rod(from.clone().addScaledVector(along, size * 0.32), along, size * 0.42, size * 0.018, colour), head = new Mesh(new ConeGeometry(size * 0.045, size * 0.12, 16), new MeshLambertMaterial({ color: colour }));
        head.position.copy(from).addScaledVector(along, size * 0.56);
        head.quaternion.copy(mesh.quaternion);
        this.tool.add(mesh, head, this.label(joint.axis, from.clone().addScaledVector(along, size * 0.7), colour));
      });
    }
  }

  private label(text: string, at: Vector3, colour: number): Sprite {
    const sprite = wordAt(text.slice(0, 2), at, 64, '700 44px', `#${colour.toString(16).padStart(6, '0')}`);
    sprite.scale.setScalar(this.sizeMm * 0.26);
    return sprite;
  }

  private resize(): void { if (fillRoom(this.canvas, this.renderer, this.camera)) this.draw(); }

  private draw(): void {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => { this.frame = 0; this.renderer.render(this.scene, this.camera); });
  }

  private readonly onKey = (event: KeyboardEvent): void => { lookByKey(event, this.camera, this.controls, () => this.home()); };
}

// The clouds of a scene as points: by the graphics processor, or where there is none by the page itself.
import {
  BufferAttribute, BufferGeometry, DataTexture, FloatType, Mesh, Points, RedFormat, RGBAFormat, Scene, ShaderMaterial, Vector3, type PerspectiveCamera, type WebGLRenderer,
} from 'three';
import type { Cloud } from './cloud';
import { colourTable, kColourCount, kColourReach, kSetAside, type Colour } from './colours';
import { PointRaster } from './point_raster';

export type Which = 'before' | 'after';
export const kWhich = ['before', 'after'] as const;
const kMoving = 300_000;  // so many of each are drawn while the view turns, all once it rests
const kPlain: Colour = [117, 102, 158];  // of the one that lies under the other

export interface CloudPoints {
  set(which: Which, cloud: Cloud): void;
  has(which: Which): boolean;
  setScale(scaleUm: number, bandUm: number): void;
  show(which: Which, isShown: boolean, isPlain: boolean): void;
  // Before the scene is rendered. How many points it will show.
  prepare(renderer: WebGLRenderer, camera: PerspectiveCamera, isMoving: boolean): number;
  stop(): void;
}

function isWithoutGraphicsProcessor(renderer: WebGLRenderer): boolean {
  const gl = renderer.getContext(), named = gl.getExtension('WEBGL_debug_renderer_info');
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER)));
}

export function cloudPointsFor(renderer: WebGLRenderer, scene: Scene): CloudPoints {
  const isByPage = isWithoutGraphicsProcessor(renderer);
  renderer.domElement.dataset['pointsBy'] = isByPage ? 'the page' : 'WebGL';
  return isByPage ? new DrawnPoints(scene) : new RenderedPoints(scene);
}

const sizePx = (renderer: WebGLRenderer, count: number, isMoving: boolean): number => renderer.getPixelRatio() * (isMoving ? 1 : count < 150_000 ? 2.2 : 1.4);

// A point has one colour, looked up once.
const kVertex = `
attribute float deviationUm; varying vec3 vColour; uniform float pointPx;
uniform sampler2D table; uniform float scaleUm; uniform float reach; uniform vec3 setAside; uniform bool isPlain; uniform vec3 plain;
void main() {
  float at = 0.5 + 0.5 * clamp(deviationUm / (scaleUm * reach), -0.999, 0.999);
  vColour = deviationUm < -1.0e8 ? setAside : isPlain ? plain : texture2D(table, vec2(at, 0.5)).rgb;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); gl_PointSize = pointPx;
}`;
const kFragment = `
varying vec3 vColour;
void main() { gl_FragColor = vec4(vColour, 1.0); }`;
const kSetAsideUm = -1e9;  // NaN does not survive every driver

class RenderedPoints implements CloudPoints {
  private readonly clouds: Partial<Record<Which, { points: Points<BufferGeometry, ShaderMaterial>; count: number }>> = {};
  private readonly table = new DataTexture(colourTable(50, 10), kColourCount, 1, RGBAFormat);
  private scaleUm = 50;

  constructor(private readonly scene: Scene) { this.table.needsUpdate = true; }

  set(which: Which, cloud: Cloud): void {
    const old = this.clouds[which]?.points;
    if (old) { this.scene.remove(old); old.geometry.dispose(); }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(cloud.positions, 3));
    geometry.setAttribute('deviationUm', new BufferAttribute(cloud.deviationsUm.map((um) => (Number.isNaN(um) ? kSetAsideUm : um)), 1));
    const part = (colour: Colour) => new Vector3(...colour.map((c) => c / 255));
    const material = old?.material ?? new ShaderMaterial({
      vertexShader: kVertex, fragmentShader: kFragment,
      uniforms: {
        table: { value: this.table }, scaleUm: { value: this.scaleUm }, reach: { value: kColourReach }, pointPx: { value: 2 },
        setAside: { value: part(kSetAside) }, isPlain: { value: false }, plain: { value: part(kPlain) },
      },
    });
    const points = new Points(geometry, material);
    points.frustumCulled = false;
    if (old) points.visible = old.visible;
    this.clouds[which] = { points, count: cloud.count };
    this.scene.add(points);
  }

  has(which: Which): boolean { return this.clouds[which] !== undefined; }

  setScale(scaleUm: number, bandUm: number): void {
    (this.table.image.data as Uint8Array).set(colourTable(scaleUm, bandUm));
    this.table.needsUpdate = true;
    this.scaleUm = scaleUm;
    for (const { points } of Object.values(this.clouds)) points.material.uniforms['scaleUm']!.value = scaleUm;
  }

  show(which: Which, isShown: boolean, isPlain: boolean): void {
    const cloud = this.clouds[which];
    if (!cloud) return;
    cloud.points.visible = isShown;
    cloud.points.material.uniforms['isPlain']!.value = isPlain;
  }

  prepare(renderer: WebGLRenderer, _: PerspectiveCamera, isMoving: boolean): number {
    let drawn = 0;
    for (const { points, count: all } of Object.values(this.clouds)) {
      if (!points.visible) continue;
      const count = isMoving ? Math.min(kMoving, all) : all;
      points.geometry.setDrawRange(0, count);
      points.material.uniforms['pointPx']!.value = sizePx(renderer, all, isMoving);
      drawn += count;
    }
    return drawn;
  }

  stop(): void { for (const { points } of Object.values(this.clouds)) points.geometry.dispose(); }
}

const kSheetVertex = 'void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }';
const kSheetFragment = `
uniform sampler2D pixels; uniform sampler2D depths;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 colour = texelFetch(pixels, at, 0);
  if (colour.a == 0.0) discard;
  gl_FragColor = colour; gl_FragDepth = texelFetch(depths, at, 0).r;
}`;

// Drawn into a sheet that lies over the whole view, with its depths: what stands before a point hides it, and the other way round.
class DrawnPoints implements CloudPoints {
  private readonly clouds: Partial<Record<Which, { cloud: Cloud; colours: Uint32Array | undefined; isShown: boolean; isPlain: boolean }>> = {};
  private table = new Uint32Array(colourTable(50, 10).buffer);
  private scaleUm = 50;
  private readonly raster = new PointRaster();
  private readonly sheet: Mesh<BufferGeometry, ShaderMaterial>;

  constructor(scene: Scene) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    this.sheet = new Mesh(geometry, new ShaderMaterial({ vertexShader: kSheetVertex, fragmentShader: kSheetFragment, uniforms: { pixels: { value: null }, depths: { value: null } } }));
    this.sheet.frustumCulled = false;
    scene.add(this.sheet);
  }

  set(which: Which, cloud: Cloud): void {
    const old = this.clouds[which];
    this.clouds[which] = { cloud, colours: undefined, isShown: old?.isShown ?? true, isPlain: old?.isPlain ?? false };
  }

  has(which: Which): boolean { return this.clouds[which] !== undefined; }

  setScale(scaleUm: number, bandUm: number): void {
    this.table = new Uint32Array(colourTable(scaleUm, bandUm).buffer);
    this.scaleUm = scaleUm;
    for (const cloud of Object.values(this.clouds)) cloud.colours = undefined;
  }

  show(which: Which, isShown: boolean, isPlain: boolean): void {
    const cloud = this.clouds[which];
    if (!cloud) return;
    if (cloud.isPlain !== isPlain) cloud.colours = undefined;
    Object.assign(cloud, { isShown, isPlain });
  }

  private coloursOf({ deviationsUm }: Cloud, isPlain: boolean): Uint32Array {
    const one = ([r, g, b]: Colour) => new Uint32Array(new Uint8Array([r, g, b, 255]).buffer)[0]!;
    const setAside = one(kSetAside), plain = one(kPlain), step = kColourCount / (2 * kColourReach * this.scaleUm);
    const colours = new Uint32Array(deviationsUm.length);
    for (let i = 0; i < colours.length; ++i) {
      const um = deviationsUm[i]!;
      colours[i] = Number.isNaN(um) ? setAside : isPlain ? plain : this.table[Math.min(kColourCount - 1, Math.max(0, Math.floor(kColourCount / 2 + um * step)))]!;
    }
    return colours;
  }

  prepare(renderer: WebGLRenderer, camera: PerspectiveCamera, isMoving: boolean): number {
    const shown = kWhich.flatMap((which) => (this.clouds[which]?.isShown ? [this.clouds[which]] : []));
    this.sheet.visible = shown.length > 0;
    if (shown.length === 0) return 0;
    const { width, height } = renderer.domElement;
    this.raster.begin(width, height);
    this.fit();
    camera.updateMatrixWorld();
    const clipFromPoint = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).elements;
    let drawn = 0;
    for (const entry of shown) {
      const all = entry.cloud.count, count = isMoving ? Math.min(kMoving, all) : all;
      entry.colours ??= this.coloursOf(entry.cloud, entry.isPlain);
      this.raster.draw(entry.cloud.positions, entry.colours, count, clipFromPoint, sizePx(renderer, all, isMoving));
      drawn += count;
    }
    for (const name of ['pixels', 'depths']) this.textures![name]!.needsUpdate = true;
    return drawn;
  }

  // Textures are of the raster's own memory: anew where that is.
  private fit(): void {
    const { width, height, pixels, depths } = this.raster;
    if (this.textures?.['depths']!.image.data === depths) return;
    this.dispose();
    this.textures = { pixels: new DataTexture(new Uint8Array(pixels.buffer), width, height, RGBAFormat), depths: new DataTexture(depths, width, height, RedFormat, FloatType) };
    for (const [name, texture] of Object.entries(this.textures)) this.sheet.material.uniforms[name]!.value = texture;
  }
  private textures: Record<string, DataTexture> | undefined;

  private dispose(): void { for (const texture of Object.values(this.textures ?? {})) texture.dispose(); }

  stop(): void { this.dispose(); this.sheet.geometry.dispose(); this.sheet.material.dispose(); }
}

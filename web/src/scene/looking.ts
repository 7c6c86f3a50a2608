// How one looks at a scene: in whatever room its canvas has, by keys as by the mouse, with words that stand in it.
import { CanvasTexture, LinearFilter, SRGBColorSpace, Sprite, SpriteMaterial, Vector3, type PerspectiveCamera, type WebGLRenderer } from 'three';
import type { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';

// False where it has no room now.
export function fillRoom(canvas: HTMLCanvasElement, renderer: WebGLRenderer, camera: PerspectiveCamera): boolean {
  const { clientWidth: width, clientHeight: height } = canvas.parentElement!;
  if (width === 0 || height === 0) return false;
  renderer.setSize(width, height, false);
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
  return true;
}

// Arrows turn, plus and minus come nearer and go away, Home shows all. Whether the view moved by it.
export function lookByKey(event: KeyboardEvent, camera: PerspectiveCamera, controls: OrbitControls, home: () => void): boolean {
  const offset = camera.position.clone().sub(controls.target);
  const turn = 0.09, side = new Vector3().crossVectors(camera.up, offset).normalize();
  switch (event.key) {
    case 'ArrowLeft': offset.applyAxisAngle(camera.up, -turn); break;
    case 'ArrowRight': offset.applyAxisAngle(camera.up, turn); break;
    case 'ArrowUp': if (offset.angleTo(camera.up) > 0.15) offset.applyAxisAngle(side, -turn); break;
    case 'ArrowDown': if (offset.angleTo(camera.up) < Math.PI - 0.15) offset.applyAxisAngle(side, turn); break;
    case '+': case '=': offset.multiplyScalar(0.88); break;
    case '-': offset.multiplyScalar(1 / 0.88); break;
    case 'Home': home(); event.preventDefault(); return false;
    default: return false;
  }
  event.preventDefault();
  camera.position.copy(controls.target).add(offset);
  controls.update();
  return true;
}

// A word that faces who looks, whatever lies before it; on so many pixels.
export function wordAt(text: string, at: Vector3, widthPx: number, font: string, colour: string): Sprite {
  const canvas = document.createElement('canvas');
  canvas.width = widthPx; canvas.height = 64;
  const pen = canvas.getContext('2d')!;
  pen.font = `${font} system-ui, sans-serif`;
  pen.textAlign = 'center';
  pen.lineWidth = 8; pen.strokeStyle = '#ffffff'; pen.strokeText(text, widthPx / 2, 46);
  pen.fillStyle = colour; pen.fillText(text, widthPx / 2, 46);
  const texture = new CanvasTexture(canvas);
  texture.minFilter = LinearFilter;
  texture.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(new SpriteMaterial({ map: texture, depthTest: false, transparent: true }));
  sprite.position.copy(at);
  return sprite;
}

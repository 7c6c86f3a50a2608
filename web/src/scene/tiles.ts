// A deviation map's patches as tiles on the surface, each in the colour of its mean: what was not seen has one of its own.
import { Color, DoubleSide, InstancedMesh, Matrix4, MeshBasicMaterial, PlaneGeometry, Vector3 } from 'three';
import { colourOf, type Colour } from './colours';
import type { Vector } from './frames';

export type Patches = {
  centresMm: number[]; normals: number[];  // three numbers a patch, part frame
  areasMm2: number[];
  meansUm: number[];  // NaN: not seen
};

export const kNotSeen: Colour = [66, 74, 82];

export class Tiles {
  readonly mesh: InstancedMesh;

  // centre: of the surface, about which all is drawn.
  constructor(private readonly patches: Patches, centre: Vector, patchMm: number) {
    const count = patches.areasMm2.length, at = new Vector3(), normal = new Vector3(), along = new Vector3(), across = new Vector3(), matrix = new Matrix4();
    this.mesh = new InstancedMesh(new PlaneGeometry(1, 1), new MeshBasicMaterial({ side: DoubleSide }), count);
    for (let i = 0; i < count; ++i) {
      normal.fromArray(patches.normals, 3 * i);
      // In front of the CAD by little: it is curved, the tile is not.
      at.fromArray(patches.centresMm, 3 * i).sub(new Vector3(...centre)).addScaledVector(normal, 0.03 * patchMm);
      // Patches are cut along the coordinates' planes: so a tile's edge runs along the axis that is least across it.
      const [x, y, z] = [Math.abs(normal.x), Math.abs(normal.y), Math.abs(normal.z)];
      along.set(Number(x <= y && x <= z), Number(y < x && y <= z), Number(z < x && z < y)).addScaledVector(normal, -[normal.x, normal.y, normal.z][x <= y && x <= z ? 0 : y <= z ? 1 : 2]!).normalize();
      const edge = Math.sqrt(patches.areasMm2[i]!) * 1.05;
      matrix.makeBasis(along, across.crossVectors(normal, along), normal).scale(new Vector3(edge, edge, 1)).setPosition(at);
      this.mesh.setMatrixAt(i, matrix);
    }
    this.setScale(50, 10);
  }

  setScale(scaleUm: number, bandUm: number): void {
    const colour = new Color();
    this.patches.meansUm.forEach((mean, i) => {
      const [r, g, b] = Number.isNaN(mean) ? kNotSeen : colourOf(mean, scaleUm, bandUm);
      this.mesh.setColorAt(i, colour.setRGB(r / 255, g / 255, b / 255, 'srgb'));
    });
    if (this.mesh.instanceColor) this.mesh.instanceColor.needsUpdate = true;
  }

  stop(): void {
    this.mesh.geometry.dispose();
    (this.mesh.material as MeshBasicMaterial).dispose();
    this.mesh.dispose();
  }
}

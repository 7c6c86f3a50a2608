// Points drawn by the processor: each is projected, and the nearest one to a pixel kept. Where no graphics processor is, WebGL turns every point into
// triangles by the same processor, at some fifty times the cost.
export class PointRaster {
  width = 0; height = 0;
  pixels = new Uint32Array(0);  // RGBA as bytes, the lowest row first; 0: nothing there
  depths = new Float32Array(0);  // of the window, 0 (near) to 1

  begin(width: number, height: number): void {
    if (width !== this.width || height !== this.height) {
      this.width = width; this.height = height;
      this.pixels = new Uint32Array(width * height);
      this.depths = new Float32Array(width * height);
    }
    this.pixels.fill(0);
    this.depths.fill(1);
  }

  // The first `count` of the points (x, y, z each), as squares of so many pixels. clipFromPoint: 4 x 4, column by column.
  draw(positions: Float32Array, colours: Uint32Array, count: number, clipFromPoint: ArrayLike<number>, sizePx: number): void {
    const { width, height, pixels, depths } = this, m = clipFromPoint, w2 = width / 2, h2 = height / 2;
    // The window's corner and size go into the matrix: three sums and a division a point.
    const row = (k: number, scale: number, shift: number) => [0, 4, 8, 12].map((c) => scale * m[c + k]! + shift * m[c + 3]!) as [number, number, number, number];
    const [xx, xy, xz, x1] = row(0, w2, w2), [yx, yy, yz, y1] = row(1, h2, h2), [zx, zy, zz, z1] = row(2, 0.5, 0.5), [wx, wy, wz, w1] = row(3, 1, 0);
    const most = Math.max(1, Math.round(sizePx)), back = (most - 1) / 2;
    for (let i = 0, j = 0; i < count; ++i, j += 3) {
      const x = positions[j]!, y = positions[j + 1]!, z = positions[j + 2]!;
      const w = wx * x + wy * y + wz * z + w1;
      if (!(w > 0)) continue;  // behind who looks
      const near = 1 / w, depth = (zx * x + zy * y + zz * z + z1) * near;
      const px = (xx * x + xy * y + xz * z + x1) * near - back, py = (yx * x + yy * y + yz * z + y1) * near - back;
      if (!(depth >= 0 && depth < 1 && px >= 0 && py >= 0 && px < width && py < height)) continue;
      const left = px | 0, low = py | 0;
      if (most === 1) {
        const at = low * width + left;
        if (depth < depths[at]!) { depths[at] = depth; pixels[at] = colours[i]!; }
        continue;
      }
      const right = Math.min(width, left + most), high = Math.min(height, low + most);
      for (let v = low; v < high; ++v) {
        for (let at = v * width + left; at < v * width + right; ++at) if (depth < depths[at]!) { depths[at] = depth; pixels[at] = colours[i]!; }
      }
    }
  }
}

// A stored block to points of the sensor frame, as docs/stored_clouds.md says: plain Draco, or the range image that a line scan is.
export type Draco = {
  Decoder: new () => DracoDecoder;
  DecoderBuffer: new () => { Init(bytes: Int8Array, size: number): void };
  PointCloud: new () => { num_points(): number };
  MetadataQuerier: new () => { GetDoubleEntry(metadata: unknown, name: string): number; GetIntEntry(metadata: unknown, name: string): number };
  DracoFloat32Array: new () => { GetValue(i: number): number };
  DracoInt32Array: new () => { GetValue(i: number): number };
  POSITION: number;
  destroy(object: unknown): void;
};
type DracoDecoder = {
  DecodeBufferToPointCloud(buffer: unknown, cloud: unknown): { ok(): boolean; error_msg(): string };
  GetAttributeId(cloud: unknown, type: number): number;
  GetAttribute(cloud: unknown, id: number): unknown;
  GetAttributeIdByMetadataEntry(cloud: unknown, name: string, value: string): number;
  GetMetadata(cloud: unknown): unknown;
  GetAttributeFloatForAllPoints(cloud: unknown, attribute: unknown, values: unknown): boolean;
  GetAttributeInt32ForAllPoints(cloud: unknown, attribute: unknown, values: unknown): boolean;
};

const kTangentGrid = 2 ** 40;  // so that the last bit of one computer's tan makes no other point

export function decodeBlock(draco: Draco, bytes: Uint8Array): Float64Array {
  const decoder = new draco.Decoder(), buffer = new draco.DecoderBuffer(), cloud = new draco.PointCloud();
  const made: unknown[] = [decoder, buffer, cloud];
  try {
    buffer.Init(new Int8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength), bytes.byteLength);
    const status = decoder.DecodeBufferToPointCloud(buffer, cloud);
    if (!status.ok()) throw new Error(`A stored block does not decode: ${status.error_msg()}`);
    const count = cloud.num_points(), points = new Float64Array(3 * count);
    const position = decoder.GetAttributeId(cloud, draco.POSITION);
    if (position >= 0) {
      const values = new draco.DracoFloat32Array();
      made.push(values);
      decoder.GetAttributeFloatForAllPoints(cloud, decoder.GetAttribute(cloud, position), values);
      for (let i = 0; i < 3 * count; ++i) points[i] = values.GetValue(i);
      return points;
    }
    const column = (name: string) => {
      const id = decoder.GetAttributeIdByMetadataEntry(cloud, 'name', name);
      if (id < 0) throw new Error(`A stored block has no attribute ${name}.`);
      const values = new draco.DracoInt32Array();
      made.push(values);
      decoder.GetAttributeInt32ForAllPoints(cloud, decoder.GetAttribute(cloud, id), values);
      return values;
    };
    const x = column('x'), columns = column('column'), z = column('z'), yFromRay = column('y_from_ray');
    const metadata = decoder.GetMetadata(cloud), querier = new draco.MetadataQuerier();
    made.push(querier);
    const stepMm = querier.GetDoubleEntry(metadata, 'step_mm'), midRangeMm = querier.GetDoubleEntry(metadata, 'mid_range_mm');
    const firstRad = querier.GetDoubleEntry(metadata, 'first_ray_rad'), pitchRad = querier.GetDoubleEntry(metadata, 'ray_pitch_rad');
    for (let i = 0; i < count; ++i) {
      const zMm = z.GetValue(i) * stepMm, tangent = Math.round(Math.tan(firstRad + columns.GetValue(i) * pitchRad) * kTangentGrid) / kTangentGrid;
      points[3 * i] = x.GetValue(i) * stepMm;
      points[3 * i + 1] = (midRangeMm - zMm) * tangent + yFromRay.GetValue(i) * stepMm;
      points[3 * i + 2] = zMm;
    }
    return points;
  } finally {
    for (const object of made.reverse()) draco.destroy(object);
  }
}

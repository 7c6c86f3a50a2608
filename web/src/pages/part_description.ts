// What of a part goes along with a CAD file.
import { clone } from '@bufbuild/protobuf';
import { CadFormat, PartSchema, type Part } from '#proto/sixpoint/plant/v1/part_pb';

const kFormats: [RegExp, CadFormat][] = [[/\.(step|stp|p21)$/i, CadFormat.STEP], [/\.(iges|igs)$/i, CadFormat.IGES], [/\.stl$/i, CadFormat.STL]];
export const formatOf = (file: string): CadFormat | undefined => kFormats.find(([ending]) => ending.test(file))?.[1];

// What a request may not hold is written by the plant alone.
export function descriptionOf(part: Part): Part {
  const copy = clone(PartSchema, part);
  Object.assign(copy, { name: '', revision: 0, surface: undefined, createdAt: undefined });
  return copy;
}

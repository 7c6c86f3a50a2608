// Colours of deviations, in one place for shader and legend: grey within the band, blue inside the surface, red outside, dark beyond the scale.
export type Colour = [number, number, number];  // 0 to 255

export const kColourCount = 512;
export const kColourReach = 1.125;  // of the scale: what lies beyond it has a colour too

const kGrey: Colour = [214, 218, 214];
const kBlue: Colour[] = [[172, 205, 235], [84, 146, 212], [22, 74, 158]], kRed: Colour[] = [[250, 196, 170], [231, 105, 76], [172, 24, 36]];
const kBelow: Colour = [10, 24, 82], kAbove: Colour = [84, 4, 28];
export const kSetAside: Colour = [150, 120, 190];

function along(colours: Colour[], t: number): Colour {
  const at = Math.min(colours.length - 1, Math.max(0, t * (colours.length - 1))), i = Math.min(colours.length - 2, Math.floor(at)), f = at - i;
  return [0, 1, 2].map((k) => Math.round(colours[i]![k]! * (1 - f) + colours[i + 1]![k]! * f)) as Colour;
}

export function colourOf(deviationUm: number, scaleUm: number, bandUm: number): Colour {
  if (Number.isNaN(deviationUm)) return kSetAside;
  const size = Math.abs(deviationUm);
  if (size > scaleUm) return deviationUm > 0 ? kAbove : kBelow;
  if (size <= bandUm) return kGrey;
  return along(deviationUm > 0 ? kRed : kBlue, (size - bandUm) / Math.max(1e-9, scaleUm - bandUm));
}

// From -reach to +reach of the scale.
export function colourTable(scaleUm: number, bandUm: number): Uint8Array {
  const table = new Uint8Array(4 * kColourCount);
  for (let i = 0; i < kColourCount; ++i) {
    const deviation = ((2 * (i + 0.5)) / kColourCount - 1) * kColourReach * scaleUm;
    table.set([...colourOf(deviation, scaleUm, bandUm), 255], 4 * i);
  }
  return table;
}

// The next of 1, 2, 5, 10, ... that is not less.
export function roundScale(um: number): number {
  const power = 10 ** Math.floor(Math.log10(Math.max(0.5, um)));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= um * 0.999) ?? 10 * power;
}

// What a calibration says, value by value, by the names that its trend has.
import type { Calibration } from '#proto/sixpoint/calibration/v1/calibration_pb';
import { CalibrationKind } from '#proto/sixpoint/calibration/v1/kind_pb';
import type { Point } from '#proto/sixpoint/geometry/v1/geometry_pb';

export type Parameter = { parameter: string; value: number; standardUncertainty: number | undefined };

const kWords: Record<CalibrationKind, string> = {
  [CalibrationKind.UNSPECIFIED]: 'Calibration', [CalibrationKind.SENSOR]: 'Scanner', [CalibrationKind.ROTATION]: 'Rotary axes', [CalibrationKind.PROBE]: 'Point probe', [CalibrationKind.AXIS]: 'Axis positioning',
};
export const kindWord = (one: { kind: CalibrationKind; result?: Calibration['result'] }): string => (one.result?.case === 'axis' ? `Axis ${one.result.value.axis}` : kWords[one.kind]);
export const axisOf = (one: Calibration): string => (one.result.case === 'axis' ? one.result.value.axis : '');

const three = (name: string, unit: string, p: Point | undefined, u: Point | undefined): Parameter[] =>
  (p ? (['x', 'y', 'z'] as const).map((axis) => ({ parameter: `${name}_${axis}${unit}`, value: p[`${axis}Mm`], standardUncertainty: u?.[`${axis}Mm`] })) : []);

// Its own values: the trend holds no drafts and none that were withdrawn.
export function parametersOf({ result }: Calibration): Parameter[] {
  switch (result.case) {
    case 'sensor': {
      const s = result.value;
      return [
        { parameter: 'alpha_deg', value: s.alphaDeg, standardUncertainty: s.alphaStandardUncertaintyDeg }, { parameter: 'beta_deg', value: s.betaDeg, standardUncertainty: s.betaStandardUncertaintyDeg },
        { parameter: 'gamma_deg', value: s.gammaDeg, standardUncertainty: s.gammaStandardUncertaintyDeg }, ...three('t_sm', '_mm', s.tSmMm, s.tSmStandardUncertaintyMm),
      ];
    }
    case 'rotation': return three('point_c', '_mm', result.value.pointCMm, result.value.pointCStandardUncertaintyMm);
    case 'probe': {
      const p = result.value;
      return [...p.approach.map((value, i) => ({ parameter: `approach_${'xyz'[i]}`, value, standardUncertainty: undefined })), ...three('offset', '_mm', p.offsetMm, undefined),
        { parameter: 'scale', value: p.scale, standardUncertainty: p.scaleStandardUncertainty }];
    }
    case 'axis': {
      const a = result.value;
      return ([['reversal_deg', a.reversal], ['mean_deg', a.mean], ['long_wave_amplitude_deg', a.longWave?.amplitude], ['periodic_amplitude_deg', a.periodic?.amplitude], ['greatest_error_deg', a.greatestError]] as const)
        .flatMap(([parameter, estimate]) => (estimate ? [{ parameter, value: estimate.valueDeg, standardUncertainty: estimate.standardUncertaintyDeg }] : []));
    }
    default: return [];
  }
}

// T_sm x and not t sm x: as the papers and docs/methods write them.
const kNames: Record<string, string> = {
  alpha: 'α', beta: 'β', gamma: 'γ', 't sm x': 'T_sm x', 't sm y': 'T_sm y', 't sm z': 'T_sm z', 'point c x': 'Point C x', 'point c y': 'Point C y', 'point c z': 'Point C z',
  'a toward x': 'A leans toward x', 'a toward z': 'A leans toward z', 'b toward y': 'B leans toward y', 'b toward z': 'B leans toward z', 'long wave amplitude': 'Long wave, amplitude', 'periodic amplitude': 'Short wave, amplitude',
  'greatest error': 'Greatest error', reversal: 'Reversal error', mean: 'Mean error',
};
export const parameterName = (words: string): string => kNames[words] ?? words;

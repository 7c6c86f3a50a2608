// A calibration that was computed as it is recorded: its row and its journal entry.
#pragma once

#include "services/calibration/calibrate.h"
#include "services/calibration/inputs.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibrations.h"

namespace sixpoint::calibration {

// With a new id.
storage::CalibrationRow RowOf(const v1::CalibrateSensorRequest& request, const SensorInputs& inputs,
                              const CalibratedSensor& result);
storage::CalibrationRow RowOf(const v1::StateSensorPoseRequest& request, const StatedInputs& inputs,
                              const StatedSensor& result);
storage::CalibrationRow RowOf(const v1::CalibrateRotationRequest& request, const RotationInputs& inputs,
                              const metrology::RotationCalibration& result);
storage::CalibrationRow RowOf(const v1::CalibrateProbeRequest& request, const ProbeInputs& inputs,
                              const CalibratedProbe& result);
storage::CalibrationRow RowOf(const v1::CharacteriseAxisRequest& request, const AxisInputs& inputs,
                              const metrology::AxisCharacterisation& result);

// The row with what the journal says of it.
runtime::Made<storage::CalibrationRow> RecordOf(storage::CalibrationRow row);

}  // namespace sixpoint::calibration

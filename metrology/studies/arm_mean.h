// Where an arm stands on the mean of its swings, from a calibration in one of them and scans of the same artefact in others
// (docs/methods/sensor_calibration.md, several swings).
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/studies/arm_study.h"
#include "metrology/studies/artefact_fit.h"

namespace sixpoint::metrology {

// How the place that is stated of the sensor follows where its arm stood in one series. Of all series together they are the identity.
struct ArmShare {
  std::string arm_series;
  Matrix6d response = NotYet<Matrix6d>();  // order of kSensorParameters
};

// What a scan in another series shows of the sensor against the calibration: rotation vector (rad), translation (mm), machine axes.
struct SwungScan {
  std::string arm_series;
  Vector6d displacement = Vector6d::Zero();
  Matrix6d covariance = NotYet<Matrix6d>();              // by the readings' scatter
  FieldResponse field_response = FieldResponse::Zero();  // of the displacement
};

struct MeanOfSwings {
  Vector6d displacement = Vector6d::Zero();  // of the mean, against the calibration
  Matrix6d covariance = NotYet<Matrix6d>();  // of it, by the readings' scatter
  FieldResponse field_response = FieldResponse::Zero();
  std::vector<ArmShare> shares;  // the calibration's own first
};

// Best linear estimate where the arm's places are independent draws of `spread` about their mean; each series counts by its spread and
// by what its scans' noise adds (of one height a turn about Y is hardly seen). INVALID_ARGUMENT for no scan, one of the calibration's own
// series or of none, or what is not finite.
absl::StatusOr<MeanOfSwings> FindMeanOfSwings(const std::string& calibrated_series, const std::vector<SwungScan>& scans,
                                              const ArmSpread& spread);

// The sensor as it stands on the mean.
SensorPose Moved(const SensorPose& calibrated, const MeanOfSwings& mean);

// What `scan` shows, the artefact standing as it was calibrated; of_calibration: what the calibration's own scans show, fitted in the
// same way, against which it is held.
SwungScan Apart(const std::string& arm_series, const ArtefactFit& scan, const std::vector<ArtefactFit>& of_calibration);

}  // namespace sixpoint::metrology

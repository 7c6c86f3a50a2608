// Whether a scanner still stands as it was calibrated: the artefact, scanned again, beside the calibration's own scans of it
// (docs/methods/studies.md, interim check).
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/studies/arm_study.h"
#include "metrology/studies/artefact_fit.h"
#include "metrology/studies/study_verdict.h"

namespace sixpoint::metrology {

// How far a place of the measuring field is displaced, machine axes.
struct PlaceDisplacement {
  double y_mm = 0, z_mm = 0;  // sensor frame
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
  double distance_mm = 0;
  // The true distance is less than distance_mm + upper_mm, and more than distance_mm - upper_mm, with 95 % each.
  double upper_mm = 0;
};

struct InterimCheck {
  // Of the sensor against the calibration's scans, as ArmDisplacement has them.
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
  CardanAngles angles;
  SensorCovariance covariance = NotYet<SensorCovariance>();  // order of kSensorParameters
  std::vector<PlaceDisplacement> places;                     // the measuring field's middle, then its corners
  std::size_t worst = 0;                                     // of the places: the greatest distance with its bound
  int swing_count = 0;                                       // series of the new scans that the calibration has none of
  // ACCEPTED: no place is displaced by more than the limit, REJECTED: one is; each by 95 %.
  StudyVerdict verdict = StudyVerdict::kReported;
};

// One of the scans that the calibration was made from.
struct ReferenceScan {
  std::string arm_series;  // empty: not known
  ArtefactFit fit;         // of the sensor, the artefact standing as this scan shows it
};
// What a new scan says of the sensor, beside one of them.
struct CheckedScan {
  std::size_t scan = 0;    // which of the new ones
  std::string arm_series;  // empty: not known
  std::size_t reference = 0;
  ArtefactFit fit;  // of the sensor, the artefact standing as the reference shows it
};

struct InterimCheckOptions {
  double limit_mm = 0;  // 0: none stated
  // Of the scanner's field, or of what is left of it; what both scans share cancels.
  FieldCovariance field_covariance_mm2 = NotYet<FieldCovariance>();
  std::optional<ArmSpread> arm;  // none: it does not move
};

// Scans of one series are weighed by what each tells (so that two heights show a turn that neither does), series alike. The arm stood
// once for each series, of the new scans and of the calibration's; those that are not known are one each. Every new series is held against
// every one of the calibration. INVALID_ARGUMENT where that is not so, for no scan, a sensor without a measuring field or what is not finite.
absl::StatusOr<InterimCheck> CheckInterim(const std::vector<CheckedScan>& scans,
                                          const std::vector<ReferenceScan>& references,
                                          const InterimCheckOptions& options);

}  // namespace sixpoint::metrology

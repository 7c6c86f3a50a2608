// Results of studies as messages, and recorded studies as messages.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/statistics/spread.h"
#include "metrology/studies/arm_study.h"
#include "metrology/studies/gauge_study.h"
#include "metrology/studies/interim_check.h"
#include "metrology/studies/nested_variance.h"
#include "metrology/studies/sphere_check.h"
#include "metrology/studies/study_verdict.h"
#include "sixpoint/calibration/v1/study.pb.h"
#include "storage/calibrations.h"
#include "storage/studies.h"

namespace sixpoint::calibration {

// The messages' words, without the enums' prefixes: "GAUGE", "ACCEPTED"; empty for UNSPECIFIED.
std::string KindText(v1::StudyKind kind);
std::string VerdictText(v1::StudyVerdict verdict);
v1::StudyVerdict ToProto(metrology::StudyVerdict verdict);

v1::GaugeStudy ToProto(const metrology::GaugeStudy& study, double limit_um);
v1::ArmStudy ToProto(const std::vector<metrology::ArmDisplacement>& displacements, double limit_um);
// The greatest standard deviation of dx, dy, dz against its limit.
v1::StudyVerdict VerdictOf(const v1::ArmStudy& study);
// Sensor calibrations, with their residuals.
v1::RepeatStudy RepeatOf(const std::vector<storage::CalibrationRow>& calibrations);
v1::GaugeRr ToProto(const metrology::NestedVariance& analysis, const v1::RunGaugeRrRequest& request);
v1::SphereCheck ToProto(const metrology::SphereCheck& check);
// said: what it concerns.
v1::InterimCheck ToProto(const metrology::InterimCheck& check, const v1::InterimCheck& said);

// DATA_LOSS where what is stored cannot be read.
absl::StatusOr<v1::Study> ToProto(const storage::StudyRow& row);

}  // namespace sixpoint::calibration

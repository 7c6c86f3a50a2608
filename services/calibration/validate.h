// What requests must be: checks only, each refusal naming field, value and what was wanted. What was measured is checked where it
// is read (readings.h).
#pragma once

#include <absl/status/status.h>

#include <string>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/calibration/v1/study.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::calibration {

// "poses", 3 -> "poses[3]".
std::string Indexed(const std::string& field, int i);
absl::Status CheckCount(const std::string& field, int count, int least);
absl::Status CheckUncertainty(double value_um);

// Names, counts, method and environment.
absl::Status CheckRequest(const v1::CalibrateSensorRequest& request);
absl::Status CheckRequest(const v1::StateSensorPoseRequest& request);
absl::Status CheckRequest(const v1::CalibrateRotationRequest& request);
absl::Status CheckRequest(const v1::CalibrateProbeRequest& request);
absl::Status CheckRequest(const v1::CharacteriseAxisRequest& request);
// The scan shows the artefact, from this machine, standing as in the first scan, by profiles.
absl::Status CheckScan(const v1::CalibrateSensorRequest& request, const ingest::v1::Scan& scan,
                       const ingest::v1::Scan& first);

absl::Status CheckRequest(const v1::WithdrawCalibrationRequest& request);
// Its numbers; what it names is known only with the calibrations.
absl::Status CheckRequest(const v1::GetCalibrationTrendRequest& request);

absl::Status CheckRequest(const v1::RunGaugeStudyRequest& request);
absl::Status CheckRequest(const v1::RunArmStudyRequest& request);
absl::Status CheckRequest(const v1::RunRepeatStudyRequest& request);
absl::Status CheckRequest(const v1::RunGaugeRrRequest& request);
absl::Status CheckRequest(const v1::RunSphereCheckRequest& request);
absl::Status CheckRequest(const v1::RunInterimCheckRequest& request);
// The scan is of the first one's machine and artefact, at its A and B, by profiles; arm_only: of kind arm, else arm or artefact.
absl::Status CheckStudyScan(const ingest::v1::Scan& scan, const ingest::v1::Scan& first, bool arm_only);

}  // namespace sixpoint::calibration

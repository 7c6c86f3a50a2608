// Studies, trends and withdrawals as people read them.
#pragma once

#include <string>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/calibration/v1/study.pb.h"

namespace sixpoint::cli {

// "gauge", "gauge-rr"; "ACCEPTED".
std::string StudyKindText(calibration::v1::StudyKind kind);
std::string StudyVerdictName(calibration::v1::StudyVerdict verdict);

// Every number beside its standard uncertainty, and the thesis's figures beside where it prints them.
std::string StudyText(const calibration::v1::Study& study);
std::string TrendText(const calibration::v1::CalibrationTrend& trend);
std::string WithdrawalText(const calibration::v1::WithdrawCalibrationResponse& response);

}  // namespace sixpoint::cli

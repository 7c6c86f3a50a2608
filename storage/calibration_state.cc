#include "storage/calibration_state.h"

namespace sixpoint::storage {

CalibrationState StateOf(const CalibrationRow& c, const std::string& in_force, Instant now) {
  if (c.withdrawal) return CalibrationState::kWithdrawn;
  if (c.is_draft && !c.release) return CalibrationState::kDraft;
  if (now < c.valid_from) return CalibrationState::kNotYetValid;
  if (now >= c.valid_until) return CalibrationState::kExpired;
  return in_force == c.calibration_id ? CalibrationState::kInForce : CalibrationState::kSuperseded;
}

const char* StateText(CalibrationState state) {
  switch (state) {
    case CalibrationState::kDraft:
      return "DRAFT";
    case CalibrationState::kNotYetValid:
      return "NOT_YET_VALID";
    case CalibrationState::kInForce:
      return "IN_FORCE";
    case CalibrationState::kSuperseded:
      return "SUPERSEDED";
    case CalibrationState::kExpired:
      return "EXPIRED";
    case CalibrationState::kWithdrawn:
      break;
  }
  return "WITHDRAWN";
}

}  // namespace sixpoint::storage

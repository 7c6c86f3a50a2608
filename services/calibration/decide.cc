#include "services/calibration/decide.h"

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"

namespace sixpoint::calibration {
namespace {

using storage::CalibrationState;

absl::Status CheckNotWithdrawn(const storage::CalibrationRow& row, const std::string& name, const std::string& wanted) {
  if (!row.withdrawal) return absl::OkStatus();
  return runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN,
                          "name: " + name + ", withdrawn by " + row.withdrawal->requested_by + " (" +
                              row.withdrawal->reason + "), want " + wanted,
                          {{"resource", name}});
}

absl::Status CheckReleasable(const storage::CalibrationRow& row, const std::string& name) {
  if (absl::Status s = CheckNotWithdrawn(row, name, "a draft"); !s.ok()) return s;
  if (row.state != CalibrationState::kDraft)
    return runtime::Failure(
        errors::v1::CALIBRATION_NOT_A_DRAFT,
        "name: " + name + (row.is_draft ? ", released already" : ", never a draft") + ", want a draft",
        {{"resource", name}});
  if (row.as_of >= row.valid_until)
    return runtime::Failure(errors::v1::CALIBRATION_EXPIRED,
                            "name: " + name + ", its validity is over, want one that is still valid",
                            {{"resource", name}});
  return absl::OkStatus();
}

// `may` is asked of the calibration as it is when it is decided about.
template <typename Request>
absl::StatusOr<storage::CalibrationDecision> DecisionOf(
    const Request& request, const std::string& requested_by,
    std::function<absl::Status(const storage::CalibrationRow&)> may) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "calibrations", request.name());
  if (!id.ok()) return id.status();
  storage::CalibrationDecision decision;
  decision.calibration_id = *id;
  decision.event = {request.reason(), requested_by, runtime::SoftwareVersion(), {}};
  decision.check = [name = request.name(),
                    may = std::move(may)](const std::optional<storage::CalibrationRow>& calibration) {
    return calibration ? may(*calibration) : NotRecorded(name);
  };
  return decision;
}

}  // namespace

absl::StatusOr<storage::CalibrationDecision> Decide(const v1::ReleaseCalibrationRequest& request,
                                                    const std::string& requested_by) {
  return DecisionOf(request, requested_by,
                    [name = request.name()](const storage::CalibrationRow& row) { return CheckReleasable(row, name); });
}

absl::StatusOr<storage::CalibrationDecision> Decide(const v1::WithdrawCalibrationRequest& request,
                                                    const std::string& requested_by) {
  return DecisionOf(request, requested_by, [name = request.name()](const storage::CalibrationRow& row) {
    return CheckNotWithdrawn(row, name, "one that is not");
  });
}

absl::Status NotRecorded(const std::string& name) {
  return runtime::Failure(errors::v1::CALIBRATION_NOT_FOUND, "name: " + name + ", want a calibration that is recorded",
                          {{"resource", name}});
}

}  // namespace sixpoint::calibration

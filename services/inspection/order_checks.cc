#include "services/inspection/order_checks.h"

#include "exchange/text.h"
#include "services/runtime/errors.h"

namespace sixpoint::inspection {

std::string At(const char* field, int index) { return std::string(field) + "[" + std::to_string(index) + "]"; }

absl::Status CheckCalled(const std::string& field, const std::string& called, std::set<std::string>* before) {
  if (called.empty()) return runtime::Refuse(field, "", "1 to 200 bytes");
  // Also what no file format of exchange/ could carry.
  if (called.find_first_of("\t\n\r") != std::string::npos || !exchange::IsPlainText(called))
    return runtime::Refuse(field, "text with control characters", "text without them");
  if (called.front() == ' ' || called.back() == ' ')
    return runtime::Refuse(field, called, "a name without blanks before or after it");
  if (!before->insert(called).second) return runtime::Refuse(field, called, "another one: it is used before");
  return absl::OkStatus();
}

absl::Status CheckCorner(const std::string& field, const absl::StatusOr<Eigen::Vector3d>& corner_mm) {
  if (!corner_mm.ok() || corner_mm->cwiseAbs().maxCoeff() < 1e6) return absl::OkStatus();
  return runtime::Refuse(field, corner_mm->cwiseAbs().maxCoeff(), "coordinates within 1000000 mm");
}

}  // namespace sixpoint::inspection

#include "services/runtime/work_order.h"

#include <algorithm>
#include <cctype>
#include <cstring>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

constexpr std::size_t kMostBytes = 64;

absl::Status CheckForm(const char* field, const std::string& id) {
  const auto is_allowed = [](unsigned char c) {
    return std::isalnum(c) != 0 || (c != 0 && std::strchr("._:/-", c) != nullptr);
  };
  if (id.size() <= kMostBytes && std::all_of(id.begin(), id.end(), is_allowed)) return absl::OkStatus();
  return Refuse(field, id, "1 to 64 of A-Z, a-z, 0-9, '.', '_', ':', '/', '-'");
}

}  // namespace

absl::Status CheckWorkOrder(const std::string& work_order, const std::string& operation) {
  Refusals refusals;
  refusals.Add(CheckForm("work_order", work_order));
  refusals.Add(CheckForm("operation", operation));
  if (work_order.empty() && !operation.empty())
    refusals.Add(Refuse("operation", operation, "none without a work order"));
  return refusals.status();
}

}  // namespace sixpoint::runtime

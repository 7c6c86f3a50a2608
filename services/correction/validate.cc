#include "services/correction/validate.h"

#include <algorithm>
#include <set>

#include "services/runtime/errors.h"
#include "services/runtime/limits.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {
namespace {

constexpr int kGreatestGroupCount = 1000;

}  // namespace

absl::Status CheckCorrect(const v1::CorrectRequest& request) {
  const absl::StatusOr<std::string> id = runtime::IdOf("registration", "registrations", request.registration());
  runtime::Refusals refusals;
  refusals.Add(id.ok() ? runtime::CheckUuid("registration", *id) : id.status());
  if (request.groups_size() > kGreatestGroupCount)
    refusals.Add(runtime::Refuse("groups", std::to_string(request.groups_size()) + " groups", "at most 1000"));
  std::set<std::string> seen;
  for (int i = 0; i < std::min(request.groups_size(), kGreatestGroupCount); ++i) {
    const std::string field = "groups[" + std::to_string(i) + "]";
    if (request.groups(i).empty())
      refusals.Add(runtime::Refuse(field, "", "the name of a hole group"));
    else if (!seen.insert(request.groups(i)).second)
      refusals.Add(runtime::Refuse(field, request.groups(i), "each group once"));
  }
  refusals.Add(runtime::CheckText("nc_template", request.nc_template(), kGreatestTemplate_bytes));
  return refusals.Add(runtime::CheckCaller(request.requested_by(), request.request_id())).status();
}

}  // namespace sixpoint::correction

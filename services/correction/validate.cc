#include "services/correction/validate.h"

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
  if (!id.ok()) return id.status();
  if (absl::Status status = runtime::CheckUuid("registration", *id); !status.ok()) return status;
  if (request.groups_size() > kGreatestGroupCount)
    return runtime::Refuse("groups", std::to_string(request.groups_size()) + " groups", "at most 1000");
  std::set<std::string> seen;
  for (int i = 0; i < request.groups_size(); ++i) {
    const std::string field = "groups[" + std::to_string(i) + "]";
    if (request.groups(i).empty()) return runtime::Refuse(field, "", "the name of a hole group");
    if (!seen.insert(request.groups(i)).second) return runtime::Refuse(field, request.groups(i), "each group once");
  }
  if (absl::Status status = runtime::CheckText("nc_template", request.nc_template(), kGreatestTemplate_bytes);
      !status.ok())
    return status;
  return runtime::CheckCaller(request.requested_by(), request.request_id());
}

}  // namespace sixpoint::correction

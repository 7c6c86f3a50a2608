#include "services/correction/validate.h"

#include <set>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {
namespace {

constexpr int kGreatestGroupCount = 1000;
constexpr std::size_t kLongestName = 256;

}  // namespace

absl::StatusOr<std::string> CheckCorrect(const v1::CorrectRequest& request) {
  const absl::StatusOr<std::string> id = runtime::IdOf("registration", "registrations", request.registration());
  if (!id.ok()) return id.status();
  if (absl::Status status = runtime::CheckUuid("registration", *id); !status.ok()) return status;
  if (absl::Status status = runtime::CheckUuid("request_id", request.request_id()); !status.ok()) return status;
  if (request.groups_size() > kGreatestGroupCount)
    return runtime::Refuse("groups", std::to_string(request.groups_size()) + " groups", "at most 1000");
  std::set<std::string> seen;
  for (int i = 0; i < request.groups_size(); ++i) {
    const std::string field = "groups[" + std::to_string(i) + "]";
    if (request.groups(i).empty()) return runtime::Refuse(field, "", "the name of a hole group");
    if (!seen.insert(request.groups(i)).second) return runtime::Refuse(field, request.groups(i), "each group once");
  }
  if (request.requested_by().size() > kLongestName)
    return runtime::Refuse("requested_by", request.requested_by(), "at most 256 bytes");
  if (request.nc_template().size() > static_cast<std::size_t>(kGreatestTemplate_bytes)) {
    return runtime::Refuse("nc_template", std::to_string(request.nc_template().size()) + " bytes",
                           "at most " + std::to_string(kGreatestTemplate_bytes));
  }
  if (request.nc_template().find('\0') != std::string::npos)
    return runtime::Refuse("nc_template", "a NUL byte", "text");
  return id;
}

}  // namespace sixpoint::correction

#include "services/correction/validate.h"

#include <algorithm>
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
  runtime::Refusals refusals;
  refusals.Add(id.ok() ? runtime::CheckUuid("registration", *id) : id.status())
      .Add(runtime::CheckUuid("request_id", request.request_id()));
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
  if (request.requested_by().size() > kLongestName)
    refusals.Add(runtime::Refuse("requested_by", request.requested_by(), "at most 256 bytes"));
  if (request.nc_template().size() > static_cast<std::size_t>(kGreatestTemplate_bytes))
    refusals.Add(runtime::Refuse("nc_template", std::to_string(request.nc_template().size()) + " bytes",
                                 "at most " + std::to_string(kGreatestTemplate_bytes)));
  if (request.nc_template().find('\0') != std::string::npos)
    refusals.Add(runtime::Refuse("nc_template", "a NUL byte", "text"));
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  return id;
}

}  // namespace sixpoint::correction

#include "services/correction/validate.h"

#include <set>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {

absl::Status CheckCorrect(const v1::CorrectRequest& request) {
  const absl::StatusOr<std::string> id = runtime::IdOf("registration", "registrations", request.registration());
  runtime::Refusals refusals;
  refusals.Add(id.ok() ? runtime::CheckUuid("registration", *id) : id.status());
  std::set<std::string> seen;
  for (int i = 0; i < request.groups_size(); ++i) {
    const std::string field = "groups[" + std::to_string(i) + "]";
    if (request.groups(i).empty())
      refusals.Add(runtime::Refuse(field, "", "the name of a hole group"));
    else if (!seen.insert(request.groups(i)).second)
      refusals.Add(runtime::Refuse(field, request.groups(i), "each group once"));
  }
  return refusals.status();
}

}  // namespace sixpoint::correction

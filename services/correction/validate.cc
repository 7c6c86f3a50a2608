#include "services/correction/validate.h"

#include <cmath>
#include <set>
#include <string>
#include <utility>

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
  std::set<std::string> codes;
  for (int i = 0; i < request.work_offsets_size(); ++i) {
    const v1::WorkOffset& one = request.work_offsets(i);
    const std::string field = "work_offsets[" + std::to_string(i) + "]";
    if (one.code().size() != 3 || one.code() < "G54" || one.code() > "G59")
      refusals.Add(runtime::Refuse(field + ".code", one.code(), "G54 to G59"));
    else if (!codes.insert(one.code()).second)
      refusals.Add(runtime::Refuse(field + ".code", one.code(), "each once"));
    for (const auto& [name, value] :
         {std::pair("x_mm", one.x_mm()), std::pair("y_mm", one.y_mm()), std::pair("z_mm", one.z_mm()),
          std::pair("a_deg", one.a_deg()), std::pair("b_deg", one.b_deg())})
      if (!(std::abs(value) <= 1e5)) refusals.Add(runtime::Refuse(field + "." + name, value, "-100000 to 100000"));
  }
  return refusals.status();
}

}  // namespace sixpoint::correction

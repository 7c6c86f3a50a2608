#include "services/runtime/limits.h"

#include <algorithm>
#include <set>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::runtime {

absl::Status CheckText(const std::string& field, const std::string& text, std::size_t longest) {
  if (text.size() > longest)
    return Refuse(field, std::to_string(text.size()) + " bytes", "at most " + std::to_string(longest));
  if (text.find('\0') != std::string::npos) return Refuse(field, "a NUL byte", "text");
  return absl::OkStatus();
}

absl::Status CheckNames(const std::string& field, const std::string& collection,
                        const google::protobuf::RepeatedPtrField<std::string>& names, int least, int most) {
  Refusals refusals;
  if (names.size() < least || names.size() > most)
    refusals.Add(Refuse(field, std::to_string(names.size()) + " " + collection,
                        std::to_string(least) + " to " + std::to_string(most)));
  std::set<std::string> seen;
  for (int i = 0; i < std::min(names.size(), most); ++i) {
    const std::string one = field + "[" + std::to_string(i) + "]";
    refusals.Add(IdOf(one, collection, names[i]).status());
    if (!seen.insert(names[i]).second)
      refusals.Add(Refuse(one, names[i], "each " + collection.substr(0, collection.size() - 1) + " once"));
  }
  return refusals.status();
}

absl::Status CheckCaller(const std::string& requested_by, const std::string& request_id) {
  Refusals refusals;
  refusals.Add(CheckText("requested_by", requested_by, kLongestRequester));
  return refusals.Add(CheckUuid("request_id", request_id)).status();
}

}  // namespace sixpoint::runtime

#include "services/runtime/clearance.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "services/runtime/request_names.h"
#include "sixpoint/access/v1/access.pb.h"

namespace sixpoint::runtime {
namespace {

using google::protobuf::Message;

struct NamedField {
  std::string path, name;
};

// False: there is no such text.
bool AddNames(const Message& request, const std::string& path, std::vector<NamedField>* fields) {
  std::vector<std::string> names;
  const bool is_there = NamesAt(request, path, &names);
  for (std::string& name : names)
    if (!name.empty()) fields->push_back({path, std::move(name)});
  return is_there;
}

}  // namespace

absl::Status Clearance::Check(const google::protobuf::MethodDescriptor& method, const storage::Reader& reader,
                              const Message& request, storage::Deadline deadline) const {
  const access::v1::Rule& rule = method.options().GetExtension(access::v1::rule);
  if (rule.anybody() || rule.no_part() || method.client_streaming()) return absl::OkStatus();
  if (rule.of_part().empty() && rule.filtered()) return absl::OkStatus();
  std::vector<NamedField> fields;
  bool is_whole = !rule.of_part().empty();
  for (const std::string& path : rule.of_part()) is_whole = AddNames(request, path, &fields) && is_whole;
  // Of a rule that does not say what the method is about nothing is known: hidden from whom anything is.
  if (!is_whole) fields.push_back({"request", method.name()});
  std::vector<std::string> names;
  for (const NamedField& field : fields)
    if (std::find(names.begin(), names.end(), field.name) == names.end()) names.push_back(field.name);
  if (names.empty()) return absl::OkStatus();
  const absl::StatusOr<std::optional<std::string>> hidden =
      clearances_->FirstHidden(reader, names, storage::Unrecorded::kIsHidden, deadline);
  if (!hidden.ok()) return hidden.status();
  if (!hidden->has_value()) return absl::OkStatus();
  const auto of =
      std::find_if(fields.begin(), fields.end(), [&](const NamedField& field) { return field.name == **hidden; });
  return storage::NotSeen(of == fields.end() ? "request" : of->path, **hidden, reader);
}

absl::Status CheckSeen(const storage::ClearanceReader& clearances, const storage::Reader& reader,
                       const std::string& field, const std::string& name, storage::Unrecorded unrecorded,
                       storage::Deadline deadline) {
  const absl::StatusOr<std::optional<std::string>> hidden =
      clearances.FirstHidden(reader, {name}, unrecorded, deadline);
  if (!hidden.ok()) return hidden.status();
  return hidden->has_value() ? storage::NotSeen(field, name, reader) : absl::OkStatus();
}

}  // namespace sixpoint::runtime

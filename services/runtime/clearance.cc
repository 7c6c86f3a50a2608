#include "services/runtime/clearance.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "sixpoint/access/v1/access.pb.h"

namespace sixpoint::runtime {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

struct NamedField {
  std::string path, name;
};

// What stands under the path in the message, whatever on its way is repeated. False: there is no such text.
bool AddNames(const Message& message, const std::string& path, std::size_t begin, std::vector<NamedField>* names) {
  const std::size_t dot = path.find('.', begin);
  const auto& reflection = *message.GetReflection();
  const FieldDescriptor* const field = message.GetDescriptor()->FindFieldByName(
      path.substr(begin, dot == std::string::npos ? std::string::npos : dot - begin));
  if (field == nullptr) return false;
  const bool is_message = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  if (is_message == (dot == std::string::npos)) return false;
  if (!is_message && field->cpp_type() != FieldDescriptor::CPPTYPE_STRING) return false;
  const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
  for (int i = 0; i < count; ++i) {
    if (is_message) {
      const Message& inner = field->is_repeated() ? reflection.GetRepeatedMessage(message, field, i)
                                                  : reflection.GetMessage(message, field);
      if (!AddNames(inner, path, dot + 1, names)) return false;
    } else {
      std::string name =
          field->is_repeated() ? reflection.GetRepeatedString(message, field, i) : reflection.GetString(message, field);
      if (!name.empty()) names->push_back({path, std::move(name)});
    }
  }
  return true;
}

}  // namespace

absl::Status Clearance::Check(const google::protobuf::MethodDescriptor& method, const storage::Reader& reader,
                              const Message& request, storage::Deadline deadline) const {
  const access::v1::Rule& rule = method.options().GetExtension(access::v1::rule);
  if (rule.anybody() || rule.no_part() || method.client_streaming()) return absl::OkStatus();
  if (rule.of_part().empty() && rule.filtered()) return absl::OkStatus();
  std::vector<NamedField> fields;
  bool is_whole = !rule.of_part().empty();
  for (const std::string& path : rule.of_part()) is_whole = AddNames(request, path, 0, &fields) && is_whole;
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

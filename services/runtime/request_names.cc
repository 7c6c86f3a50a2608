#include "services/runtime/request_names.h"

namespace sixpoint::runtime {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

bool AddNames(const Message& message, const std::string& path, std::size_t begin, std::vector<std::string>* names) {
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
      names->push_back(field->is_repeated() ? reflection.GetRepeatedString(message, field, i)
                                            : reflection.GetString(message, field));
    }
  }
  return true;
}

}  // namespace

bool NamesAt(const Message& request, const std::string& path, std::vector<std::string>* names) {
  return AddNames(request, path, 0, names);
}

}  // namespace sixpoint::runtime

// protobuf's own JSON writes 64-bit integers as text and leaves out zeros: a program that reads it must know which is which.
#include "cli/message_json.h"

#include <absl/strings/escaping.h>
#include <google/protobuf/util/json_util.h>

#include <nlohmann/json.hpp>
#include <string>

namespace sixpoint::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// Times and free-form values have a JSON of their own.
nlohmann::json WellKnownToJson(const Message& message) {
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(message, &text).ok()) return nullptr;
  return nlohmann::json::parse(text, nullptr, false);
}

nlohmann::json TextToJson(const FieldDescriptor& field, const std::string& value) {
  return field.type() == FieldDescriptor::TYPE_BYTES ? absl::Base64Escape(value) : value;
}

// One value of a field that is not repeated.
nlohmann::json ValueToJson(const Message& message, const FieldDescriptor& field) {
  const auto& in = *message.GetReflection();
  std::string scratch;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return in.GetInt32(message, &field);
    case FieldDescriptor::CPPTYPE_INT64:
      return in.GetInt64(message, &field);
    case FieldDescriptor::CPPTYPE_UINT32:
      return in.GetUInt32(message, &field);
    case FieldDescriptor::CPPTYPE_UINT64:
      return in.GetUInt64(message, &field);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return in.GetDouble(message, &field);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return in.GetFloat(message, &field);
    case FieldDescriptor::CPPTYPE_BOOL:
      return in.GetBool(message, &field);
    case FieldDescriptor::CPPTYPE_ENUM:
      return in.GetEnum(message, &field)->name();
    case FieldDescriptor::CPPTYPE_STRING:
      return TextToJson(field, in.GetStringReference(message, &field, &scratch));
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return MessageToJson(in.GetMessage(message, &field));
  }
  return nullptr;
}

// The value at one place of a repeated field.
nlohmann::json ValueToJson(const Message& message, const FieldDescriptor& field, int i) {
  const auto& in = *message.GetReflection();
  std::string scratch;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return in.GetRepeatedInt32(message, &field, i);
    case FieldDescriptor::CPPTYPE_INT64:
      return in.GetRepeatedInt64(message, &field, i);
    case FieldDescriptor::CPPTYPE_UINT32:
      return in.GetRepeatedUInt32(message, &field, i);
    case FieldDescriptor::CPPTYPE_UINT64:
      return in.GetRepeatedUInt64(message, &field, i);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return in.GetRepeatedDouble(message, &field, i);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return in.GetRepeatedFloat(message, &field, i);
    case FieldDescriptor::CPPTYPE_BOOL:
      return in.GetRepeatedBool(message, &field, i);
    case FieldDescriptor::CPPTYPE_ENUM:
      return in.GetRepeatedEnum(message, &field, i)->name();
    case FieldDescriptor::CPPTYPE_STRING:
      return TextToJson(field, in.GetRepeatedStringReference(message, &field, i, &scratch));
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return MessageToJson(in.GetRepeatedMessage(message, &field, i));
  }
  return nullptr;
}

}  // namespace

nlohmann::json MessageToJson(const Message& message) {
  const auto& type = *message.GetDescriptor();
  if (type.file()->package() == "google.protobuf") return WellKnownToJson(message);
  nlohmann::json json = nlohmann::json::object();
  for (int k = 0; k < type.field_count(); ++k) {
    const FieldDescriptor& field = *type.field(k);
    if (field.is_repeated()) {
      nlohmann::json values = nlohmann::json::array();
      const int count = message.GetReflection()->FieldSize(message, &field);
      for (int i = 0; i < count; ++i) values.push_back(ValueToJson(message, field, i));
      json[field.name()] = std::move(values);
    } else if (!field.has_presence() || message.GetReflection()->HasField(message, &field)) {
      json[field.name()] = ValueToJson(message, field);
    }
  }
  return json;
}

}  // namespace sixpoint::cli

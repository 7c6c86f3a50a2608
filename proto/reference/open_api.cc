// OpenAPI 3.1 (https://spec.openapis.org/oas/v3.1.0) of what the gateway answers: every method by the Connect protocol, messages as
// protobuf's JSON has them (https://protobuf.dev/programming-guides/json).
#include <nlohmann/json.hpp>

#include "proto/reference/contract.h"
#include "sixpoint/bounds/v1/bounds.pb.h"

namespace sixpoint::reference {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FieldOptions;
using google::protobuf::FileDescriptor;
using google::protobuf::MethodDescriptor;
using nlohmann::ordered_json;

ordered_json RefTo(const std::string& name) { return {{"$ref", "#/components/schemas/" + name}}; }

ordered_json ValueSchema(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL:
      return {{"type", "boolean"}};
    case FieldDescriptor::CPPTYPE_INT32:
    case FieldDescriptor::CPPTYPE_UINT32:
      return {{"type", "integer"}, {"format", "int32"}};
    case FieldDescriptor::CPPTYPE_INT64:
    case FieldDescriptor::CPPTYPE_UINT64:
      return {{"type", "string"}, {"format", "int64"}};
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      return {{"type", "number"}};
    case FieldDescriptor::CPPTYPE_ENUM:
      return RefTo(field.enum_type()->full_name());
    case FieldDescriptor::CPPTYPE_STRING:
      if (field.type() == FieldDescriptor::TYPE_BYTES) return {{"type", "string"}, {"contentEncoding", "base64"}};
      return {{"type", "string"}};
    case FieldDescriptor::CPPTYPE_MESSAGE:
      break;
  }
  const std::string& name = field.message_type()->full_name();
  if (name == "google.protobuf.Timestamp") return {{"type", "string"}, {"format", "date-time"}};
  if (name == "google.protobuf.Duration") return {{"type", "string"}};
  return name.rfind("sixpoint.", 0) == 0 ? RefTo(name) : ordered_json::object();
}

ordered_json FieldSchema(const FieldDescriptor& field) {
  ordered_json schema = ValueSchema(field);
  FieldOptions options;
  options.ParseFromString(field.options().SerializeAsString());
  const auto most_bytes = options.GetExtension(bounds::v1::most_bytes);
  if (most_bytes > 0 && field.type() == FieldDescriptor::TYPE_STRING) schema["maxLength"] = most_bytes;
  if (field.is_repeated()) schema = {{"type", "array"}, {"items", schema}};
  schema["description"] = CommentOf(field);
  return schema;
}

ordered_json MessageSchema(const Descriptor& message) {
  ordered_json schema = {{"type", "object"}, {"description", CommentOf(message)}, {"additionalProperties", false}};
  ordered_json properties = ordered_json::object(), required = ordered_json::array();
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    properties[field.json_name()] = FieldSchema(field);
    if (CommentOf(field).rfind("Required.", 0) == 0 && field.containing_oneof() == nullptr)
      required.push_back(field.json_name());
  }
  schema["properties"] = properties;
  if (!required.empty()) schema["required"] = required;
  return schema;
}

ordered_json EnumSchema(const EnumDescriptor& words) {
  ordered_json names = ordered_json::array();
  std::string text = CommentOf(words);
  for (int i = 0; i < words.value_count(); ++i) {
    names.push_back(words.value(i)->name());
    text += "\n- " + words.value(i)->name() + ": " + CommentOf(*words.value(i));
  }
  return {{"type", "string"}, {"enum", names}, {"description", text}};
}

void AddMessage(const Descriptor& message, ordered_json* schemas) {
  (*schemas)[message.full_name()] = MessageSchema(message);
  for (int i = 0; i < message.nested_type_count(); ++i) AddMessage(*message.nested_type(i), schemas);
  for (int i = 0; i < message.enum_type_count(); ++i)
    (*schemas)[message.enum_type(i)->full_name()] = EnumSchema(*message.enum_type(i));
}

ordered_json Content(const std::string& type, const Descriptor& message) {
  return {{type, {{"schema", RefTo(message.full_name())}}}};
}

ordered_json PathOf(const MethodDescriptor& method) {
  const bool streams = method.server_streaming();
  const std::string type = streams ? "application/connect+json" : "application/json";
  ordered_json call = {
      {"operationId", method.full_name()},
      {"tags", {method.service()->full_name()}},
      {"description", CommentOf(method) + (streams ? " Each message stands behind five bytes (docs/gateway.md)." : "") +
                          "\n\nWho may call it: " + WhoMayCall(method) + "."},
      {"requestBody", {{"required", true}, {"content", Content(type, *method.input_type())}}},
      {"responses",
       {{"200", {{"description", "The answer."}, {"content", Content(type, *method.output_type())}}},
        {"default", {{"$ref", "#/components/responses/Failure"}}}}}};
  ordered_json path = {{"post", call}};
  if (streams || !IsWithoutSideEffects(method)) return path;
  ordered_json get = call;
  get["operationId"] = method.full_name() + ".get";
  get.erase("requestBody");
  get["parameters"] =
      ordered_json::array({{{"name", "encoding"}, {"in", "query"}, {"required", true}, {"schema", {{"const", "json"}}}},
                           {{"name", "message"},
                            {"in", "query"},
                            {"required", true},
                            {"content", Content("application/json", *method.input_type())}}});
  path["get"] = get;
  return path;
}

}  // namespace

std::string OpenApi(const std::vector<const FileDescriptor*>& files, const std::string& doors_json) {
  const ordered_json doors = ordered_json::parse(doors_json);
  ordered_json paths = doors.at("paths"), schemas = ordered_json::object();
  for (const FileDescriptor* const file : files) {
    for (int i = 0; i < file->message_type_count(); ++i) AddMessage(*file->message_type(i), &schemas);
    for (int i = 0; i < file->enum_type_count(); ++i)
      schemas[file->enum_type(i)->full_name()] = EnumSchema(*file->enum_type(i));
    for (int i = 0; i < file->service_count(); ++i)
      for (int j = 0; j < file->service(i)->method_count(); ++j) {
        const MethodDescriptor& method = *file->service(i)->method(j);
        if (!method.client_streaming())
          paths["/" + method.service()->full_name() + "/" + method.name()] = PathOf(method);
      }
  }
  ordered_json components = doors.at("components");
  components["schemas"] = schemas;
  const ordered_json document = {{"openapi", "3.1.0"},
                                 {"info", doors.at("info")},
                                 {"security", doors.at("security")},
                                 {"paths", paths},
                                 {"components", components}};
  return document.dump(1) + "\n";
}

}  // namespace sixpoint::reference

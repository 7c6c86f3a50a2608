// The contract as people read it: docs/api/AREA.md.
#include "proto/reference/contract.h"

namespace sixpoint::reference {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;

// What would end a table's cell, or begin a tag.
std::string Cell(const std::string& text) {
  std::string cell;
  for (const char c : text) {
    if (c == '|')
      cell += "\\|";
    else if (c == '<')
      cell += "&lt;";
    else
      cell += c;
  }
  return cell;
}

// GitHub's anchor of a heading `name`.
std::string Anchor(const std::string& name) {
  std::string anchor;
  for (const char c : name) {
    if (c == '.') continue;
    anchor += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  }
  return anchor;
}

// "sixpoint.plant.v1" of a file; "plant" of that.
std::string AreaOf(const std::string& package) {
  const std::size_t begin = package.find('.') + 1;
  return package.substr(begin, package.find('.', begin) - begin);
}

template <typename Element>
std::string LinkTo(const Element& element, const std::string& package) {
  const std::string& own = element.file()->package();
  if (own.rfind("sixpoint.", 0) != 0) return "`" + element.full_name() + "`";
  const std::string name = element.full_name().substr(own.size() + 1);
  return "[" + name + "](" + (own == package ? "" : AreaOf(own) + ".md") + "#" + Anchor(name) + ")";
}

std::string TypeOf(const FieldDescriptor& field, const std::string& package) {
  const std::string type = field.message_type() != nullptr ? LinkTo(*field.message_type(), package)
                           : field.enum_type() != nullptr  ? LinkTo(*field.enum_type(), package)
                                                           : std::string(field.type_name());
  return (field.is_repeated() ? "repeated " : field.has_optional_keyword() ? "optional " : "") + type;
}

std::string TextOf(const Descriptor& message, const std::string& package) {
  const std::string name = message.full_name().substr(message.file()->package().size() + 1);
  std::string text = "### " + name + "\n" + CommentOf(message) + "\n\n";
  if (message.field_count() > 0) text += "| field | type | |\n|---|---|---|\n";
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    const auto* const choice = field.real_containing_oneof();
    text += "| `" + field.name() + "` | " + TypeOf(field, package) + " | " +
            (choice == nullptr ? "" : "One of `" + choice->name() + "`. ") + Cell(CommentOf(field)) + " |\n";
  }
  return text + "\n";
}

std::string TextOf(const EnumDescriptor& words) {
  const std::string name = words.full_name().substr(words.file()->package().size() + 1);
  std::string text = "### " + name + "\n" + CommentOf(words) + "\n\n| value | |\n|---|---|\n";
  for (int i = 0; i < words.value_count(); ++i)
    text += "| `" + words.value(i)->name() + "` | " + Cell(CommentOf(*words.value(i))) + " |\n";
  return text + "\n";
}

std::string TextOf(const MethodDescriptor& method, const std::string& package) {
  const std::string input = LinkTo(*method.input_type(), package), output = LinkTo(*method.output_type(), package);
  return "### " + method.service()->name() + "." + method.name() + "\n" + (method.client_streaming() ? "stream " : "") +
         input + " → " + (method.server_streaming() ? "stream " : "") + output + "\n\n" + CommentOf(method) +
         "\n\nMay call: " + WhoMayCall(method) + "." + (IsWithoutSideEffects(method) ? " No side effects." : "") +
         "\n\n";
}

std::string MessagesOf(const Descriptor& message, const std::string& package) {
  std::string text = TextOf(message, package);
  for (int i = 0; i < message.nested_type_count(); ++i) text += MessagesOf(*message.nested_type(i), package);
  for (int i = 0; i < message.enum_type_count(); ++i) text += TextOf(*message.enum_type(i));
  return text;
}

}  // namespace

std::string Markdown(const std::vector<const FileDescriptor*>& files, const std::string& package) {
  std::string services, messages, enums;
  for (const FileDescriptor* const file : files) {
    if (file->package() != package) continue;
    for (int i = 0; i < file->service_count(); ++i) {
      const ServiceDescriptor& service = *file->service(i);
      services += "## " + service.name() + "\n" + CommentOf(service) + "\n\n";
      for (int j = 0; j < service.method_count(); ++j) services += TextOf(*service.method(j), package);
    }
    for (int i = 0; i < file->message_type_count(); ++i) messages += MessagesOf(*file->message_type(i), package);
    for (int i = 0; i < file->enum_type_count(); ++i) enums += TextOf(*file->enum_type(i));
  }
  std::string text =
      "# " + package +
      "\n\nWritten from `proto/` by `proto/reference/write`. What holds for all: [README.md](README.md).\n\n" +
      services;
  if (!messages.empty()) text += "## Messages\n\n" + messages;
  if (!enums.empty()) text += "## Words\n\n" + enums;
  return text;
}

}  // namespace sixpoint::reference

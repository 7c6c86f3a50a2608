#include "services/runtime/request_checks.h"

#include <cstdint>
#include <string>
#include <vector>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "sixpoint/bounds/v1/bounds.pb.h"

namespace sixpoint::runtime {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

// Where a field stands in its request; only a refusal writes it out.
struct FieldPlace {
  const FieldPlace* outer = nullptr;
  const FieldDescriptor* field = nullptr;
  int item = -1;  // of a repeated field

  std::string Text() const {
    const std::string own = field->name() + (item < 0 ? "" : "[" + std::to_string(item) + "]");
    return outer == nullptr ? own : outer->Text() + "." + own;
  }
};

std::string AtMost(std::uint32_t most, const std::string& what) {
  return "at most " + std::to_string(most) + " " + what;
}

void CheckMessage(const Message& message, const FieldPlace* outer, Refusals* refusals);

void CheckText(const std::string& text, const FieldPlace& place, Refusals* refusals) {
  const std::uint32_t most_bytes = place.field->options().GetExtension(bounds::v1::most_bytes);
  if (most_bytes > 0 && text.size() > most_bytes)
    refusals->Add(Refuse(place.Text(), std::to_string(text.size()) + " bytes", AtMost(most_bytes, "bytes")));
  else if (place.field->type() == FieldDescriptor::TYPE_STRING && text.find('\0') != std::string::npos)
    refusals->Add(Refuse(place.Text(), "a NUL byte", "text"));
}

void CheckRepeated(const Message& message, const FieldPlace& place, Refusals* refusals) {
  const Reflection& reflection = *message.GetReflection();
  const int size = reflection.FieldSize(message, place.field);
  const std::uint32_t most_items = place.field->options().GetExtension(bounds::v1::most_items);
  if (most_items > 0 && static_cast<std::uint32_t>(size) > most_items) {
    refusals->Add(Refuse(place.Text(), std::to_string(size) + " of them", AtMost(most_items, "of them")));
    return;
  }
  std::string buffer;
  for (int i = 0; i < size; ++i) {
    const FieldPlace item{place.outer, place.field, i};
    if (place.field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
      CheckMessage(reflection.GetRepeatedMessage(message, place.field, i), &item, refusals);
    else if (place.field->cpp_type() == FieldDescriptor::CPPTYPE_STRING)
      CheckText(reflection.GetRepeatedStringReference(message, place.field, i, &buffer), item, refusals);
    else
      return;  // numbers
  }
}

// As deep as protobuf lets a message be, which is a hundred.
void CheckMessage(const Message& message, const FieldPlace* outer, Refusals* refusals) {
  const Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  std::string buffer;
  for (const FieldDescriptor* field : fields) {
    const FieldPlace place{outer, field};
    if (field->is_repeated())
      CheckRepeated(message, place, refusals);
    else if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
      CheckMessage(reflection.GetMessage(message, field), &place, refusals);
    else if (field->cpp_type() == FieldDescriptor::CPPTYPE_STRING)
      CheckText(reflection.GetStringReference(message, field, &buffer), place, refusals);
  }
}

}  // namespace

absl::Status CheckBounds(const Message& request) {
  Refusals refusals;
  CheckMessage(request, nullptr, &refusals);
  return refusals.status();
}

absl::Status CheckRequestId(const google::protobuf::MethodDescriptor& method, const Message& request) {
  const FieldDescriptor* field = request.GetDescriptor()->FindFieldByName("request_id");
  if (field == nullptr || method.options().idempotency_level() == google::protobuf::MethodOptions::NO_SIDE_EFFECTS)
    return absl::OkStatus();
  const std::string request_id = request.GetReflection()->GetString(request, field);
  if (request_id.empty())
    return Refuse("request_id", "", "a UUID of the caller's, the same each time that it repeats this call");
  return CheckUuid("request_id", request_id);
}

}  // namespace sixpoint::runtime

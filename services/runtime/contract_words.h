// Values of the contract's enums as the record's words: their names without the enum's own in front.
#pragma once

#include <absl/status/status.h>
#include <google/protobuf/generated_enum_reflection.h>

#include <string>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {

// "CHARACTERISTIC_CLASS_".
template <typename Enum>
std::string PrefixOf() {
  const std::string unspecified = google::protobuf::GetEnumDescriptor<Enum>()->value(0)->name();
  return unspecified.substr(0, unspecified.size() - std::string("UNSPECIFIED").size());
}

// Empty: unspecified, or nothing that this release knows.
template <typename Enum>
std::string WordOf(Enum value) {
  const auto* const named = google::protobuf::GetEnumDescriptor<Enum>()->FindValueByNumber(value);
  return named == nullptr || value == 0 ? std::string() : named->name().substr(PrefixOf<Enum>().size());
}

// Refuses what has no word.
template <typename Enum>
absl::Status ReadWord(const std::string& field, Enum value, std::string* out) {
  *out = WordOf(value);
  if (!out->empty()) return absl::OkStatus();
  std::string wanted;
  const auto* const all = google::protobuf::GetEnumDescriptor<Enum>();
  for (int i = 1; i < all->value_count(); ++i)
    wanted += (i == 1                        ? ""
               : i + 1 == all->value_count() ? " or "
                                             : ", ") +
              WordOf(static_cast<Enum>(all->value(i)->number()));
  return Refuse(field, value == 0 ? "" : std::to_string(static_cast<int>(value)), wanted);
}

}  // namespace sixpoint::runtime

// Values of the contract's enums that the record keeps as text.
#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace sixpoint::runtime {

// The value of that name, by the enum's own X_Parse. DATA_LOSS where it has none: another release wrote it, or a hand.
// of: whose it is, for the message.
template <typename Enum>
absl::StatusOr<Enum> StoredEnum(bool (*parse)(const std::string&, Enum*), const std::string& name,
                                const std::string& of) {
  Enum value{};
  if (parse(name, &value)) return value;
  return absl::DataLossError(of + ": its " + name + " is none that this release knows");
}

}  // namespace sixpoint::runtime

// Values of the contract's enums that the record keeps as text.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/ascii.h>
#include <google/protobuf/generated_enum_reflection.h>

#include <string>
#include <utility>

#include "services/runtime/contract_words.h"

namespace sixpoint::runtime {

// The value of that word of contract_words.h, in small letters too. DATA_LOSS where there is none: nothing, or what another release
// wrote, or a hand. of: whose it is, for the message.
template <typename Enum>
absl::StatusOr<Enum> StoredEnum(const std::string& word, const std::string& of) {
  const std::string name = PrefixOf<Enum>() + absl::AsciiStrToUpper(word);
  const auto* const named = google::protobuf::GetEnumDescriptor<Enum>()->FindValueByName(name);
  if (named != nullptr && named->number() != 0) return static_cast<Enum>(named->number());
  return absl::DataLossError(of + ": its " + name + " is none that this release knows");
}

// Reads the words of one row, where a message has many: the first that this release does not know is told at the end.
class StoredWords {
 public:
  // of: whose they are, for the message.
  explicit StoredWords(std::string of) : of_(std::move(of)) {}

  // As StoredEnum.
  template <typename Enum>
  Enum Value(const std::string& word) {
    const absl::StatusOr<Enum> value = StoredEnum<Enum>(word, of_);
    if (value.ok()) return *value;
    if (status_.ok()) status_ = value.status();
    return static_cast<Enum>(0);
  }
  // Nothing is UNSPECIFIED.
  template <typename Enum>
  Enum ValueOrNone(const std::string& word) {
    return word.empty() ? static_cast<Enum>(0) : Value<Enum>(word);
  }

  // DATA_LOSS of the first that is not known.
  const absl::Status& status() const { return status_; }
  // The message that was filled from them, where all are known.
  template <typename Message>
  absl::StatusOr<Message> Checked(Message message) const {
    if (!status_.ok()) return status_;
    return message;
  }

 private:
  std::string of_;
  absl::Status status_;
};

}  // namespace sixpoint::runtime

// A text column that may be NULL and, unlike that of Params::OptionalText, empty.
#pragma once

#include <optional>
#include <string>

#include "storage/database.h"

namespace sixpoint::storage {

inline void AddOptionalText(const std::optional<std::string>& text, Params* params) {
  text ? params->Text(*text) : params->Null();
}

}  // namespace sixpoint::storage

// JSON from outside: one value, each key once, no deeper than eight. Private to the room.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

namespace sixpoint::identity {

// None of anything else: of two values under one key each reader takes another. Of a text that is bounded already.
std::optional<nlohmann::json> StrictJsonOf(std::string_view text);

// The member of that name, where it is a text; empty where it is none.
std::optional<std::string> TextIn(const nlohmann::json& object, const char* name);

}  // namespace sixpoint::identity

// JSON Web Tokens (RFC 7519) in their compact form, taken apart; whether one counts is its readers' to say. Private to the room.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "identity/credentials.h"

namespace sixpoint::identity {

struct JsonWebToken {
  nlohmann::json header, claims;  // objects
  std::string_view signed_text;   // within the token
  std::string signature;
};

// None of anything else: three parts of base64url, the first two JSON objects without a key twice.
std::optional<JsonWebToken> JsonWebTokenOf(std::string_view token, std::size_t most_bytes);

// A NumericDate: seconds since 1970, whole.
std::optional<TimePoint> TimeIn(const nlohmann::json& claims, const char* name);

}  // namespace sixpoint::identity

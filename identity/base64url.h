// Bytes as base64url without padding (RFC 4648, 5), one text for the same bytes. Private to the room.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace sixpoint::identity {

std::string ToBase64Url(std::string_view bytes);
// None of what ToBase64Url does not give: padding, other letters, bits beyond the last byte.
std::optional<std::string> FromBase64Url(std::string_view text);

}  // namespace sixpoint::identity

// That a message is from who shares a key with its reader (HMAC, RFC 2104): for readers that have no certificate of the plant.
#pragma once

#include <string>
#include <string_view>

namespace sixpoint::identity {

// 32 random bytes.
std::string NewMessageKey();
// HMAC-SHA256, 32 bytes.
std::string MessageCode(std::string_view key, std::string_view message);

}  // namespace sixpoint::identity

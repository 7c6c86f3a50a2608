// Passwords of people: kept as what argon2id makes of them (RFC 9106, by libargon2), never themselves.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <string>

namespace sixpoint::identity {

inline constexpr std::size_t kShortestPassword_bytes = 12, kLongestPassword_bytes = 128;
// One hashing takes this much memory for some tenths of a second; who calls bounds how many run at once.
inline constexpr unsigned kHash_KiB = 64 * 1024, kHashPasses = 3, kHashLanes = 1;

// 12 to 128 bytes of UTF-8 without control characters. INVALID_ARGUMENT naming the field; it tells a size, never the password.
absl::Status CheckNewPassword(const std::string& field, const std::string& password);

// "$argon2id$v=19$m=65536,t=3,p=1$SALT$HASH" with a random salt. RESOURCE_EXHAUSTED: no memory for it.
absl::StatusOr<std::string> HashPassword(const std::string& password);

// Whether the password is that of such a text. Of an empty one (nobody's account, or one without a password): false, after as much
// work. INTERNAL of a text that is none or wants more than 256 MiB, 10 passes or 4 lanes.
absl::StatusOr<bool> PasswordMatches(const std::string& phc, const std::string& password);

}  // namespace sixpoint::identity

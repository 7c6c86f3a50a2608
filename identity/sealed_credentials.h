// A machine's first certificate: the authority's keeper says a code, the machine fetches the sealed bytes and opens them with it.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <string>

#include "identity/credentials.h"

namespace sixpoint::identity {

// Credentials under a code that is said once: whoever has the code opens them, whoever only carries or keeps them learns nothing and
// changes nothing.
struct SealedCredentials {
  std::string code;  // 128 random bits as base32 (RFC 4648 alphabet) in groups of four: "ABCD-EFGH-..."; kept by nobody
  std::string
      pickup_id;       // lower-case hexadecimal of 32 bytes, made from the code: by it the sealed bytes are asked for
  std::string sealed;  // at most kGreatestSealed_bytes
};
inline constexpr std::size_t kGreatestSealed_bytes = 65536;

// INVALID_ARGUMENT of what Unseal would not believe.
absl::StatusOr<SealedCredentials> Seal(const Credentials& credentials);
// Of a code as a person types it: case, spaces and dashes do not matter, and 0, 1 and 8, which no code has, are taken for O, I and B.
// An L is an L: codes have both. INVALID_ARGUMENT naming --code; it does not repeat the code.
absl::StatusOr<std::string> PickupIdOf(const std::string& code);
// INVALID_ARGUMENT where the code is not theirs or the bytes were changed; nothing of them is believed then. What is opened is the key
// of a certificate that the authority beside it gave.
absl::StatusOr<Credentials> Unseal(const std::string& code, const std::string& sealed);

}  // namespace sixpoint::identity

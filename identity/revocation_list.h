// What an authority took back, as the list that it signs (RFC 5280, CRL version 2). Private to the room.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "identity/certificates.h"

namespace sixpoint::identity {

// A hundred thousand certificates and more.
inline constexpr std::size_t kMostRevoked_bytes = 8 * 1024 * 1024;

struct RevocationList {
  std::uint64_t number = 1;                                  // of each list one more than of the one before
  std::map<std::string, TimePoint, std::less<>> revoked_at;  // by serial
};

// Signed, good until the authority's own end: whoever holds one need not be fetched a new one to go on.
absl::StatusOr<std::string> RevocationListPem(const AuthorityKey& authority, const RevocationList& list,
                                              TimePoint made_at);
// Misread where it is not whole, or not that authority's.
absl::StatusOr<RevocationList> RevocationListOf(std::string_view pem, X509* authority);

}  // namespace sixpoint::identity

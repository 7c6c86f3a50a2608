// A small document from an https address: the keys of an identity provider.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <string>

namespace sixpoint::plant {

// At most `most_bytes` within that time, from a server whose certificate `ca_file` (empty: the system's authorities) vouches for; no
// redirect is followed, and no proxy asked. UNAVAILABLE saying why not.
absl::StatusOr<std::string> FetchByHttps(const std::string& url, const std::string& ca_file, std::size_t most_bytes,
                                         std::chrono::milliseconds patience);

}  // namespace sixpoint::plant

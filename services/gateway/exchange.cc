#include "services/gateway/exchange.h"

#include <absl/strings/escaping.h>
#include <openssl/sha.h>

namespace sixpoint::gateway {

std::string HeaderOf(const Exchange::Head& head, std::string_view name) {
  const auto found = head.find(boost::beast::string_view(name.data(), name.size()));
  return found == head.end() ? "" : std::string(found->value().data(), found->value().size());
}

std::string EtagOf(std::string_view bytes) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest);
  return "\"" + absl::BytesToHexString(std::string(reinterpret_cast<const char*>(digest), 16)) + "\"";
}

}  // namespace sixpoint::gateway

#include "identity/message_code.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>

#include <cstdlib>

namespace sixpoint::identity {

std::string NewMessageKey() {
  std::string key(32, '\0');
  // A key that is not random would be known to others.
  if (RAND_bytes(reinterpret_cast<unsigned char*>(key.data()), static_cast<int>(key.size())) != 1) std::abort();
  return key;
}

std::string MessageCode(std::string_view key, std::string_view message) {
  std::string code(EVP_MAX_MD_SIZE, '\0');
  unsigned int size = 0;
  const unsigned char* const made = HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
                                         reinterpret_cast<const unsigned char*>(message.data()), message.size(),
                                         reinterpret_cast<unsigned char*>(code.data()), &size);
  if (made == nullptr) std::abort();  // out of memory
  code.resize(size);
  return code;
}

}  // namespace sixpoint::identity

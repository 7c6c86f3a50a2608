#include "services/ingest/running_digest.h"

#include <openssl/evp.h>

#include <cstdlib>

namespace sixpoint::ingest {

// OpenSSL fails here only where its SHA-256 is missing or memory is out: nothing to go on with.
RunningDigest::RunningDigest() : context_(EVP_MD_CTX_new()) {
  if (context_ == nullptr || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1) std::abort();
}

void RunningDigest::Add(std::string_view bytes) {
  if (EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) != 1) std::abort();
}

std::string RunningDigest::Finish() {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (EVP_DigestFinal_ex(context_.get(), digest, &length) != 1) std::abort();
  constexpr char kHex[] = "0123456789abcdef";
  std::string text;
  for (unsigned int i = 0; i < length; ++i) {
    text += kHex[digest[i] >> 4];
    text += kHex[digest[i] & 0xf];
  }
  return text;
}

std::string DigestOfDigests(const std::vector<std::string>& digests) {
  const auto nibble = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  RunningDigest all;
  for (const std::string& digest : digests) {
    std::string bytes;
    for (std::size_t i = 0; i + 1 < digest.size(); i += 2) {
      bytes += static_cast<char>(nibble(digest[i]) << 4 | nibble(digest[i + 1]));
    }
    all.Add(bytes);
  }
  return all.Finish();
}

void RunningDigest::Free::operator()(evp_md_ctx_st* context) const { EVP_MD_CTX_free(context); }

}  // namespace sixpoint::ingest

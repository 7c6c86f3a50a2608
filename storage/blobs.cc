#include "storage/blobs.h"

#include <openssl/evp.h>

#include <cstdlib>

#include "storage/blob_rows.h"

namespace sixpoint::storage {
std::string Sha256Hex(std::string_view bytes) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest, &length, EVP_sha256(), nullptr) != 1) std::abort();
  constexpr char kHex[] = "0123456789abcdef";
  std::string text;
  for (unsigned int i = 0; i < length; ++i) {
    text += kHex[digest[i] >> 4];
    text += kHex[digest[i] & 0xf];
  }
  return text;
}

std::string Sha256OfDigests(const std::vector<std::string>& digests) {
  const auto nibble = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  std::string bytes;
  for (const std::string& digest : digests) {
    for (std::size_t i = 0; i + 1 < digest.size(); i += 2) {
      bytes += static_cast<char>(nibble(digest[i]) << 4 | nibble(digest[i + 1]));
    }
  }
  return Sha256Hex(bytes);
}

absl::StatusOr<std::string> PutBlob(Transaction& transaction, std::string_view bytes) {
  const StagedBlob blob{Sha256Hex(bytes), bytes, ""};
  if (absl::Status stored = PutBlobRow(transaction, blob); !stored.ok()) return stored;
  return blob.sha256;
}

absl::StatusOr<std::string> GetBlob(Transaction& transaction, const std::string& sha256) {
  absl::StatusOr<FoundBlob> found = FindBlob(transaction, sha256);
  if (!found.ok()) return found.status();
  if (!found->bytes) return HeldElsewhere(sha256);
  return *std::move(found->bytes);
}

}  // namespace sixpoint::storage

#include "storage/blobs.h"

#include <openssl/evp.h>

#include <cstdlib>

namespace sixpoint::storage {
namespace {

constexpr char kInsertBlob[] =
    "INSERT INTO blobs (sha256, size_bytes, bytes) VALUES ($1, $2, $3) ON CONFLICT (sha256) DO NOTHING";
constexpr char kSelectBlob[] = "SELECT bytes FROM blobs WHERE sha256 = $1";

}  // namespace

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

absl::StatusOr<std::string> PutBlob(Transaction& transaction, std::string_view bytes) {
  const std::string sha256 = Sha256Hex(bytes);
  const absl::StatusOr<Rows> stored =
      transaction.Execute(kInsertBlob, Params().Text(sha256).Int(static_cast<std::int64_t>(bytes.size())).Bytes(bytes));
  if (!stored.ok()) return stored.status();
  return sha256;
}

absl::StatusOr<std::string> GetBlob(Transaction& transaction, const std::string& sha256) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectBlob, Params().Text(sha256));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return absl::NotFoundError("blob " + sha256 + ": not stored");
  std::string bytes = rows->Bytes(0, 0);
  if (const std::string found = Sha256Hex(bytes); found != sha256) {
    return absl::DataLossError("blob " + sha256 + ": the stored bytes have SHA-256 " + found);
  }
  return bytes;
}

}  // namespace sixpoint::storage

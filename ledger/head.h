// The head of a ledger: how many entries it holds, their root, and the signature of a key that the database does not have. As text it
// is one line of JSON, as heads are sent out.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "ledger/tree.h"

namespace sixpoint::ledger {

struct Head {
  std::string plant_id;  // a UUID
  std::int64_t tree_size = 0;
  Hash root;
  std::int64_t record_sequence = 0;  // of the last entry in it
  std::string signed_at;             // 2026-11-25T01:02:03Z
  std::string key_id;                // of whose key it is: KeyIdOf
  std::string signature;             // 64 bytes
};

// What is signed.
std::string SignedText(const Head& head);
std::string JsonLineOf(const Head& head);  // without its end of line
// INVALID_ARGUMENT of what is none.
absl::StatusOr<Head> HeadOfJson(const std::string& line);
// The heads of a file, in its order; a last line without an end counts where it is whole. A refusal names the line.
absl::StatusOr<std::vector<Head>> ReadHeads(const std::string& path);
// The last of them without reading the rest; size 0: there is none yet.
absl::StatusOr<Head> LastHead(const std::string& path);
// One line more, on the disk once it returns OK; none where the last head is of as many entries or more.
absl::Status AppendHead(const std::string& path, const Head& head);

// Ed25519. The private key stays in the object.
class SigningKey {
 public:
  // A new one, as PKCS 8 PEM.
  static absl::StatusOr<std::string> NewPem();
  // A file that its owner alone may read: another mode is refused, since a key that others read signs for them.
  static absl::StatusOr<SigningKey> Read(const std::string& path);
  static absl::StatusOr<SigningKey> OfPem(const std::string& pem);
  // A new one in that file, where there is none; what public_pem() says of it stands beside, in public.pem.
  static absl::Status MakeFile(const std::string& path);
  SigningKey(SigningKey&&) noexcept;
  ~SigningKey();

  const std::string& public_pem() const { return public_pem_; }
  const std::string& key_id() const { return key_id_; }
  // With key_id and signature set.
  absl::StatusOr<Head> Sign(Head head) const;

 private:
  explicit SigningKey(void* key) : key_(key) {}
  void* key_;  // EVP_PKEY
  std::string public_pem_, key_id_;
};

// SHA-256 of the public key's DER form, the first 16 hexadecimal digits. INVALID_ARGUMENT of what is no Ed25519 public key in PEM.
absl::StatusOr<std::string> KeyIdOf(const std::string& public_pem);
bool IsSignedBy(const Head& head, const std::string& public_pem);

}  // namespace sixpoint::ledger

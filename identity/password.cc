#include "identity/password.h"

#include <argon2.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <array>
#include <cstdio>
#include <string_view>

#include "identity/openssl_objects.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

constexpr std::size_t kSalt_bytes = 16, kHash_bytes = 32, kLongestPhc_bytes = 256;
constexpr unsigned kMostHash_KiB = 256 * 1024, kMostPasses = 10, kMostLanes = 4;

absl::Status FailureOf(int code) {
  const std::string what = std::string("password: ") + argon2_error_message(code);
  return code == ARGON2_MEMORY_ALLOCATION_ERROR ? absl::ResourceExhaustedError(what) : absl::InternalError(what);
}

// What a row says is not let decide how much memory this process takes.
bool IsWithinBounds(const std::string& phc) {
  unsigned memory_KiB = 0, passes = 0, lanes = 0;
  int end = 0;
  return phc.size() <= kLongestPhc_bytes &&
         std::sscanf(phc.c_str(), "$argon2id$v=19$m=%9u,t=%9u,p=%9u$%n", &memory_KiB, &passes, &lanes, &end) == 3 &&
         end > 0 && memory_KiB <= kMostHash_KiB && passes <= kMostPasses && lanes <= kMostLanes;
}

}  // namespace

absl::Status CheckNewPassword(const std::string& field, const std::string& password) {
  constexpr char kWanted[] = "12 to 128 bytes of UTF-8 without control characters";
  if (password.size() < kShortestPassword_bytes || password.size() > kLongestPassword_bytes)
    return Refuse(field, std::to_string(password.size()) + " bytes", kWanted);
  // Tame changes just these.
  if (Tame(password, kLongestPassword_bytes) != password) return Refuse(field, "with others", kWanted);
  return absl::OkStatus();
}

absl::StatusOr<std::string> HashPassword(const std::string& password) {
  const OwnErrors errors;
  std::array<unsigned char, kSalt_bytes> salt{};
  if (RAND_bytes(salt.data(), static_cast<int>(salt.size())) != 1) return OpenSslError("a salt");
  std::string phc(argon2_encodedlen(kHashPasses, kHash_KiB, kHashLanes, kSalt_bytes, kHash_bytes, Argon2_id), '\0');
  const int code = argon2id_hash_encoded(kHashPasses, kHash_KiB, kHashLanes, password.data(), password.size(),
                                         salt.data(), salt.size(), kHash_bytes, phc.data(), phc.size());
  if (code != ARGON2_OK) return FailureOf(code);
  phc.resize(phc.find('\0'));
  return phc;
}

absl::StatusOr<bool> PasswordMatches(const std::string& phc, const std::string& password) {
  if (phc.empty()) {
    constexpr std::array<unsigned char, kSalt_bytes> kNobodysSalt{};
    std::array<unsigned char, kHash_bytes> hash{};
    const int code = argon2id_hash_raw(kHashPasses, kHash_KiB, kHashLanes, password.data(), password.size(),
                                       kNobodysSalt.data(), kNobodysSalt.size(), hash.data(), hash.size());
    OPENSSL_cleanse(hash.data(), hash.size());
    if (code != ARGON2_OK) return FailureOf(code);
    return false;
  }
  if (!IsWithinBounds(phc)) return absl::InternalError("password: kept as something else than argon2id within bounds");
  const int code = argon2id_verify(phc.c_str(), password.data(), password.size());
  if (code == ARGON2_OK) return true;
  if (code == ARGON2_VERIFY_MISMATCH) return false;
  return FailureOf(code);
}

}  // namespace sixpoint::identity

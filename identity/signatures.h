// Signatures of texts, by OpenSSL. Private to the room.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <string_view>

#include "identity/openssl_objects.h"

namespace sixpoint::identity {

bool IsP256(const EVP_PKEY* key);
bool IsRsa(const EVP_PKEY* key);

// ECDSA with P-256 and SHA-256, as r and s of 32 bytes each (RFC 7518, 3.4). Of the two values of s that hold, the lesser is given.
absl::StatusOr<std::string> SignEs256(EVP_PKEY* key, std::string_view text);
enum class EitherS { kTaken, kLesserOnly };  // kLesserOnly: one signature, one text
bool VerifiesEs256(EVP_PKEY* key, std::string_view text, std::string_view signature, EitherS either);

// RSA with SHA-256: PKCS #1 v1.5 (RS256), or PSS with a salt of 32 bytes (PS256; RFC 7518, 3.5).
enum class RsaPadding { kPkcs1, kPss };
bool VerifiesRsa(EVP_PKEY* key, RsaPadding padding, std::string_view text, std::string_view signature);

}  // namespace sixpoint::identity

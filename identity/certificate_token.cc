#include "identity/certificate_token.h"

#include <chrono>
#include <nlohmann/json.hpp>

#include "identity/authority_folder.h"
#include "identity/base64url.h"
#include "identity/certificates.h"
#include "identity/files.h"
#include "identity/json_web_token.h"
#include "identity/session.h"
#include "identity/signatures.h"
#include "identity/strict_json.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

using nlohmann::json;

constexpr char kAudience[] = "sixpoint";
// Of every JSON object's base64url.
constexpr std::string_view kBegin = "eyJ";

std::int64_t SecondsOf(TimePoint time) {
  return std::chrono::duration_cast<std::chrono::seconds>(time.time_since_epoch()).count();
}

// x5c has base64 as mail has it: other letters for two of them, and padding.
std::string ToBase64(const std::string& bytes) {
  std::string text = ToBase64Url(bytes);
  for (char& c : text) c = c == '-' ? '+' : c == '_' ? '/' : c;
  text.append((4 - text.size() % 4) % 4, '=');
  return text;
}

std::optional<std::string> FromBase64(std::string text) {
  if (text.size() % 4 != 0) return std::nullopt;
  for (int padding = 0; padding < 2 && !text.empty() && text.back() == '='; ++padding) text.pop_back();
  for (char& c : text) {
    if (c == '-' || c == '_') return std::nullopt;
    c = c == '+' ? '-' : c == '/' ? '_' : c;
  }
  return FromBase64Url(text);
}

// The certificate that signed; others of its chain are no use here, for the authority itself gave it.
Certificate CertificateIn(const json& header) {
  const auto chain = header.find("x5c");
  if (chain == header.end() || !chain->is_array() || chain->empty() || !(*chain)[0].is_string()) return nullptr;
  const std::optional<std::string> der = FromBase64((*chain)[0].get<std::string>());
  return der ? CertificateOfDer(*der) : nullptr;
}

}  // namespace

absl::StatusOr<std::string> SignCertificateToken(const std::filesystem::path& identity_file, TimePoint since,
                                                 TimePoint until) {
  const OwnErrors errors;
  if (until <= since || until > since + kLongestToken)
    return Refuse("until", std::to_string(SecondsOf(until) - SecondsOf(since)) + " s", "at most 15 minutes");
  const absl::StatusOr<OwnKey> own = ReadOwnKey(identity_file);
  if (!own.ok()) return own.status();
  const absl::StatusOr<std::string> der = DerOf(own->certificate.get());
  if (!der.ok()) return der.status();
  const json header = {{"alg", "ES256"}, {"typ", "JWT"}, {"x5c", {ToBase64(*der)}}};
  const json claims = {{"aud", kAudience}, {"iat", SecondsOf(since)}, {"exp", SecondsOf(until)}};
  std::string token = ToBase64Url(header.dump()) + "." + ToBase64Url(claims.dump());
  const absl::StatusOr<std::string> signature = SignEs256(own->key.get(), token);
  if (!signature.ok()) return InFile(identity_file, signature.status());
  token += "." + ToBase64Url(*signature);
  if (token.size() <= kLongestSession_bytes) return token;
  return Refuse("token", std::to_string(token.size()) + " bytes", "at most 4096");
}

bool IsCertificateToken(std::string_view token) { return token.substr(0, kBegin.size()) == kBegin; }

std::optional<CertificateToken> ReadCertificateToken(std::string_view token) {
  const OwnErrors errors;
  const std::optional<JsonWebToken> parts = JsonWebTokenOf(token, kLongestSession_bytes);
  if (!parts || TextIn(parts->header, "alg") != "ES256" || TextIn(parts->header, "typ") != "JWT" ||
      parts->header.contains("crit") || parts->header.contains("b64") || TextIn(parts->claims, "aud") != kAudience)
    return std::nullopt;
  const std::optional<TimePoint> since = TimeIn(parts->claims, "iat"), until = TimeIn(parts->claims, "exp");
  const Certificate certificate = CertificateIn(parts->header);
  EVP_PKEY* const key = certificate == nullptr ? nullptr : X509_get0_pubkey(certificate.get());
  if (!since || !until || key == nullptr || !IsP256(key) ||
      !VerifiesEs256(key, parts->signed_text, parts->signature, EitherS::kTaken))
    return std::nullopt;
  absl::StatusOr<std::string> pem = PemOf(certificate.get());
  if (!pem.ok()) return std::nullopt;
  return CertificateToken{*std::move(pem), *since, *until};
}

}  // namespace sixpoint::identity

#include "services/gateway/sign_in_ticket.h"

#include <absl/strings/escaping.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_split.h>
#include <openssl/crypto.h>
#include <openssl/sha.h>

#include <algorithm>
#include <vector>

#include "identity/message_code.h"

namespace sixpoint::gateway {
namespace {

constexpr std::size_t kLongestPath_bytes = 1024, kLongestText_bytes = 2048;
// Another layout would be another word.
constexpr char kBegin[] = "t1";
// Each use of the key its own, so that who sees one code knows nothing of the others.
constexpr char kTicketUse[] = "ticket ", kStateUse[] = "state ", kNonceUse[] = "nonce ", kVerifierUse[] = "verifier ";

std::string CodeText(const std::string& key, const char* use, const std::string& text) {
  return absl::WebSafeBase64Escape(identity::MessageCode(key, use + text));
}

}  // namespace

SignInTickets::SignInTickets() : key_(identity::NewMessageKey()) {}

SignInTicket SignInTickets::New(const std::string& return_path, std::chrono::system_clock::time_point now) {
  return {absl::WebSafeBase64Escape(identity::NewMessageKey()), return_path, now};
}

std::string SignInTickets::TextOf(const SignInTicket& ticket) const {
  const auto begun = std::chrono::duration_cast<std::chrono::seconds>(ticket.begun.time_since_epoch());
  const std::string said = std::string(kBegin) + "." + std::to_string(begun.count()) + "." + ticket.random + "." +
                           absl::WebSafeBase64Escape(ticket.return_path);
  return said + "." + CodeText(key_, kTicketUse, said);
}

std::optional<SignInTicket> SignInTickets::Read(const std::string& text,
                                                std::chrono::system_clock::time_point now) const {
  if (text.size() > kLongestText_bytes) return std::nullopt;
  const std::size_t dot = text.rfind('.');
  if (dot == std::string::npos) return std::nullopt;
  const std::string said = text.substr(0, dot);
  if (!AreSame(text.substr(dot + 1), CodeText(key_, kTicketUse, said))) return std::nullopt;
  // From here on it is the gateway's own word.
  const std::vector<std::string> parts = absl::StrSplit(said, '.');
  SignInTicket ticket;
  long begun_s = 0;
  if (parts.size() != 4 || parts[0] != kBegin || !absl::SimpleAtoi(parts[1], &begun_s) ||
      !absl::WebSafeBase64Unescape(parts[3], &ticket.return_path))
    return std::nullopt;
  ticket.random = parts[2];
  ticket.begun = std::chrono::system_clock::time_point(std::chrono::seconds(begun_s));
  if (now > ticket.begun + kLast || now + kLast < ticket.begun) return std::nullopt;
  return ticket;
}

SignInSecrets SignInTickets::SecretsOf(const SignInTicket& ticket) const {
  return {CodeText(key_, kStateUse, ticket.random), CodeText(key_, kNonceUse, ticket.random),
          CodeText(key_, kVerifierUse, ticket.random)};
}

bool AreSame(const std::string& a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string ChallengeOf(const std::string& verifier) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(verifier.data()), verifier.size(), digest);
  return absl::WebSafeBase64Escape(std::string(reinterpret_cast<const char*>(digest), sizeof digest));
}

bool IsOwnPath(const std::string& path) {
  if (path.empty() || path[0] != '/' || path.size() > kLongestPath_bytes) return false;
  // Browsers read \ as /, and leave out what cannot be seen.
  if (!std::all_of(path.begin(), path.end(), [](char c) { return c > ' ' && c < 0x7f && c != '\\' && c != '#'; }))
    return false;
  const std::string before_query = path.substr(0, path.find('?'));
  // "//host" is another site, and "/.//host" becomes it.
  if (before_query.find("//") != std::string::npos || before_query.find("/.") != std::string::npos) return false;
  const std::string session = "/session";
  const bool is_session = before_query.compare(0, session.size(), session) == 0;
  return !is_session;
}

}  // namespace sixpoint::gateway

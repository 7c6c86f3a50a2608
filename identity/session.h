// Who calls over the gateway. Who signed in, in a text that every service of the plant can check by itself: the plant service signs it with the key of its own
// certificate, and the certificate travels in it. The gateway sends it with each call of that person (runtime/access.h).
// Or who holds a certificate himself (certificate_token.h).
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "identity/credentials.h"
#include "identity/identity.h"
#include "identity/trust.h"

namespace sixpoint::identity {

enum class SignedInBy { kPassword, kOidc, kCertificate };

struct Session {
  Identity person;  // a user; by a certificate a machine too
  SignedInBy signed_in_by = SignedInBy::kPassword;
  TimePoint since;  // the sign-in, by the database's clock; it stays when a session is renewed. Whole microseconds
  TimePoint until;  // of this token; whole microseconds
};

inline constexpr std::size_t kLongestSession_bytes = 4096;
// Of one token, and of a session that is renewed again and again: a shift.
inline constexpr std::chrono::minutes kLongestToken{15};
inline constexpr std::chrono::hours kLongestSession{12};

// By the key of such a file (credentials.h), whose certificate is to be services/plant's; nobody believes another's. INVALID_ARGUMENT
// of a session that nobody would believe.
absl::StatusOr<std::string> SignSession(const Session& session, const std::filesystem::path& identity_file);

// What it says, whoever made it: of a token that was judged already. INVALID_ARGUMENT of a text that is none, without showing it.
absl::StatusOr<Session> ReadSession(std::string_view token);

enum class SessionStanding {
  kGood,
  kNotValid,     // no token, changed, or not signed by the plant's own service
  kOver,         // its time
  kUndecidable,  // as of a certificate
};

struct SessionJudgement {
  SessionStanding standing = SessionStanding::kNotValid;
  Session session;      // of kGood and kOver
  std::string why_not;  // one plain sentence; empty of kGood
};

// Thread-safe. Whether the session was ended by its person or an admin it does not know.
class SessionTrust {
 public:
  // Lives longer. `now`: this computer's clock; a test has its own.
  explicit SessionTrust(Trust* trust, std::function<TimePoint()> now = std::chrono::system_clock::now)
      : trust_(*trust), now_(std::move(now)) {}
  SessionJudgement Judge(std::string_view token);

 private:
  // A token whose signature was found right, and the certificate that it was made with: judged again each time.
  struct Signed {
    Session session;  // of a certificate's own token without the person, whom the certificate names
    std::string certificate_pem;
  };
  SessionJudgement JudgeTimes(const Session& session) const;
  SessionJudgement JudgeOwn(const Session& session, const Judgement& certificate) const;
  std::shared_ptr<const Signed> Read(std::string_view token) const;

  Trust& trust_;
  const std::function<TimePoint()> now_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const Signed>, std::less<>> signed_;
};

}  // namespace sixpoint::identity

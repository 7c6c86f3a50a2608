#include "identity/session.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <shared_mutex>
#include <utility>
#include <vector>

#include "identity/authority_folder.h"
#include "identity/base64url.h"
#include "identity/certificate_token.h"
#include "identity/certificates.h"
#include "identity/files.h"
#include "identity/signatures.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

using std::chrono::microseconds;

constexpr std::string_view kSessionVersion = "s1";
// Before every text that is signed. Longer than what a TLS handshake lets its other side choose of the bytes that this key signs, and
// unlike anything that it signs.
constexpr std::string_view kPurpose =
    "sixpoint session 1: the plant service says who signed in, for services of the same plant alone\n";
constexpr std::size_t kParts = 4, kMostKept = 1024;
constexpr char kPlant[] = "services/plant";
// Services' clocks may differ by this.
constexpr std::chrono::minutes kClocks{1};
constexpr char kWanted[] = "one that this plant gave, unchanged";

std::string WordOf(SignedInBy by) { return by == SignedInBy::kOidc ? "oidc" : "password"; }

std::optional<SignedInBy> SignedInByOf(std::string_view word) {
  for (const SignedInBy by : {SignedInBy::kPassword, SignedInBy::kOidc})
    if (word == WordOf(by)) return by;
  return std::nullopt;
}

std::string MicrosecondsText(TimePoint time) {
  return std::to_string(std::chrono::duration_cast<microseconds>(time.time_since_epoch()).count());
}

std::optional<TimePoint> TimeOfText(std::string_view text) {
  std::int64_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  // Until the year 2200: what a TimePoint holds, and nothing that overflows.
  if (error != std::errc() || end != text.data() + text.size() || count < 0 || count > 7'258'118'400'000'000)
    return std::nullopt;
  return TimePoint(microseconds(count));
}

// Five lines.
std::string PayloadOf(const Session& session) {
  std::string roles;
  for (const Role role : session.person.roles) roles += (roles.empty() ? "" : ",") + RoleText(role);
  return session.person.Text() + "\n" + roles + "\n" + WordOf(session.signed_in_by) + "\n" +
         MicrosecondsText(session.since) + "\n" + MicrosecondsText(session.until);
}

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string_view::npos) return parts;
    begin = end + 1;
  }
}

// None of anything but what PayloadOf gives.
std::optional<Session> SessionOfPayload(const std::string& payload) {
  const std::vector<std::string_view> lines = Split(payload, '\n');
  if (lines.size() != 5) return std::nullopt;
  std::vector<Role> roles;
  for (const std::string_view word : Split(lines[1], ',')) {
    const absl::StatusOr<Role> role = RoleOf("roles", std::string(word));
    if (!role.ok()) return std::nullopt;
    roles.push_back(*role);
  }
  absl::StatusOr<Identity> person = IdentityOf(std::string(lines[0]), roles);
  const std::optional<SignedInBy> by = SignedInByOf(lines[2]);
  const std::optional<TimePoint> since = TimeOfText(lines[3]), until = TimeOfText(lines[4]);
  if (!person.ok() || person->kind != Kind::kUser || !by || !since || !until) return std::nullopt;
  Session session{*std::move(person), *by, *since, *until};
  if (PayloadOf(session) != payload) return std::nullopt;
  return session;
}

struct Parts {
  Session session;
  std::string certificate_der, signature;
  std::string signed_text;
};

std::optional<Parts> PartsOf(std::string_view token) {
  if (token.size() > kLongestSession_bytes) return std::nullopt;
  const std::vector<std::string_view> texts = Split(token, '.');
  if (texts.size() != kParts || texts[0] != kSessionVersion) return std::nullopt;
  const std::optional<std::string> payload = FromBase64Url(texts[1]);
  std::optional<std::string> certificate = FromBase64Url(texts[2]), signature = FromBase64Url(texts[3]);
  if (!payload || !certificate || !signature) return std::nullopt;
  std::optional<Session> session = SessionOfPayload(*payload);
  if (!session) return std::nullopt;
  std::string signed_text(kPurpose);
  signed_text += token.substr(0, token.rfind('.'));
  return Parts{*std::move(session), *std::move(certificate), *std::move(signature), std::move(signed_text)};
}

SessionJudgement NotValid() {
  SessionJudgement judgement;
  judgement.why_not = std::string(Refuse("session", "not one that can be believed", kWanted).message());
  return judgement;
}

absl::Status CheckTimes(const Session& session) {
  if (session.until > session.since && session.until <= session.since + kLongestSession) return absl::OkStatus();
  return Refuse("session", "until " + TimeText(session.until), "at most 12 h after the sign-in");
}

absl::StatusOr<Session> ReadAnew(std::string_view token) {
  if (IsCertificateToken(token)) {
    const std::optional<CertificateToken> own = ReadCertificateToken(token);
    const auto holder = own ? CertificateOf(own->certificate_pem) : absl::UnknownError("");
    if (!holder.ok()) return Refuse("session", "not one that can be read", kWanted);
    return Session{holder->identity, SignedInBy::kCertificate, own->since, own->until};
  }
  std::optional<Parts> parts = PartsOf(token);
  if (!parts) return Refuse("session", "not one that can be read", kWanted);
  return std::move(parts->session);
}

}  // namespace

absl::StatusOr<std::string> SignSession(const Session& session, const std::filesystem::path& identity_file) {
  const OwnErrors errors;
  if (!SessionOfPayload(PayloadOf(session))) return Refuse("session", session.person.Text(), "a user with roles");
  if (absl::Status status = CheckTimes(session); !status.ok()) return status;
  const absl::StatusOr<OwnKey> own = ReadOwnKey(identity_file);
  if (!own.ok()) return own.status();
  const absl::StatusOr<std::string> der = DerOf(own->certificate.get());
  if (!der.ok()) return der.status();
  std::string token = std::string(kSessionVersion) + "." + ToBase64Url(PayloadOf(session)) + "." + ToBase64Url(*der);
  const absl::StatusOr<std::string> signature = SignEs256(own->key.get(), std::string(kPurpose) + token);
  if (!signature.ok()) return InFile(identity_file, signature.status());
  token += "." + ToBase64Url(*signature);
  if (token.size() <= kLongestSession_bytes) return token;
  return Refuse("session", std::to_string(token.size()) + " bytes", "at most 4096, with a certificate of fewer hosts");
}

absl::StatusOr<Session> ReadSession(std::string_view token) {
  // A call asks it several times, and a certificate costs more to read than all else of the call. Of a token that was judged: strangers'
  // take no room.
  static auto* const mutex = new std::shared_mutex;
  static auto* const known = new std::map<std::string, Session, std::less<>>;
  {
    const std::shared_lock<std::shared_mutex> lock(*mutex);
    if (const auto found = known->find(token); found != known->end()) return found->second;
  }
  absl::StatusOr<Session> read = ReadAnew(token);
  if (!read.ok()) return read;
  const std::lock_guard<std::shared_mutex> lock(*mutex);
  if (known->size() >= kMostKept) known->clear();
  known->emplace(token, *read);
  return read;
}

std::shared_ptr<const SessionTrust::Signed> SessionTrust::Read(std::string_view token) const {
  if (IsCertificateToken(token)) {
    std::optional<CertificateToken> own = ReadCertificateToken(token);
    if (!own) return nullptr;
    return std::make_shared<const Signed>(
        Signed{{{}, SignedInBy::kCertificate, own->since, own->until}, std::move(own->certificate_pem)});
  }
  const std::optional<Parts> parts = PartsOf(token);
  if (!parts) return nullptr;
  const Certificate certificate = CertificateOfDer(parts->certificate_der);
  EVP_PKEY* const key = certificate == nullptr ? nullptr : X509_get0_pubkey(certificate.get());
  const bool holds = key != nullptr && VerifiesEs256(key, parts->signed_text, parts->signature, EitherS::kLesserOnly);
  absl::StatusOr<std::string> pem = holds ? PemOf(certificate.get()) : absl::UnknownError("");
  return pem.ok() ? std::make_shared<const Signed>(Signed{parts->session, *std::move(pem)}) : nullptr;
}

SessionJudgement SessionTrust::JudgeTimes(const Session& session) const {
  const TimePoint now = now_();
  if (now >= session.until)
    return {SessionStanding::kOver, session,
            std::string(Refuse("session", "of " + session.person.Text() + ", over since " + TimeText(session.until),
                               "a new one by its renewal in time, or a new sign-in")
                            .message())};
  if (session.since > now + kClocks || session.until > now + kLongestToken + kClocks) return NotValid();
  return {SessionStanding::kGood, session, ""};
}

// A service calls with its certificate alone: nothing of the plant's own goes over the gateway.
SessionJudgement SessionTrust::JudgeOwn(const Session& session, const Judgement& certificate) const {
  if (certificate.standing != Standing::kGood) {
    SessionJudgement judgement = NotValid();
    if (certificate.standing != Standing::kNotOurs) judgement.why_not = certificate.why_not;
    return judgement;
  }
  if (certificate.identity.kind == Kind::kService || session.until > session.since + kLongestToken) return NotValid();
  Session own = session;
  own.person = certificate.identity;
  return JudgeTimes(own);
}

SessionJudgement SessionTrust::Judge(std::string_view token) {
  const OwnErrors errors;
  std::shared_ptr<const Signed> found;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (const auto kept = signed_.find(token); kept != signed_.end()) found = kept->second;
  }
  const bool is_new = found == nullptr;
  if (is_new) found = Read(token);
  if (found == nullptr) return NotValid();
  const Judgement signer = trust_.Judge(found->certificate_pem);
  if (signer.standing == Standing::kUndecidable)
    return SessionJudgement{SessionStanding::kUndecidable, {}, signer.why_not};
  const bool is_own = found->session.signed_in_by == SignedInBy::kCertificate;
  const bool is_plants = signer.standing == Standing::kGood && signer.identity.Text() == kPlant;
  if (!is_own && (!is_plants || !CheckTimes(found->session).ok())) return NotValid();
  // Strangers' certificates take no room.
  if (is_new && signer.standing == Standing::kGood) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (signed_.size() >= kMostKept) signed_.clear();
    signed_.emplace(token, found);
  }
  return is_own ? JudgeOwn(found->session, signer) : JudgeTimes(found->session);
}

}  // namespace sixpoint::identity

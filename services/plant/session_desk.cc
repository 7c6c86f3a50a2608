#include "services/plant/session_desk.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <chrono>

#include "identity/password.h"
#include "services/plant/in_transaction.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/peer_address.h"
#include "services/runtime/time_proto.h"
#include "storage/session_ends.h"

namespace sixpoint::plant {
namespace {

using runtime::Failure;
using storage::AccountEvent;
using storage::AccountRow;
using storage::Instant;
using storage::Transaction;

constexpr char kService[] = "sixpoint.plant.v1.AccountService/";
// More of an address than of an account: many people of a plant may come from one.
constexpr int kFreeOfAccount = 5, kFreeOfAddress = 20;
constexpr char kPassword[] = "password", kOidc[] = "oidc";

// The same for all that one host may choose from.
std::optional<std::string> AddressKey(const std::string& address) {
  sockaddr_storage peer{};
  if (inet_pton(AF_INET, address.c_str(), &reinterpret_cast<sockaddr_in&>(peer).sin_addr) == 1)
    peer.ss_family = AF_INET;
  else if (inet_pton(AF_INET6, address.c_str(), &reinterpret_cast<sockaddr_in6&>(peer).sin6_addr) == 1)
    peer.ss_family = AF_INET6;
  else
    return std::nullopt;
  return runtime::PeerKey(peer);
}

std::string HexOf(const std::string& bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (const char byte : bytes)
    hex += {kDigits[static_cast<unsigned char>(byte) >> 4], kDigits[static_cast<unsigned char>(byte) & 0xf]};
  return hex;
}

absl::Status Ended(const std::string& account, const std::string& how) {
  return Failure(errors::v1::SESSION_ENDED, "session: of " + account + ", " + how + ", want a new sign-in",
                 {{"resource", account}});
}

// That a plant's own service gave it, over or not.
absl::Status CheckOurs(const std::string& token, const identity::SessionJudgement& judged) {
  if (token.empty()) return runtime::Refuse("token", "", "a session's");
  if (judged.standing == identity::SessionStanding::kUndecidable)
    return Failure(errors::v1::SERVICE_NOT_READY, judged.why_not);
  if (judged.standing == identity::SessionStanding::kNotValid)
    return Failure(errors::v1::SESSION_NOT_VALID, judged.why_not);
  return absl::OkStatus();
}

}  // namespace

access::v1::Role RoleToProto(identity::Role role) {
  switch (role) {
    case identity::Role::kEngineer:
      return access::v1::ROLE_ENGINEER;
    case identity::Role::kQuality:
      return access::v1::ROLE_QUALITY;
    case identity::Role::kMesReader:
      return access::v1::ROLE_MES_READER;
    case identity::Role::kAdmin:
      return access::v1::ROLE_ADMIN;
    case identity::Role::kMachine:
    case identity::Role::kService:
    case identity::Role::kGateway:
      break;  // no person's
  }
  return access::v1::ROLE_UNSPECIFIED;
}

absl::StatusOr<std::vector<identity::Role>> RolesOfWords(const std::vector<std::string>& words) {
  std::vector<identity::Role> roles;
  for (const std::string& word : words) {
    const absl::StatusOr<identity::Role> role = identity::RoleOf("roles", word);
    if (!role.ok()) return absl::InternalError("accounts: a role that is none");
    roles.push_back(*role);
  }
  return roles;
}

std::vector<std::string> WordsOf(const std::vector<identity::Role>& roles) {
  std::vector<std::string> words;
  for (const identity::Role role : roles) words.push_back(identity::RoleText(role));
  return words;
}

v1::SignInMethod MethodToProto(const std::string& sign_in_method) {
  return sign_in_method == kOidc ? v1::SIGN_IN_METHOD_OIDC : v1::SIGN_IN_METHOD_PASSWORD;
}

absl::StatusOr<SessionDesk::Attempt> SessionDesk::AttemptOf(const std::string& method, const std::string& account,
                                                            const std::string& client_address) {
  const std::optional<std::string> key = AddressKey(client_address);
  if (!key) return runtime::Refuse("client_address", client_address, "an IPv4 or IPv6 address");
  Attempt attempt{method, account, client_address, {}, {"address " + HexOf(*key), kFreeOfAddress}};
  attempt.counters = {attempt.address};
  if (!account.empty()) attempt.counters.push_back({account, kFreeOfAccount});
  return attempt;
}

absl::Status SessionDesk::Refused(const Attempt& attempt, const std::string& account, const std::string& why) const {
  const absl::Status refused =
      Failure(errors::v1::SIGN_IN_REFUSED, attempt.method +
                                               ": nobody is signed in by this, want an account's own password, or "
                                               "an ID token of the plant's identity provider");
  if (options_.count_refused)
    options_.count_refused(
        {kService + attempt.method, account, attempt.client_address, runtime::ReasonOf(refused), why});
  return refused;
}

absl::Status SessionDesk::Slowed(const Attempt& attempt, const std::string& account, Instant until) const {
  const auto left = std::chrono::ceil<std::chrono::seconds>(until - std::chrono::system_clock::now());
  const std::string wait_s = std::to_string(std::max<std::int64_t>(1, left.count()));
  const absl::Status slowed = Failure(
      errors::v1::SIGN_IN_SLOWED,
      attempt.method + ": too many failed, of this account or from this address, want none for " + wait_s + " s",
      {{"wait_s", wait_s}});
  if (options_.count_refused)
    options_.count_refused(
        {kService + attempt.method, account, attempt.client_address, runtime::ReasonOf(slowed), "before its time"});
  return slowed;
}

absl::StatusOr<std::optional<AccountRow>> SessionDesk::CheckMay(const grpc::ServerContext& context,
                                                                const Attempt& attempt, bool begins) {
  std::optional<Instant> waits;
  absl::StatusOr<std::optional<AccountRow>> account =
      InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<std::optional<AccountRow>> {
        const auto until = begins ? storage::BeginSignIn(transaction, attempt.counters)
                                  : storage::SignInsWaitUntil(transaction, attempt.counters);
        if (!until.ok()) return until.status();
        waits = *until;
        return storage::FindAccount(transaction, attempt.account);
      });
  if (!account.ok() || !waits) return account;
  return Slowed(attempt, account->has_value() ? (*account)->name : "", *waits);
}

absl::StatusOr<std::string> SessionDesk::Hash(const grpc::ServerContext& context, const std::string& password) {
  const auto turn = hashings_.Enter(runtime::DeadlineOf(context), runtime::KeepGoing(context));
  if (!turn.ok()) return turn.status();
  return identity::HashPassword(password);
}

absl::StatusOr<bool> SessionDesk::Matches(const grpc::ServerContext& context, const std::string& phc,
                                          const std::string& password) {
  const auto turn = hashings_.Enter(runtime::DeadlineOf(context), runtime::KeepGoing(context));
  if (!turn.ok()) return turn.status();
  return identity::PasswordMatches(phc, password);
}

absl::StatusOr<AccountRow> SessionDesk::Judged(const grpc::ServerContext& context, const Attempt& attempt,
                                               const std::string& password) {
  // Who has to wait takes nobody's turn.
  if (const auto may = CheckMay(context, attempt, /*begins=*/false); !may.ok()) return may.status();
  const auto turn = hashings_.Enter(runtime::DeadlineOf(context), runtime::KeepGoing(context));
  if (!turn.ok()) return turn.status();
  const absl::StatusOr<std::optional<AccountRow>> account = CheckMay(context, attempt, /*begins=*/true);
  if (!account.ok()) return account.status();
  // Of who is not there, or has no password: as much work.
  const absl::StatusOr<bool> matches =
      identity::PasswordMatches(account->has_value() ? (*account)->password_phc : "", password);
  if (!matches.ok()) return matches.status();
  if (!account->has_value()) return Refused(attempt, "", "no such account");
  if (!*matches) return Refused(attempt, (*account)->name, "another password");
  return **account;
}

absl::StatusOr<v1::Session> SessionDesk::SignIn(const grpc::ServerContext& context, const v1::SignInRequest& request) {
  const absl::StatusOr<Attempt> attempt = AttemptOf("SignIn", request.name(), request.client_address());
  if (!attempt.ok()) return attempt.status();
  const absl::StatusOr<AccountRow> judged = Judged(context, *attempt, request.password());
  if (!judged.ok()) return judged.status();
  return InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<v1::Session> {
    const absl::StatusOr<std::optional<AccountRow>> account = storage::LockAccount(transaction, judged->name);
    if (!account.ok()) return account.status();
    // It may have changed while the password was judged.
    if (!account->has_value() || (*account)->disabled || (*account)->password_phc != judged->password_phc)
      return Refused(*attempt, judged->name, "the account is disabled, or changed meanwhile");
    absl::Status done = storage::SignInWentWell(transaction, attempt->account, attempt->address);
    if (done.ok())
      done =
          storage::AppendAccountEvent(transaction, **account, AccountEvent::kSignedIn, runtime::RequestedBy(context));
    const absl::StatusOr<Instant> now = done.ok() ? storage::DatabaseNow(transaction) : done;
    if (!now.ok()) return now.status();
    return Given(**account, *now, *now);
  });
}

absl::StatusOr<AccountRow> SessionDesk::CheckOwnPassword(const grpc::ServerContext& context, const std::string& account,
                                                         const std::string& password) {
  const Attempt attempt{"ChangeOwnPassword", account, "", {{account, kFreeOfAccount}}, {}};
  absl::StatusOr<AccountRow> judged = Judged(context, attempt, password);
  if (!judged.ok()) return judged;
  const auto well = InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<bool> {
    const absl::Status done = storage::SignInWentWell(transaction, account, attempt.address);
    if (!done.ok()) return done;
    return true;
  });
  if (!well.ok()) return well.status();
  return judged;
}

// The provider's subject is the person, whatever he is called now: whoever gets a name that was another's gets no account with it.
absl::StatusOr<AccountRow> SessionDesk::AccountOf(Transaction& transaction, const identity::SignedInPerson& person,
                                                  const Attempt& attempt, const std::string& requested_by) const {
  const std::string& issuer = options_.provider->issuer();
  const std::vector<std::string> roles = WordsOf(person.person.roles);
  absl::StatusOr<std::optional<AccountRow>> found = storage::LockAccountOfSubject(transaction, issuer, person.subject);
  if (!found.ok()) return found.status();
  if (!found->has_value()) {
    AccountRow made;
    made.name = person.person.Text();
    made.sign_in_method = kOidc;
    made.roles = roles;
    made.issuer = issuer;
    made.issuer_subject = person.subject;
    const absl::StatusOr<bool> inserted = storage::InsertAccount(transaction, made);
    if (!inserted.ok()) return inserted.status();
    if (*inserted) {
      const absl::Status kept = storage::AppendAccountEvent(transaction, made, AccountEvent::kCreated, requested_by);
      if (!kept.ok()) return kept;
    }
    found = storage::LockAccountOfSubject(transaction, issuer,
                                          person.subject);  // another one's sign-in may have been first
    if (!found.ok()) return found.status();
    if (!found->has_value()) return Refused(attempt, made.name, "an account of that name is another one's");
  }
  AccountRow account = **std::move(found);
  if (account.disabled) return Refused(attempt, account.name, "the account is disabled");
  if (account.roles == roles) return account;
  account.roles = roles;
  absl::Status done = storage::UpdateAccount(transaction, account);
  if (done.ok()) done = storage::AppendAccountEvent(transaction, account, AccountEvent::kRolesSet, requested_by);
  if (done.ok()) done = storage::EndSessions(transaction, account.name);
  if (!done.ok()) return done;
  return account;
}

absl::StatusOr<v1::Session> SessionDesk::SignInWithIdToken(const grpc::ServerContext& context,
                                                           const v1::SignInWithIdTokenRequest& request) {
  if (options_.provider == nullptr)
    return Failure(errors::v1::IDENTITY_PROVIDER_MISSING,
                   "the plant knows no identity provider, want sixpoint-plant to be started with --oidc FILE");
  const absl::StatusOr<Attempt> attempt = AttemptOf("SignInWithIdToken", "", request.client_address());
  if (!attempt.ok()) return attempt.status();
  if (const auto may = CheckMay(context, *attempt, /*begins=*/true); !may.ok()) return may.status();
  const absl::StatusOr<identity::SignedInPerson> person = options_.provider->Judge(request.id_token(), request.nonce());
  if (absl::IsUnauthenticated(person.status())) return Refused(*attempt, "", std::string(person.status().message()));
  if (!person.ok()) return person.status();
  return InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<v1::Session> {
    const std::string requested_by = runtime::RequestedBy(context);
    const absl::StatusOr<AccountRow> account = AccountOf(transaction, *person, *attempt, requested_by);
    if (!account.ok()) return account.status();
    absl::Status done = storage::SignInWentWell(transaction, attempt->account, attempt->address);
    if (done.ok()) done = storage::AppendAccountEvent(transaction, *account, AccountEvent::kSignedIn, requested_by);
    const absl::StatusOr<Instant> now = done.ok() ? storage::DatabaseNow(transaction) : done;
    if (!now.ok()) return now.status();
    return Given(*account, *now, *now);
  });
}

absl::StatusOr<v1::Session> SessionDesk::Given(const AccountRow& account, Instant since, Instant now) const {
  const absl::StatusOr<std::vector<identity::Role>> roles = RolesOfWords(account.roles);
  if (!roles.ok()) return roles.status();
  absl::StatusOr<identity::Identity> person = identity::IdentityOf(account.name, *roles);
  if (!person.ok()) return absl::InternalError("accounts: " + std::string(person.status().message()));
  identity::Session session;
  session.person = *std::move(person);
  session.signed_in_by =
      account.sign_in_method == kOidc ? identity::SignedInBy::kOidc : identity::SignedInBy::kPassword;
  session.since = since;
  const Instant renewable_until = since + identity::kLongestSession;
  session.until = std::min<Instant>(now + identity::kLongestToken, renewable_until);
  if (session.until <= now) return Ended(account.name, "12 hours old");
  const absl::StatusOr<std::string> token = identity::SignSession(session, options_.identity_file);
  // Where the file lies is nobody's who asks.
  if (!token.ok()) return absl::InternalError("a session cannot be signed: " + std::string(token.status().message()));
  v1::Session given;
  given.set_token(*token);
  given.set_name(account.name);
  for (const identity::Role role : session.person.roles) given.add_roles(RoleToProto(role));
  given.set_sign_in_method(MethodToProto(account.sign_in_method));
  runtime::ToProto(since, given.mutable_signed_in_at());
  runtime::ToProto(session.until, given.mutable_expires_at());
  runtime::ToProto(renewable_until, given.mutable_renewable_until());
  return given;
}

absl::StatusOr<v1::Session> SessionDesk::Renew(const grpc::ServerContext& context, const std::string& token) {
  const identity::SessionJudgement judged = sessions_.Judge(token);
  if (absl::Status ours = CheckOurs(token, judged); !ours.ok()) return ours;
  const std::string name = judged.session.person.Text();
  if (judged.standing == identity::SessionStanding::kOver) return Ended(name, "over");
  return InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<v1::Session> {
    const absl::StatusOr<std::optional<AccountRow>> account = storage::LockAccount(transaction, name);
    if (!account.ok()) return account.status();
    const absl::StatusOr<std::optional<Instant>> ended = storage::SessionsEndedBefore(transaction, name);
    if (!ended.ok()) return ended.status();
    const bool is_ended = ended->has_value() && judged.session.since <= **ended;
    if (!account->has_value() || (*account)->disabled || is_ended)
      return Ended(name, "ended by a sign-out or a change of the account");
    const absl::StatusOr<Instant> now = storage::DatabaseNow(transaction);
    if (!now.ok()) return now.status();
    return Given(**account, judged.session.since, *now);
  });
}

absl::Status SessionDesk::SignOut(const grpc::ServerContext& context, const std::string& token) {
  const identity::SessionJudgement judged = sessions_.Judge(token);
  if (absl::Status ours = CheckOurs(token, judged); !ours.ok()) return ours;
  if (judged.standing == identity::SessionStanding::kOver) return absl::OkStatus();
  const std::string name = judged.session.person.Text();
  const auto done = InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<bool> {
    const absl::StatusOr<std::optional<AccountRow>> account = storage::LockAccount(transaction, name);
    if (!account.ok()) return account.status();
    const absl::StatusOr<std::optional<Instant>> ended = storage::SessionsEndedBefore(transaction, name);
    if (!ended.ok()) return ended.status();
    if (!account->has_value() || (ended->has_value() && judged.session.since <= **ended)) return false;
    absl::Status out = storage::EndSessions(transaction, name);
    if (out.ok())
      out = storage::AppendAccountEvent(transaction, **account, AccountEvent::kSignedOut,
                                        name + " via " + runtime::RequestedFor(context));
    if (!out.ok()) return out;
    return true;
  });
  return done.status();
}

}  // namespace sixpoint::plant

#include "services/plant/session_desk.h"

#include <algorithm>
#include <chrono>

#include "identity/password.h"
#include "services/plant/in_transaction.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/time_proto.h"
#include "storage/session_ends.h"

namespace sixpoint::plant {
namespace {

using runtime::Failure;
using storage::AccountEvent;
using storage::AccountRow;
using storage::Instant;
using storage::Transaction;

constexpr char kOidc[] = "oidc";
// As services' clocks may differ: a session that begins later is believed by nobody.
constexpr std::chrono::minutes kMostAhead{1};

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
  // Whoever has a certificate makes his tokens himself, and no session of his lasts longer than one.
  if (judged.session.signed_in_by == identity::SignedInBy::kCertificate)
    return Failure(errors::v1::SESSION_NOT_VALID,
                   "token: of " + judged.session.person.Text() + "'s own certificate, want one that a sign-in gave");
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

absl::StatusOr<AccountRow> SessionDesk::Judged(const grpc::ServerContext& context, const std::string& password,
                                               SignInTry* one) {
  // Who has to wait takes nobody's turn.
  if (absl::Status may = tries_.CheckMay(context, *one); !may.ok()) return may;
  const auto turn = hashings_.Enter(runtime::DeadlineOf(context), runtime::KeepGoing(context));
  if (!turn.ok()) return turn.status();
  const absl::StatusOr<std::optional<AccountRow>> account = tries_.Begin(context, one);
  if (!account.ok()) return account.status();
  // Of who is not there, or has no password: as much work.
  const absl::StatusOr<bool> matches =
      identity::PasswordMatches(account->has_value() ? (*account)->password_phc : "", password);
  if (!matches.ok()) return matches.status();
  if (!account->has_value()) return tries_.Refused(*one, "", "no such account");
  if (!*matches) return tries_.Refused(*one, (*account)->name, "another password");
  return **account;
}

absl::StatusOr<v1::Session> SessionDesk::SignIn(const grpc::ServerContext& context, const v1::SignInRequest& request) {
  absl::StatusOr<SignInTry> one = SignInTries::Of("SignIn", request.name(), request.client_address());
  if (!one.ok()) return one.status();
  absl::StatusOr<v1::Session> session = ByPassword(context, request.password(), &*one);
  tries_.End(*one, session.status());
  return session;
}

absl::StatusOr<v1::Session> SessionDesk::ByPassword(const grpc::ServerContext& context, const std::string& password,
                                                    SignInTry* one) {
  const absl::StatusOr<AccountRow> judged = Judged(context, password, one);
  if (!judged.ok()) return judged.status();
  return InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<v1::Session> {
    const absl::StatusOr<std::optional<AccountRow>> account = storage::LockAccount(transaction, judged->name);
    if (!account.ok()) return account.status();
    // It may have changed while the password was judged.
    if (!account->has_value() || (*account)->disabled || (*account)->password_phc != judged->password_phc)
      return tries_.Refused(*one, judged->name, "the account is disabled, or changed meanwhile");
    return Begun(transaction, **account, *one, runtime::RequestedBy(context));
  });
}

absl::StatusOr<AccountRow> SessionDesk::CheckOwnPassword(const grpc::ServerContext& context, const std::string& account,
                                                         const std::string& password) {
  SignInTry one = SignInTries::OfOwnPassword("ChangeOwnPassword", account);
  absl::StatusOr<AccountRow> judged = Judged(context, password, &one);
  if (judged.ok()) {
    const auto well = InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<bool> {
      if (absl::Status done = tries_.WentWell(transaction, one); !done.ok()) return done;
      return true;
    });
    if (!well.ok()) judged = well.status();
  }
  tries_.End(one, judged.status());
  return judged;
}

// The provider's subject is the person, whatever he is called now: whoever gets a name that was another's gets no account with it, nor
// what the record and the clearances know under that name.
absl::StatusOr<AccountRow> SessionDesk::AccountOf(Transaction& transaction, const identity::SignedInPerson& person,
                                                  const SignInTry& one, const std::string& requested_by) const {
  const std::string& issuer = options_.provider->issuer();
  const std::optional<std::string> linked = options_.provider->PersonOf(person.subject);
  AccountRow made;
  made.name = linked.value_or(person.person.Text());
  made.sign_in_method = kOidc;
  made.roles = WordsOf(person.person.roles);
  made.issuer = issuer;
  made.issuer_subject = person.subject;
  // Asked before the account is: where his own first sign-in at the same moment makes him known, it has made the account, too.
  const absl::StatusOr<bool> is_somebody = storage::IsSomebody(transaction, made.name);
  if (!is_somebody.ok()) return is_somebody.status();
  absl::StatusOr<std::optional<AccountRow>> found = storage::LockAccountOfSubject(transaction, issuer, person.subject);
  if (!found.ok()) return found.status();
  if (!found->has_value()) {
    if (*is_somebody && !linked) return RefusedName(one, made);
    const absl::StatusOr<bool> inserted = storage::InsertAccount(transaction, made);
    if (!inserted.ok()) return inserted.status();
    if (*inserted) {
      const absl::Status kept = storage::AppendAccountEvent(transaction, made, AccountEvent::kCreated, requested_by);
      if (!kept.ok()) return kept;
    }
    found = storage::LockAccountOfSubject(transaction, issuer,
                                          person.subject);  // another one's sign-in may have been first
    if (!found.ok()) return found.status();
    if (!found->has_value()) return RefusedName(one, made);
  }
  AccountRow account = **std::move(found);
  if (account.disabled) return tries_.Refused(one, account.name, "the account is disabled");
  if (account.roles == made.roles) return account;
  account.roles = made.roles;
  absl::Status done = storage::UpdateAccount(transaction, account);
  if (done.ok()) done = storage::AppendAccountEvent(transaction, account, AccountEvent::kRolesSet, requested_by);
  if (done.ok()) done = storage::EndSessions(transaction, account.name);
  if (!done.ok()) return done;
  return account;
}

// Who the subject is, the plant's people say (docs/access.md).
absl::Status SessionDesk::RefusedName(const SignInTry& one, const AccountRow& wanted) const {
  runtime::Log(runtime::LogLevel::kWarning,
               "a first sign-in by the identity provider is refused: the plant knows somebody of that name; where both "
               "are one person, want the subject under persons of the --oidc file",
               {{"name", wanted.name}, {"subject", wanted.issuer_subject}, {"issuer", wanted.issuer}});
  return tries_.Refused(one, wanted.name, "the name is another one's: the plant knew it before this subject came");
}

absl::StatusOr<v1::Session> SessionDesk::SignInWithIdToken(const grpc::ServerContext& context,
                                                           const v1::SignInWithIdTokenRequest& request) {
  if (options_.provider == nullptr)
    return Failure(errors::v1::IDENTITY_PROVIDER_MISSING,
                   "the plant knows no identity provider, want sixpoint-plant to be started with --oidc FILE");
  absl::StatusOr<SignInTry> one = SignInTries::Of("SignInWithIdToken", "", request.client_address());
  if (!one.ok()) return one.status();
  absl::StatusOr<v1::Session> session = ByIdToken(context, request, &*one);
  tries_.End(*one, session.status());
  return session;
}

absl::StatusOr<v1::Session> SessionDesk::ByIdToken(const grpc::ServerContext& context,
                                                   const v1::SignInWithIdTokenRequest& request, SignInTry* one) {
  if (const auto may = tries_.Begin(context, one); !may.ok()) return may.status();
  const absl::StatusOr<identity::SignedInPerson> person = options_.provider->Judge(request.id_token(), request.nonce());
  if (absl::IsUnauthenticated(person.status())) return tries_.Refused(*one, "", std::string(person.status().message()));
  if (!person.ok()) return person.status();
  return InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<v1::Session> {
    const std::string requested_by = runtime::RequestedBy(context);
    const absl::StatusOr<AccountRow> account = AccountOf(transaction, *person, *one, requested_by);
    if (!account.ok()) return account.status();
    return Begun(transaction, *account, *one, requested_by);
  });
}

absl::StatusOr<v1::Session> SessionDesk::Begun(Transaction& transaction, const AccountRow& account,
                                               const SignInTry& one, const std::string& requested_by) const {
  absl::Status done = tries_.WentWell(transaction, one);
  if (done.ok()) done = storage::AppendAccountEvent(transaction, account, AccountEvent::kSignedIn, requested_by);
  const absl::StatusOr<storage::SessionStart> start =
      done.ok() ? storage::BeginSession(transaction, account.name) : done;
  if (!start.ok()) return start.status();
  if (start->since <= start->now + kMostAhead) return Given(account, start->since, start->now);
  const auto ahead = std::chrono::ceil<std::chrono::seconds>(start->since - start->now);
  return Failure(errors::v1::SERVICE_NOT_READY,
                 "the newest end of sessions of " + account.name + " is " + std::to_string(ahead.count()) +
                     " s ahead of the database's clock, which was set back; want it right, or that time to pass");
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
    const absl::StatusOr<Instant> now = storage::NowOf(transaction);
    if (!now.ok()) return now.status();
    return Given(**account, judged.session.since, *now);
  });
}

absl::Status SessionDesk::SignOut(const grpc::ServerContext& context, const std::string& token) {
  const identity::SessionJudgement judged = sessions_.Judge(token);
  if (absl::Status ours = CheckOurs(token, judged); !ours.ok()) return ours;
  const std::string name = judged.session.person.Text();
  const auto done = InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<bool> {
    const absl::StatusOr<std::optional<AccountRow>> account = storage::LockAccount(transaction, name);
    if (!account.ok()) return account.status();
    const absl::StatusOr<std::optional<Instant>> ended = storage::SessionsEndedBefore(transaction, name);
    if (!ended.ok()) return ended.status();
    const absl::StatusOr<Instant> now = storage::NowOf(transaction);
    if (!now.ok()) return now.status();
    // Of a token that is over there may be one that was renewed, and others of the account.
    const bool is_over = judged.session.since + identity::kLongestSession <= *now;
    const bool is_ended = ended->has_value() && judged.session.since <= **ended;
    if (!account->has_value() || is_over || is_ended) return false;
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

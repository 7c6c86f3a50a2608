#include "services/plant/session_desk.h"

#include <algorithm>
#include <chrono>

#include "identity/password.h"
#include "services/plant/still_wanted.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::plant {
namespace {

using runtime::Failure;
using storage::AccountRow;
using storage::Instant;

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
  // It may have changed while the password was judged.
  const auto stands = [&](const std::optional<AccountRow>& account) {
    if (account && !account->disabled && account->password_phc == judged->password_phc) return absl::OkStatus();
    return tries_.Refused(*one, judged->name, "the account is disabled, or changed meanwhile");
  };
  return Begun(context, *one, stands, [&](const storage::SignInOrder& order) {
    return accounts_->SignIn(judged->name, order, StillWantedBy(context), runtime::DeadlineOf(context));
  });
}

absl::StatusOr<AccountRow> SessionDesk::CheckOwnPassword(const grpc::ServerContext& context, const std::string& account,
                                                         const std::string& password) {
  SignInTry one = SignInTries::OfOwnPassword("ChangeOwnPassword", account);
  absl::StatusOr<AccountRow> judged = Judged(context, password, &one);
  if (judged.ok())
    if (absl::Status well = tries_.WentWell(context, one); !well.ok()) judged = well;
  tries_.End(one, judged.status());
  return judged;
}

// The provider's subject is the person, whatever he is called now: whoever gets a name that was another's gets no account with it, nor
// what the record and the clearances know under that name.
storage::VouchedPerson SessionDesk::Vouched(const identity::SignedInPerson& person) const {
  const std::optional<std::string> linked = options_.provider->PersonOf(person.subject);
  storage::VouchedPerson vouched;
  vouched.account.name = linked.value_or(person.person.Text());
  vouched.account.sign_in_method = kOidc;
  vouched.account.roles = WordsOf(person.person.roles);
  vouched.account.issuer = options_.provider->issuer();
  vouched.account.issuer_subject = person.subject;
  vouched.is_linked = linked.has_value();
  return vouched;
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
  const storage::VouchedPerson vouched = Vouched(*person);
  const auto may = [&](const std::optional<AccountRow>& account) {
    if (!account) return RefusedName(*one, vouched.account);
    return account->disabled ? tries_.Refused(*one, account->name, "the account is disabled") : absl::OkStatus();
  };
  return Begun(context, *one, may, [&](const storage::SignInOrder& order) {
    return accounts_->SignInOfSubject(vouched, order, StillWantedBy(context), runtime::DeadlineOf(context));
  });
}

absl::StatusOr<v1::Session> SessionDesk::Begun(const grpc::ServerContext& context, const SignInTry& one,
                                               const Judge& judge, const StoreSignIn& sign_in) const {
  const absl::StatusOr<storage::CountedSignIn> counted = SignInTries::Counted(one);
  if (!counted.ok()) return counted.status();
  v1::Session session;
  // Signed before the commit: whoever gets none is not signed in.
  const auto begun = [&](const AccountRow& account, const storage::SessionStart& start) {
    absl::StatusOr<v1::Session> given = Given(account, start);
    if (given.ok()) session = *given;
    return given.status();
  };
  if (absl::Status done = sign_in({*counted, runtime::RequestedBy(context), judge, begun}); !done.ok()) return done;
  return session;
}

absl::StatusOr<v1::Session> SessionDesk::Given(const AccountRow& account, const storage::SessionStart& start) const {
  if (start.since <= start.now + kMostAhead) return Given(account, start.since, start.now);
  const auto ahead = std::chrono::ceil<std::chrono::seconds>(start.since - start.now);
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
  runtime::StoredWords words(account.name);
  given.set_sign_in_method(words.Value<v1::SignInMethod>(account.sign_in_method));
  runtime::ToProto(since, given.mutable_signed_in_at());
  runtime::ToProto(session.until, given.mutable_expires_at());
  runtime::ToProto(renewable_until, given.mutable_renewable_until());
  return words.Checked(std::move(given));
}

absl::StatusOr<v1::Session> SessionDesk::Renew(const grpc::ServerContext& context, const std::string& token) {
  const identity::SessionJudgement judged = sessions_.Judge(token);
  if (absl::Status ours = CheckOurs(token, judged); !ours.ok()) return ours;
  const std::string name = judged.session.person.Text();
  if (judged.standing == identity::SessionStanding::kOver) return Ended(name, "over");
  const Instant since = judged.session.since;
  const absl::StatusOr<storage::SessionLook> look = accounts_->LookAtSession(name, since, runtime::DeadlineOf(context));
  if (!look.ok()) return look.status();
  if (!look->account || look->account->disabled || look->is_ended)
    return Ended(name, "ended by a sign-out or a change of the account");
  return Given(*look->account, since, look->now);
}

absl::Status SessionDesk::SignOut(const grpc::ServerContext& context, const std::string& token) {
  const identity::SessionJudgement judged = sessions_.Judge(token);
  if (absl::Status ours = CheckOurs(token, judged); !ours.ok()) return ours;
  const std::string name = judged.session.person.Text();
  const Instant since = judged.session.since;
  // Of a token that is over there may be one that was renewed, and others of the account.
  return accounts_
      ->SignOut(name, since, since + identity::kLongestSession, name + " via " + runtime::RequestedFor(context),
                StillWantedBy(context), runtime::DeadlineOf(context))
      .status();
}

}  // namespace sixpoint::plant

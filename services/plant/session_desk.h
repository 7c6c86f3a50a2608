// Where people are signed in: passwords and ID tokens are judged, sessions given, renewed and ended (identity/session.h). Who guesses is
// slowed down (sign_in_tries.h).
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "identity/session.h"
#include "identity/trust.h"
#include "services/plant/identity_provider.h"
#include "services/plant/sign_in_tries.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/plant/v1/account.pb.h"
#include "storage/account_store.h"

namespace sixpoint::plant {

struct SessionDeskOptions {
  std::filesystem::path identity_file;  // the plant service's own: sessions are signed with its key
  std::unique_ptr<identity::Trust> trust;
  std::unique_ptr<IdentityProvider> provider;  // null: people sign in by password alone
  SignInTries::CountRefused count_refused;     // empty: not counted
};

// Thread-safe.
class SessionDesk {
 public:
  SessionDesk(std::shared_ptr<storage::AccountStore> accounts, SessionDeskOptions options)
      : accounts_(std::move(accounts)),
        options_(std::move(options)),
        sessions_(options_.trust.get()),
        tries_(accounts_, options_.count_refused) {}

  absl::StatusOr<v1::Session> SignIn(const grpc::ServerContext& context, const v1::SignInRequest& request);
  absl::StatusOr<v1::Session> SignInWithIdToken(const grpc::ServerContext& context,
                                                const v1::SignInWithIdTokenRequest& request);
  absl::StatusOr<v1::Session> Renew(const grpc::ServerContext& context, const std::string& token);
  absl::Status SignOut(const grpc::ServerContext& context, const std::string& token);

  // The account with that password. SIGN_IN_REFUSED where it is not its, slowed down as sign-ins are; for who changes his own.
  absl::StatusOr<storage::AccountRow> CheckOwnPassword(const grpc::ServerContext& context, const std::string& account,
                                                       const std::string& password);
  // What argon2id makes of a password, and whether it made that of it. Two at once: each takes 64 MiB.
  absl::StatusOr<std::string> Hash(const grpc::ServerContext& context, const std::string& password);
  absl::StatusOr<bool> Matches(const grpc::ServerContext& context, const std::string& phc, const std::string& password);

 private:
  // The account whose password that is, as it stood before its password was judged.
  absl::StatusOr<storage::AccountRow> Judged(const grpc::ServerContext& context, const std::string& password,
                                             SignInTry* one);
  absl::StatusOr<v1::Session> ByPassword(const grpc::ServerContext& context, const std::string& password,
                                         SignInTry* one);
  absl::StatusOr<v1::Session> ByIdToken(const grpc::ServerContext& context, const v1::SignInWithIdTokenRequest& request,
                                        SignInTry* one);
  storage::VouchedPerson Vouched(const identity::SignedInPerson& person) const;
  absl::Status RefusedName(const SignInTry& one, const storage::AccountRow& wanted) const;
  // A new session of the account that passes `judge`, as `sign_in` has the store begin it.
  using Judge = std::function<absl::Status(const std::optional<storage::AccountRow>& account)>;
  using StoreSignIn = std::function<absl::Status(const storage::SignInOrder& order)>;
  absl::StatusOr<v1::Session> Begun(const grpc::ServerContext& context, const SignInTry& one, const Judge& judge,
                                    const StoreSignIn& sign_in) const;
  // SERVICE_NOT_READY where it would begin later than anybody believes.
  absl::StatusOr<v1::Session> Given(const storage::AccountRow& account, const storage::SessionStart& start) const;
  absl::StatusOr<v1::Session> Given(const storage::AccountRow& account, storage::Instant since,
                                    storage::Instant now) const;

  const std::shared_ptr<storage::AccountStore> accounts_;
  const SessionDeskOptions options_;
  identity::SessionTrust sessions_;
  const SignInTries tries_;
  runtime::ComputePool hashings_{{2, 16}, "sign-ins", errors::v1::SIGN_INS_FULL};
};

// Roles as the contract and as the database has them.
access::v1::Role RoleToProto(identity::Role role);
absl::StatusOr<std::vector<identity::Role>> RolesOfWords(const std::vector<std::string>& words);
std::vector<std::string> WordsOf(const std::vector<identity::Role>& roles);

}  // namespace sixpoint::plant

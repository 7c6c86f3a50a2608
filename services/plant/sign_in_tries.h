// Tries to sign in: each is counted as failed before it is judged, and given back where it was not. Who guesses is slowed down, and never
// told what was wrong.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "services/runtime/server.h"
#include "storage/account_store.h"

namespace sixpoint::plant {

// One of them, for the counters and the denials.
struct SignInTry {
  std::string method;          // of AccountService
  std::string account;         // as it was named; empty: an ID token's
  std::string client_address;  // empty: not of a sign-in
  storage::FailureCounters counters;
  std::optional<storage::Instant> counted_at;  // none: it is not, or not any more
};

// Thread-safe.
class SignInTries {
 public:
  using CountRefused = std::function<void(const runtime::RefusedSignIn&)>;
  // `count_refused` may be empty.
  SignInTries(std::shared_ptr<storage::AccountStore> accounts, CountRefused count_refused)
      : accounts_(std::move(accounts)), count_refused_(std::move(count_refused)) {}

  // INVALID_ARGUMENT of an address that is none.
  static absl::StatusOr<SignInTry> Of(const std::string& method, const std::string& account,
                                      const std::string& client_address);
  // Of who is signed in and says his password once more.
  static SignInTry OfOwnPassword(const std::string& method, const std::string& account);

  // SIGN_IN_SLOWED where it has to wait.
  absl::Status CheckMay(const grpc::ServerContext& context, const SignInTry& one) const;
  // The same, and counts it as failed. Gives the account, where it is there.
  absl::StatusOr<std::optional<storage::AccountRow>> Begin(const grpc::ServerContext& context, SignInTry* one) const;
  // As Begin counted it, for what follows where it went well.
  static absl::StatusOr<storage::CountedSignIn> Counted(const SignInTry& one);
  absl::Status WentWell(const grpc::ServerContext& context, const SignInTry& one) const;
  // SIGN_IN_REFUSED. account: empty where none is there. why: for the plant's people.
  absl::Status Refused(const SignInTry& one, const std::string& account, const std::string& why) const;
  // Once it is over, whatever came of it: what was not refused, such as by a database or a provider that is away, did not fail.
  void End(const SignInTry& one, const absl::Status& outcome) const;

 private:
  absl::Status Slowed(const SignInTry& one, const std::string& account, storage::Instant until) const;

  const std::shared_ptr<storage::AccountStore> accounts_;
  const CountRefused count_refused_;
};

}  // namespace sixpoint::plant

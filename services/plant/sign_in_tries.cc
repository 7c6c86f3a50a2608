#include "services/plant/sign_in_tries.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <chrono>

#include "services/plant/in_transaction.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/peer_address.h"

namespace sixpoint::plant {
namespace {

using runtime::Failure;
using storage::AccountRow;
using storage::Instant;
using storage::Transaction;

constexpr char kService[] = "sixpoint.plant.v1.AccountService/";
// More of an address than of an account: many people of a plant may come from one.
constexpr int kFreeOfAccount = 5, kFreeOfAddress = 20;
// For what is done after a call that may be gone.
constexpr std::chrono::seconds kTryPatience{2};

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

}  // namespace

absl::StatusOr<SignInTry> SignInTries::Of(const std::string& method, const std::string& account,
                                          const std::string& client_address) {
  const std::optional<std::string> key = AddressKey(client_address);
  if (!key) return runtime::Refuse("client_address", client_address, "an IPv4 or IPv6 address");
  SignInTry one{method, account, client_address, {}, {}};
  one.counters.address = {*key, kFreeOfAddress};
  if (!account.empty()) one.counters.account = {account, kFreeOfAccount};
  return one;
}

SignInTry SignInTries::OfOwnPassword(const std::string& method, const std::string& account) {
  SignInTry one{method, account, "", {}, {}};
  one.counters.account = {account, kFreeOfAccount};
  return one;
}

absl::Status SignInTries::Refused(const SignInTry& one, const std::string& account, const std::string& why) const {
  const absl::Status refused =
      Failure(errors::v1::SIGN_IN_REFUSED, one.method +
                                               ": nobody is signed in by this, want an account's own password, or "
                                               "an ID token of the plant's identity provider");
  if (count_refused_)
    count_refused_({kService + one.method, account, one.client_address, runtime::ReasonOf(refused), why});
  return refused;
}

absl::Status SignInTries::Slowed(const SignInTry& one, const std::string& account, Instant until) const {
  const auto left = std::chrono::ceil<std::chrono::seconds>(until - std::chrono::system_clock::now());
  const std::string wait_s = std::to_string(std::max<std::int64_t>(1, left.count()));
  const absl::Status slowed =
      Failure(errors::v1::SIGN_IN_SLOWED,
              one.method + ": too many failed, of this account or from this address, want none for " + wait_s + " s",
              {{"wait_s", wait_s}});
  if (count_refused_)
    count_refused_({kService + one.method, account, one.client_address, runtime::ReasonOf(slowed), "before its time"});
  return slowed;
}

absl::Status SignInTries::CheckMay(const grpc::ServerContext& context, const SignInTry& one) const {
  std::optional<Instant> waits;
  const absl::StatusOr<std::optional<AccountRow>> account =
      InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<std::optional<AccountRow>> {
        const auto until = storage::SignInsWaitUntil(transaction, one.counters);
        if (!until.ok()) return until.status();
        waits = *until;
        return storage::FindAccount(transaction, one.account);
      });
  if (!account.ok() || !waits) return account.status();
  return Slowed(one, account->has_value() ? (*account)->name : "", *waits);
}

absl::StatusOr<std::optional<AccountRow>> SignInTries::Begin(const grpc::ServerContext& context, SignInTry* one) const {
  storage::SignInStart start;
  absl::StatusOr<std::optional<AccountRow>> account =
      InTransaction(database_, context, [&](Transaction& transaction) -> absl::StatusOr<std::optional<AccountRow>> {
        const absl::StatusOr<storage::SignInStart> begun = storage::BeginSignIn(transaction, one->counters);
        if (!begun.ok()) return begun.status();
        start = *begun;
        return storage::FindAccount(transaction, one->account);
      });
  if (!account.ok()) return account;
  Forget();
  if (start.waits_until) return Slowed(*one, account->has_value() ? (*account)->name : "", *start.waits_until);
  one->counted_at = start.counted_at;
  return account;
}

absl::Status SignInTries::WentWell(Transaction& transaction, const SignInTry& one) const {
  if (!one.counted_at) return absl::InternalError("a sign-in that was not counted went well");
  return storage::SignInWentWell(transaction, one.counters, *one.counted_at);
}

// Beside a call that may be gone: what fails is said, and nothing of the call's.
template <typename Work>
void SignInTries::Aside(const std::string& otherwise, const Work& work) const {
  absl::StatusOr<Transaction> transaction = database_->Begin(std::chrono::steady_clock::now() + kTryPatience);
  absl::Status done = transaction.status();
  if (done.ok()) done = work(*transaction);
  if (done.ok()) done = transaction->Commit();
  if (!done.ok()) runtime::Log(runtime::LogLevel::kWarning, otherwise, {{"why", std::string(done.message())}});
}

void SignInTries::End(const SignInTry& one, const absl::Status& outcome) const {
  if (outcome.ok() || !one.counted_at || runtime::HasReason(outcome, errors::v1::SIGN_IN_REFUSED)) return;
  Aside("a sign-in that was not judged stays counted as failed",
        [&](Transaction& transaction) { return storage::GiveSignInBack(transaction, one.counters, *one.counted_at); });
}

void SignInTries::Forget() const { Aside("old failures of sign-ins are not forgotten", storage::ForgetSignInFailures); }

}  // namespace sixpoint::plant

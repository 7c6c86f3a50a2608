#include "services/plant/sign_in_tries.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <chrono>

#include "services/plant/still_wanted.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/peer_address.h"

namespace sixpoint::plant {
namespace {

using runtime::Failure;
using storage::AccountRow;
using storage::Instant;

constexpr char kService[] = "sixpoint.plant.v1.AccountService/";
// More of an address than of an account: many people of a plant may come from one.
constexpr int kFreeOfAccount = 5, kFreeOfAddress = 20;
// For what is done after a call that may be gone.
constexpr std::chrono::seconds kTryPatience{2};

storage::Deadline AsideDeadline() { return std::chrono::steady_clock::now() + kTryPatience; }

// Beside a call that may be gone: what fails is said, and nothing of the call's.
void TellFailure(const absl::Status& done, const std::string& otherwise) {
  if (!done.ok()) runtime::Log(runtime::LogLevel::kWarning, otherwise, {{"why", std::string(done.message())}});
}

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
  const absl::StatusOr<storage::SignInLook> look =
      accounts_->LookAtSignIn(one.counters, one.account, runtime::DeadlineOf(context));
  if (!look.ok() || !look->start.waits_until) return look.status();
  return Slowed(one, look->account ? look->account->name : "", *look->start.waits_until);
}

absl::StatusOr<std::optional<AccountRow>> SignInTries::Begin(const grpc::ServerContext& context, SignInTry* one) const {
  absl::StatusOr<storage::SignInLook> begun =
      accounts_->BeginSignIn(one->counters, one->account, StillWantedBy(context), runtime::DeadlineOf(context));
  if (!begun.ok()) return begun.status();
  TellFailure(accounts_->ForgetSignInFailures(AsideDeadline()), "old failures of sign-ins are not forgotten");
  if (begun->start.waits_until)
    return Slowed(*one, begun->account ? begun->account->name : "", *begun->start.waits_until);
  one->counted_at = begun->start.counted_at;
  return std::move(begun->account);
}

absl::StatusOr<storage::CountedSignIn> SignInTries::Counted(const SignInTry& one) {
  if (!one.counted_at) return absl::InternalError("a sign-in that was not counted went well");
  return storage::CountedSignIn{one.counters, *one.counted_at};
}

absl::Status SignInTries::WentWell(const grpc::ServerContext& context, const SignInTry& one) const {
  const absl::StatusOr<storage::CountedSignIn> counted = Counted(one);
  if (!counted.ok()) return counted.status();
  return accounts_->SignInWentWell(*counted, StillWantedBy(context), runtime::DeadlineOf(context));
}

void SignInTries::End(const SignInTry& one, const absl::Status& outcome) const {
  if (outcome.ok() || !one.counted_at || runtime::HasReason(outcome, errors::v1::SIGN_IN_REFUSED)) return;
  TellFailure(accounts_->GiveSignInBack({one.counters, *one.counted_at}, AsideDeadline()),
              "a sign-in that was not judged stays counted as failed");
}

}  // namespace sixpoint::plant

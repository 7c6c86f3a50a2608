#include "services/plant/credentials_service.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "identity/credentials.h"
#include "services/plant/still_wanted.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/time_proto.h"
#include "storage/blobs.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;

constexpr std::size_t kPickupId_bytes = 64;
constexpr int kMostHours = 720;

absl::Status CheckPickupId(const std::string& pickup_id) {
  const auto is_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  if (pickup_id.size() == kPickupId_bytes && std::all_of(pickup_id.begin(), pickup_id.end(), is_hex))
    return absl::OkStatus();
  return runtime::Refuse("pickup_id", std::to_string(pickup_id.size()) + " bytes",
                         "lower-case hexadecimal of 32 bytes");
}

absl::Status CheckOffer(const v1::OfferCredentialsRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(CheckPickupId(request.pickup_id()));
  if (request.sealed().empty()) refusals.Add(runtime::Refuse("sealed", "", "sealed credentials"));
  if (request.identity().empty()) refusals.Add(runtime::Refuse("identity", "", "whose they are: machines/m1"));
  if (request.valid_hours() < 1 || request.valid_hours() > kMostHours)
    refusals.Add(runtime::Refuse("valid_hours", request.valid_hours(), "1 to " + std::to_string(kMostHours)));
  return refusals.status();
}

}  // namespace

grpc::Status CredentialsService::OfferCredentials(grpc::ServerContext* context,
                                                  const v1::OfferCredentialsRequest* request,
                                                  v1::OfferCredentialsResponse* response) {
  if (absl::Status status = CheckOffer(*request); !status.ok()) return ToGrpc(status);
  const storage::CredentialOffer offer{storage::Sha256Hex(request->pickup_id()), request->sealed(), request->identity(),
                                       runtime::RequestedBy(*context), request->valid_hours()};
  const absl::StatusOr<storage::Instant> ends =
      credentials_->KeepOffer(offer, StillWantedBy(*context), runtime::DeadlineOf(*context));
  if (!ends.ok()) return ToGrpc(ends.status());
  runtime::Log(runtime::LogLevel::kInfo, "credentials offered",
               {{"identity", offer.identity}, {"by", offer.offered_by}});
  runtime::ToProto(*ends, response->mutable_expires_at());
  return grpc::Status::OK;
}

grpc::Status CredentialsService::TakeCredentials(grpc::ServerContext* context,
                                                 const v1::TakeCredentialsRequest* request,
                                                 v1::TakeCredentialsResponse* response) {
  if (absl::Status status = CheckPickupId(request->pickup_id()); !status.ok()) return ToGrpc(status);
  absl::StatusOr<std::optional<storage::CredentialOffer>> offer = credentials_->TakeOffer(
      storage::Sha256Hex(request->pickup_id()), StillWantedBy(*context), runtime::DeadlineOf(*context));
  if (!offer.ok()) return ToGrpc(offer.status());
  if (!offer->has_value())
    return ToGrpc(runtime::Failure(errors::v1::CODE_NOT_VALID,
                                   "pickup_id: nothing waits under it, want one of a code that "
                                   "was not used and is not over"));
  runtime::Log(runtime::LogLevel::kInfo, "credentials taken",
               {{"identity", (*offer)->identity}, {"peer", context->peer()}});
  response->set_sealed(std::move((*offer)->sealed));
  return grpc::Status::OK;
}

grpc::Status CredentialsService::OfferRenewal(grpc::ServerContext* context, const v1::OfferRenewalRequest* request,
                                              v1::OfferRenewalResponse*) {
  const identity::Judgement judged = trust_->Judge(request->certificate_pem());
  const auto certificate = identity::CertificateOf(request->certificate_pem());
  if (judged.standing != identity::Standing::kGood || !certificate.ok())
    return ToGrpc(runtime::Refuse("certificate_pem", judged.why_not, "one of this plant's authority that holds now"));
  const storage::CertificateRenewal renewal{certificate->public_key_sha256, certificate->serial,
                                            certificate->identity.Text(),   request->certificate_pem(),
                                            certificate->not_after,         runtime::RequestedBy(*context)};
  return ToGrpc(credentials_->KeepRenewal(renewal, StillWantedBy(*context), runtime::DeadlineOf(*context)));
}

grpc::Status CredentialsService::GetRenewal(grpc::ServerContext* context, const v1::GetRenewalRequest*,
                                            v1::Renewal* response) {
  const auto shown = identity::CertificateOf(runtime::ShownCertificate(*context));
  if (!shown.ok()) return ToGrpc(shown.status());
  const absl::StatusOr<std::vector<storage::CertificateRenewal>> kept =
      credentials_->FindRenewals(shown->public_key_sha256, runtime::DeadlineOf(*context));
  if (!kept.ok()) return ToGrpc(kept.status());
  const std::string who = shown->identity.Text();
  // One that was taken back since is no help to its holder.
  const auto renewal = std::find_if(kept->begin(), kept->end(), [&](const storage::CertificateRenewal& one) {
    return one.not_after > shown->not_after && one.identity == who &&
           trust_->Judge(one.certificate_pem).standing == identity::Standing::kGood;
  });
  if (renewal == kept->end())
    return ToGrpc(runtime::Failure(errors::v1::RENEWAL_NOT_OFFERED,
                                   "renewal: none is kept for " + who + ", want one that lasts longer",
                                   {{"resource", who}}));
  response->set_certificate_pem(renewal->certificate_pem);
  runtime::ToProto(renewal->not_after, response->mutable_not_after());
  return grpc::Status::OK;
}

}  // namespace sixpoint::plant

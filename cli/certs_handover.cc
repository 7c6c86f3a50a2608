// `sixpoint certs offer`, `take` and `fetch`: credentials on their way to where they are used. The first by a one-time code, what
// follows as certificates of the same key.
#include "cli/certs_handover.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/certificate_text.h"
#include "cli/commands.h"
#include "cli/identity_folder.h"
#include "identity/credentials.h"
#include "identity/sealed_credentials.h"
#include "services/runtime/call.h"
#include "services/runtime/credentials.h"
#include "services/runtime/time_proto.h"
#include "sixpoint/plant/v1/credentials.grpc.pb.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using identity::IssuedCertificate;
using plant::v1::CredentialsService;
using CredentialsStub = CredentialsService::Stub;

constexpr double kTakePatience_s = 20;

absl::Status PrintFolder(const Session& session, const std::string& what, const fs::path& folder) {
  const absl::StatusOr<IssuedCertificate> certificate = identity::ReadCertificate(folder / identity::kIdentityFile);
  if (!certificate.ok()) return certificate.status();
  if (session.json) {
    nlohmann::json json = CertificateToJson(*certificate);
    json["folder"] = folder.string();
    PrintJson(json);
  } else {
    std::cout << what << " " << certificate->identity.Text() << " until " << TimeText(certificate->not_after) << ", in "
              << folder.string() << "\n";
  }
  return absl::OkStatus();
}

// Who has no certificate cannot know the plant's authority either: nothing that comes is believed before the code has opened it.
absl::StatusOr<std::string> TakeSealed(const std::string& server, const std::string& pickup_id) {
  const auto channel = runtime::ConnectTo(server, runtime::CredentialsForAStranger());
  plant::v1::TakeCredentialsRequest request;
  request.set_pickup_id(pickup_id);
  plant::v1::TakeCredentialsResponse response;
  const grpc::Status taken = CredentialsService::NewStub(channel)->TakeCredentials(
      runtime::ContextFor(kTakePatience_s).get(), request, &response);
  if (!taken.ok()) return runtime::FromGrpc(taken);
  return std::move(*response.mutable_sealed());
}

}  // namespace

absl::Status OfferCredentials(Session* session, const identity::Identity& whose,
                              const identity::Credentials& credentials, int valid_hours) {
  const absl::StatusOr<identity::SealedCredentials> sealed = identity::Seal(credentials);
  if (!sealed.ok()) return sealed.status();
  plant::v1::OfferCredentialsRequest request;
  request.set_pickup_id(sealed->pickup_id);
  request.set_sealed(sealed->sealed);
  request.set_identity(whose.Text());
  request.set_valid_hours(valid_hours);
  plant::v1::OfferCredentialsResponse response;
  if (absl::Status status =
          session->Call<CredentialsService>("plant", &CredentialsStub::OfferCredentials, request, &response);
      !status.ok())
    return status;
  const auto until = runtime::MomentOf(response.expires_at());
  if (session->json) {
    PrintJson({{"who", whose.Text()}, {"code", sealed->code}, {"until", TimeText(until)}});
  } else {
    std::cout << "code for " << whose.Text() << ", good once, until " << TimeText(until) << ":\n  " << sealed->code
              << "\nthere: sixpoint --server HOST:PORT certs take --code CODE --folder DIR\n";
  }
  return absl::OkStatus();
}

absl::Status TakeCredentials(Session* session, const std::string& code, const fs::path& folder) {
  const absl::StatusOr<std::string> pickup_id = identity::PickupIdOf(code);
  if (!pickup_id.ok()) return pickup_id.status();
  // Before the code is used up: where it is to lie, something can.
  std::error_code unreadable;
  if (fs::exists(folder / identity::kIdentityFile, unreadable) || unreadable)
    return runtime::Refuse("--folder", folder.string(), "a folder without identity.pem");
  if (absl::Status may = identity::WriteCredentials(folder / "probe", {"x", "x"}); !may.ok()) return may;
  fs::remove_all(folder / "probe", unreadable);
  const absl::StatusOr<std::string> sealed = TakeSealed(session->server, *pickup_id);
  if (!sealed.ok()) return sealed.status();
  const absl::StatusOr<identity::Credentials> credentials = identity::Unseal(code, *sealed);
  if (!credentials.ok()) return credentials.status();
  if (absl::Status status = identity::WriteCredentials(folder, *credentials); !status.ok()) return status;
  return PrintFolder(*session, "took the certificate of", folder);
}

absl::Status FetchRenewal(Session* session) {
  const absl::StatusOr<fs::path> folder = IdentityFolder(session->identity, session->data);
  if (!folder.ok()) return folder.status();
  plant::v1::Renewal renewal;
  if (absl::Status status = session->Call<CredentialsService>("plant", &CredentialsStub::GetRenewal,
                                                              plant::v1::GetRenewalRequest(), &renewal);
      !status.ok())
    return status;
  if (absl::Status status = identity::ReplaceCertificate(*folder / identity::kIdentityFile, renewal.certificate_pem());
      !status.ok())
    return status;
  return PrintFolder(*session, "renewed the certificate of", *folder);
}

absl::Status OfferRenewal(Session* session, const std::string& certificate_pem) {
  plant::v1::OfferRenewalRequest request;
  request.set_certificate_pem(certificate_pem);
  plant::v1::OfferRenewalResponse response;
  return session->Call<CredentialsService>("plant", &CredentialsStub::OfferRenewal, request, &response);
}

HandedOver HandOver(const std::vector<IssuedCertificate>& issued, const std::vector<std::string>& users,
                    identity::TimePoint now) {
  // What counts, by its key: the one that lasts longest, and whether it follows another.
  std::map<std::string, const IssuedCertificate*> longest;
  std::map<std::string, int> count;
  for (const IssuedCertificate& certificate : issued) {
    const bool named = std::find(users.begin(), users.end(), certificate.identity.Text()) != users.end();
    const bool follows = certificate.identity.kind == identity::Kind::kMachine || named;
    if (!follows || certificate.revoked_at || certificate.not_after <= now) continue;
    const IssuedCertificate*& one = longest[certificate.public_key_sha256];
    if (one == nullptr || certificate.not_after > one->not_after) one = &certificate;
    ++count[certificate.public_key_sha256];
  }
  HandedOver over;
  for (const auto& [key, certificate] : longest) {
    if (certificate->not_after - now < (certificate->not_after - certificate->not_before) / 2)
      over.due.push_back(*certificate);
    else if (count.at(key) > 1)
      over.to_offer.push_back(*certificate);
  }
  return over;
}

}  // namespace sixpoint::cli

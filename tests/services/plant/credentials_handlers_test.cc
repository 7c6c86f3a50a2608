// The handlers of credentials on a fake store: no PostgreSQL. Over TLS, for some of them ask who calls.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "identity/credentials.h"
#include "services/plant/credentials_service.h"
#include "services/runtime/credentials.h"
#include "services/runtime/time_proto.h"
#include "storage/blobs.h"
#include "tests/support/becomes.h"
#include "tests/support/call.h"
#include "tests/support/fake_credentials.h"
#include "tests/support/in_process_server.h"
#include "tests/support/plant_certificates.h"

namespace sixpoint::plant {
namespace {

using std::chrono::hours;
using testing::Call;
using ::testing::ElementsAre;
using CredentialsStub = v1::CredentialsService::Stub;

v1::OfferCredentialsRequest SomeOffer(char digit, int valid_hours = 1) {
  v1::OfferCredentialsRequest request;
  request.set_pickup_id(std::string(64, digit));
  request.set_sealed(std::string("sealed of ") + digit);
  request.set_identity("machines/m1");
  request.set_valid_hours(valid_hours);
  return request;
}

v1::TakeCredentialsRequest TakingOf(const std::string& pickup_id) {
  v1::TakeCredentialsRequest request;
  request.set_pickup_id(pickup_id);
  return request;
}

class CredentialsHandlersTest : public ::testing::Test {
 protected:
  std::unique_ptr<CredentialsStub> StubOf(const std::filesystem::path& folder) const {
    return v1::CredentialsService::NewStub(
        runtime::ConnectTo(server_.address(), runtime::ChannelCredentialsOf(folder).value()));
  }
  absl::StatusOr<v1::OfferCredentialsResponse> Offer(const v1::OfferCredentialsRequest& request) {
    return Call(*admin_, &CredentialsStub::OfferCredentials, request);
  }
  absl::StatusOr<v1::TakeCredentialsResponse> Take(const std::string& pickup_id) {
    return Call(*stranger_, &CredentialsStub::TakeCredentials, TakingOf(pickup_id));
  }
  absl::Status OfferRenewal(const std::string& certificate_pem) {
    v1::OfferRenewalRequest request;
    request.set_certificate_pem(certificate_pem);
    return Call(*admin_, &CredentialsStub::OfferRenewal, request).status();
  }
  static absl::StatusOr<v1::Renewal> GetRenewal(CredentialsStub& stub) {
    return Call(stub, &CredentialsStub::GetRenewal, v1::GetRenewalRequest());
  }
  identity::IssuedCertificate CertificateIn(const std::filesystem::path& folder) const {
    return identity::ReadCertificate(folder / identity::kIdentityFile).value();
  }

  testing::PlantCertificates certificates_;
  const std::filesystem::path own_ = certificates_.Service("plant");
  std::shared_ptr<testing::FakeCredentials> store_ = std::make_shared<testing::FakeCredentials>();
  CredentialsService service_{
      store_, std::make_unique<identity::Trust>(own_ / identity::kAuthorityFile, certificates_.revoked_file())};
  testing::InProcessServer server_{
      {&service_}, 0, std::chrono::seconds(60), runtime::ServerCredentialsOf(own_).value()};
  const std::unique_ptr<CredentialsStub> admin_ = StubOf(certificates_.User("it", {identity::Role::kAdmin}));
  const std::unique_ptr<CredentialsStub> stranger_ = StubOf(certificates_.Nobody());
};

TEST_F(CredentialsHandlersTest, WhatIsOfferedIsTakenOnce) {
  const auto offered = Offer(SomeOffer('a', 2));
  ASSERT_TRUE(offered.ok()) << offered.status();
  const storage::Instant now = std::chrono::system_clock::now(), ends = runtime::MomentOf(offered->expires_at());
  EXPECT_GT(ends, now + hours(1));
  EXPECT_LE(ends, now + hours(2));
  EXPECT_EQ(Offer(SomeOffer('a', 20))->SerializeAsString(), offered->SerializeAsString());
  EXPECT_EQ(runtime::ReasonOf(Take(std::string(64, 'b')).status()), "CODE_NOT_VALID");
  const auto taken = Take(std::string(64, 'a'));
  ASSERT_TRUE(taken.ok()) << taken.status();
  EXPECT_EQ(taken->sealed(), "sealed of a");
  EXPECT_EQ(runtime::ReasonOf(Take(std::string(64, 'a')).status()), "CODE_NOT_VALID");
}

// Who reads the store cannot take what waits there.
TEST_F(CredentialsHandlersTest, TheStoreKeepsADigestOfThePickupIdAndWhoOffered) {
  ASSERT_TRUE(Offer(SomeOffer('a')).ok());
  const auto kept = store_->TakeOffer(storage::Sha256Hex(std::string(64, 'a')), [] { return true; }, {});
  ASSERT_TRUE(kept.ok() && kept->has_value()) << kept.status();
  EXPECT_EQ((**kept).identity, "machines/m1");
  EXPECT_EQ((**kept).offered_by, "users/it");
}

TEST_F(CredentialsHandlersTest, WhatIsOverIsNotGiven) {
  ASSERT_TRUE(Offer(SomeOffer('a', 2)).ok());
  ASSERT_TRUE(Offer(SomeOffer('b', 3)).ok());
  store_->LetPass(hours(2));
  EXPECT_EQ(runtime::ReasonOf(Take(std::string(64, 'a')).status()), "CODE_NOT_VALID");
  EXPECT_TRUE(Take(std::string(64, 'b')).ok());
}

TEST_F(CredentialsHandlersTest, AllThatIsWrongWithAnOfferIsToldAtOnce) {
  v1::OfferCredentialsRequest request;
  request.set_pickup_id("abc");
  constexpr char kWantedId[] = "lower-case hexadecimal of 32 bytes";
  EXPECT_THAT(
      ViolationsOf(Offer(request).status()),
      ElementsAre(Violation{"pickup_id", "3 bytes", kWantedId}, Violation{"sealed", "empty", "sealed credentials"},
                  Violation{"identity", "empty", "whose they are: machines/m1"},
                  Violation{"valid_hours", "0", "1 to 720"}));
  EXPECT_THAT(ViolationsOf(Offer(SomeOffer('a', 721)).status()),
              ElementsAre(Violation{"valid_hours", "721", "1 to 720"}));
  EXPECT_TRUE(Offer(SomeOffer('a', 720)).ok());
  // What is wrong with it is told without saying it.
  for (const std::string& pickup_id : {std::string(64, 'A'), std::string(64, 'g'), std::string(65, 'a')}) {
    const std::vector<Violation> expected{{"pickup_id", std::to_string(pickup_id.size()) + " bytes", kWantedId}};
    request = SomeOffer('b');
    request.set_pickup_id(pickup_id);
    EXPECT_EQ(ViolationsOf(Offer(request).status()), expected);
    EXPECT_EQ(ViolationsOf(Take(pickup_id).status()), expected);
  }
}

TEST_F(CredentialsHandlersTest, ACertificateIsFollowedByTheLongestOfItsKeyThatStillCounts) {
  const std::filesystem::path machine = certificates_.Machine("m1");
  const auto own = StubOf(machine), other = StubOf(certificates_.Machine("m2"));
  const identity::IssuedCertificate shown = CertificateIn(machine);
  const absl::Status none = GetRenewal(*own).status();
  EXPECT_EQ(runtime::ReasonOf(none), "RENEWAL_NOT_OFFERED");
  EXPECT_EQ(runtime::MetadataOf(none)["resource"], "machines/m1");
  const auto renewed = [&](int days) {
    return certificates_.authority().Renew(shown.serial, hours(24 * days)).value();
  };
  // One that lasts no longer than the one shown follows nothing.
  ASSERT_TRUE(OfferRenewal(renewed(20)).ok());
  EXPECT_EQ(runtime::ReasonOf(GetRenewal(*own).status()), "RENEWAL_NOT_OFFERED");
  const std::string longer = renewed(60), longest = renewed(90);
  for (const std::string& pem : {longer, longest, longer}) ASSERT_TRUE(OfferRenewal(pem).ok());
  const auto got = GetRenewal(*own);
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(got->certificate_pem(), longest);
  EXPECT_EQ(runtime::MomentOf(got->not_after()), identity::CertificateOf(longest)->not_after);
  EXPECT_EQ(runtime::ReasonOf(GetRenewal(*other).status()), "RENEWAL_NOT_OFFERED");
  // One that was taken back since is no help.
  ASSERT_TRUE(certificates_.authority().Revoke(identity::CertificateOf(longest)->serial).ok());
  certificates_.WriteRevoked();
  EXPECT_EQ(GetRenewal(*own)->certificate_pem(), longer);
}

TEST_F(CredentialsHandlersTest, ARenewalIsOfThisPlantsAuthorityAndOfWhoShowsACertificate) {
  testing::PlantCertificates elsewhere("another plant");
  const identity::IssuedCertificate foreign = CertificateIn(elsewhere.Machine("m1"));
  const std::string foreign_pem = elsewhere.authority().CertificatePemOf(foreign.serial).value();
  for (const std::string& pem : {std::string("nothing"), foreign_pem}) {
    const std::vector<Violation> refused = ViolationsOf(OfferRenewal(pem));
    ASSERT_EQ(refused.size(), 1u);
    EXPECT_EQ(refused[0].field, "certificate_pem");
    EXPECT_NE(refused[0].value, "empty");
    EXPECT_EQ(refused[0].wanted, "one of this plant's authority that holds now");
  }
  EXPECT_TRUE(store_->FindRenewals(foreign.public_key_sha256, {})->empty());
  EXPECT_EQ(GetRenewal(*stranger_).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(CredentialsHandlersTest, AStoreThatFailsComesToTheClient) {
  const std::filesystem::path machine = certificates_.Machine("m1");
  const std::string renewed = certificates_.authority().Renew(CertificateIn(machine).serial, hours(24 * 60)).value();
  store_->commits.Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Offer(SomeOffer('a')).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Take(std::string(64, 'a')).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(OfferRenewal(renewed).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(GetRenewal(*StubOf(machine)).status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(CredentialsHandlersTest, WhatIsGivenOnceIsNotGivenToWhoIsGone) {
  ASSERT_TRUE(Offer(SomeOffer('a')).ok());
  const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  store_->commits.BeforeCommit([&](const storage::StillWanted& still_wanted) {
    context->TryCancel();
    EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30), [&] { return !still_wanted(); }));
  });
  v1::TakeCredentialsResponse response;
  EXPECT_EQ(stranger_->TakeCredentials(context.get(), TakingOf(std::string(64, 'a')), &response).error_code(),
            grpc::StatusCode::CANCELLED);
  store_->commits.BeforeCommit(nullptr);
  EXPECT_EQ(Take(std::string(64, 'a'))->sealed(), "sealed of a");
}

}  // namespace
}  // namespace sixpoint::plant

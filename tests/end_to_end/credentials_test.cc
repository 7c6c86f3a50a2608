// A first certificate by a one-time code, and certificates that follow others, on the real processes.
#include "identity/credentials.h"

#include <grpcpp/generic/generic_stub.h>

#include "identity/sealed_credentials.h"
#include "sixpoint/plant/v1/credentials.grpc.pb.h"
#include "tests/end_to_end/door.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using identity::Role;
using ::testing::Contains;

using Credentials = plant::v1::CredentialsService::Stub;
using CredentialsDoor = Door;

// Who calls the plant's CredentialsService.
class Client {
 public:
  explicit Client(const std::shared_ptr<grpc::Channel>& channel)
      : stub_(plant::v1::CredentialsService::NewStub(channel)) {}
  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (Credentials::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) const {
    grpc::ClientContext context;
    context.set_deadline(Within(10));
    return (stub_.get()->*method)(&context, request, response);
  }
  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (Credentials::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request) const {
    Response response;
    return Call(method, request, &response);
  }

 private:
  const std::unique_ptr<Credentials> stub_;
};

// Whom anybody may call is called by whoever likes: with nothing behind it, on as many connections as he likes, again and again.
TEST_F(CredentialsDoor, StrangersWhoTakeNothingKeepNobodyOut) {
  constexpr int kConnections = 4, kCallsEach = 40;
  std::vector<grpc::GenericStub> stubs;
  for (int i = 0; i < kConnections; ++i) stubs.emplace_back(ChannelTo("plant", runtime::CredentialsForAStranger()));
  grpc::CompletionQueue queue;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::GenericClientAsyncReaderWriter>> calls;
  const auto end = Within(6);
  int answered = 0;
  std::thread strangers([&] {
    while (std::chrono::system_clock::now() < end) {
      contexts.push_back(std::make_unique<grpc::ClientContext>());
      contexts.back()->set_deadline(Within(20));
      calls.push_back(stubs[calls.size() % kConnections].PrepareCall(
          contexts.back().get(), "/sixpoint.plant.v1.CredentialsService/TakeCredentials", &queue));
      calls.back()->StartCall(calls.back().get());
      if (calls.size() % (kConnections * kCallsEach) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(500));
    }
  });
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const auto own = ChannelTo("plant", plant_.credentials());
  while (std::chrono::system_clock::now() < end) {
    const grpc::Status status = GetMachine(own);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND) << status.error_message();
    ++answered;
  }
  EXPECT_GT(answered, 20);
  strangers.join();
  for (const auto& context : contexts) context->TryCancel();
  queue.Shutdown();
  void* tag = nullptr;
  for (bool done = false; queue.Next(&tag, &done);) continue;
}

TEST_F(CredentialsDoor, ACodeOpensItsCredentialsOnce) {
  auto& certificates = plant_.certificates();
  const Client admin(ChannelTo("plant", Of(certificates.User("it", {Role::kAdmin}))));
  const Client stranger(ChannelTo("plant", runtime::CredentialsForAStranger()));
  const fs::path machine = certificates.Machine("m1");
  const auto sealed =
      identity::Seal({ReadFile(machine / identity::kIdentityFile), ReadFile(machine / identity::kAuthorityFile)});
  ASSERT_TRUE(sealed.ok()) << sealed.status();
  plant::v1::OfferCredentialsRequest offer;
  offer.set_pickup_id(sealed->pickup_id);
  offer.set_sealed(sealed->sealed);
  offer.set_identity("machines/m1");
  offer.set_valid_hours(1);
  ASSERT_TRUE(admin.Call(&Credentials::OfferCredentials, offer).ok());
  ASSERT_TRUE(admin.Call(&Credentials::OfferCredentials, offer).ok());
  plant::v1::TakeCredentialsRequest take;
  take.set_pickup_id(sealed->pickup_id);
  plant::v1::TakeCredentialsResponse taken;
  ASSERT_TRUE(stranger.Call(&Credentials::TakeCredentials, take, &taken).ok());
  const auto opened = identity::Unseal(sealed->code, taken.sealed());
  ASSERT_TRUE(opened.ok()) << opened.status();
  const fs::path out = certificates.folder() / "taken";
  ASSERT_TRUE(identity::WriteCredentials(out, *opened).ok());
  EXPECT_EQ(Unary(Of(out)).error_code(), grpc::StatusCode::NOT_FOUND);
  const grpc::Status again = stranger.Call(&Credentials::TakeCredentials, take, &taken);
  EXPECT_EQ(again.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ReasonOf(again), "CODE_NOT_VALID");
  EXPECT_THAT(Denials("CODE_NOT_VALID"), Contains(::testing::Field(&storage::Denial::reason, "CODE_NOT_VALID")));
  for (const char* pickup_id : {"", "x", "zz"}) {
    take.set_pickup_id(pickup_id);
    EXPECT_EQ(stranger.Call(&Credentials::TakeCredentials, take, &taken).error_code(),
              grpc::StatusCode::INVALID_ARGUMENT);
  }
}

// However long the database takes: who needs no certificate is not ended for having none.
TEST_F(CredentialsDoor, AStrangerIsGivenTimeToTakeHisCredentials) {
  auto& certificates = plant_.certificates();
  const Client admin(ChannelTo("plant", Of(certificates.User("it", {Role::kAdmin}))));
  const Client stranger(ChannelTo("plant", runtime::CredentialsForAStranger()));
  plant::v1::OfferCredentialsRequest offer;
  offer.set_pickup_id(std::string(64, 'a'));
  offer.set_sealed("sealed");
  offer.set_identity("machines/m1");
  offer.set_valid_hours(1);
  ASSERT_TRUE(admin.Call(&Credentials::OfferCredentials, offer).ok());
  const auto owner = storage::Database::Open(database_.conninfo(), 1);
  grpc::Status taken;
  std::thread taking;
  {
    auto holder = owner->Begin(Soon());
    ASSERT_TRUE(holder->Execute("SELECT 1 FROM credential_offers FOR UPDATE").ok());
    taking = std::thread([&] {
      plant::v1::TakeCredentialsRequest take;
      take.set_pickup_id(offer.pickup_id());
      plant::v1::TakeCredentialsResponse response;
      taken = stranger.Call(&Credentials::TakeCredentials, take, &response);
    });
    std::this_thread::sleep_for(std::chrono::seconds(3));
  }
  taking.join();
  EXPECT_TRUE(taken.ok()) << taken.error_message();
}

// The key stays where it is; the plant keeps only what its own authority gave, for the holder of that key.
TEST_F(CredentialsDoor, ACertificateIsFollowedByTheNextOfItsKey) {
  auto& certificates = plant_.certificates();
  const Client admin(ChannelTo("plant", Of(certificates.User("it", {Role::kAdmin}))));
  const fs::path machine = certificates.Machine("m1"), other = certificates.Machine("m2");
  const Client own(ChannelTo("plant", Of(machine))), stranger(ChannelTo("plant", Of(other)));
  plant::v1::Renewal renewal;
  EXPECT_EQ(ReasonOf(own.Call(&Credentials::GetRenewal, plant::v1::GetRenewalRequest(), &renewal)),
            "RENEWAL_NOT_OFFERED");
  const auto before = identity::ReadCertificate(machine / identity::kIdentityFile);
  const auto renewed = certificates.authority().Renew(before->serial, std::chrono::hours(24 * 60));
  ASSERT_TRUE(renewed.ok()) << renewed.status();
  plant::v1::OfferRenewalRequest offer;
  offer.set_certificate_pem(*renewed);
  ASSERT_TRUE(admin.Call(&Credentials::OfferRenewal, offer).ok());
  EXPECT_EQ(ReasonOf(stranger.Call(&Credentials::GetRenewal, plant::v1::GetRenewalRequest(), &renewal)),
            "RENEWAL_NOT_OFFERED");
  const grpc::Status got = own.Call(&Credentials::GetRenewal, plant::v1::GetRenewalRequest(), &renewal);
  ASSERT_TRUE(got.ok()) << got.error_message();
  ASSERT_TRUE(identity::ReplaceCertificate(machine / identity::kIdentityFile, renewal.certificate_pem()).ok());
  const auto after = identity::ReadCertificate(machine / identity::kIdentityFile);
  EXPECT_GT(after->not_after, before->not_after);
  EXPECT_NE(after->serial, before->serial);
  EXPECT_EQ(Unary(Of(machine)).error_code(), grpc::StatusCode::NOT_FOUND);
  PlantCertificates elsewhere("another plant");
  offer.set_certificate_pem(ReadFile(elsewhere.Machine("m1") / identity::kIdentityFile));
  EXPECT_EQ(admin.Call(&Credentials::OfferRenewal, offer).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  offer.set_certificate_pem("nothing");
  EXPECT_EQ(admin.Call(&Credentials::OfferRenewal, offer).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace sixpoint::testing

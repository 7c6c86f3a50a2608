// The handlers on a fake store: no PostgreSQL, and no scan is fitted. What is fitted is tested in registration_service_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/registration/registration_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_call.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/fake_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::registration {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Store = testing::FakeResults<storage::RegistrationRow, storage::RegistrationFilter>;

class RegistrationHandlersTest : public ::testing::Test {
 protected:
  v1::RegisterRequest Request(const std::string& request_id = "") const {
    v1::RegisterRequest request;
    request.set_blade("blades/sn1");
    request.add_scans(plant_.scans.front());
    request.set_method(v1::METHOD_BEST_FIT);
    request.set_request_id(request_id);
    return request;
  }
  absl::StatusOr<v1::Registration> Register(const v1::RegisterRequest& request) {
    v1::Registration registration;
    const grpc::Status status = stub_->Register(runtime::ContextFor(10).get(), request, &registration);
    if (!status.ok()) return runtime::FromGrpc(status);
    return registration;
  }
  // As if it had been registered.
  void Add(const std::string& serial, const v1::RegisterRequest& request) {
    storage::RegistrationRow row;
    row.registration_id = storage::NewUuid();
    row.blade_serial = serial;
    row.method = "BEST_FIT";
    row.outcome = "NOT_CONVERGED";
    ASSERT_TRUE(store_->Record(runtime::RecordedRequestOf("registration.Register", request, ""), row, {}, {}).ok());
  }
  std::vector<std::string> Names(const v1::ListRegistrationsRequest& request, std::string* next_page_token) {
    v1::ListRegistrationsResponse page;
    EXPECT_TRUE(stub_->ListRegistrations(runtime::ContextFor(5).get(), request, &page).ok());
    std::vector<std::string> names;
    for (const v1::Registration& registration : page.registrations()) names.push_back(registration.name());
    *next_page_token = page.next_page_token();
    return names;
  }

  testing::StandIns plant_;
  std::shared_ptr<Store> store_ =
      std::make_shared<Store>(&storage::RegistrationRow::registration_id,
                              [](const storage::RegistrationRow& row, const storage::RegistrationFilter& filter) {
                                return filter.blade_serial.empty() || row.blade_serial == filter.blade_serial;
                              });
  RegistrationService service_{store_, Peers{plant_.Connect(), plant_.Connect(), plant_.Connect()}, {}};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::RegistrationService::Stub> stub_ = v1::RegistrationService::NewStub(server_.Connect());
};

TEST_F(RegistrationHandlersTest, ARetryGetsTheKeptAnswerWithoutAnyWork) {
  Add("sn1", Request(kSomeUuid));
  const auto again = Register(Request(kSomeUuid));  // the stand-in plant knows no blades: work would fail
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->name(), "registrations/" + store_->rows().front().registration_id);
  v1::RegisterRequest other = Request(kSomeUuid);
  other.set_method(v1::METHOD_LOCAL);
  EXPECT_EQ(Register(other).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(RegistrationHandlersTest, NothingIsRecordedOfWhatIsRefused) {
  v1::RegisterRequest request = Request();
  request.clear_scans();
  EXPECT_THAT(std::string(Register(request).status().message()), HasSubstr("scans: 0 scans, want at least 1"));
  EXPECT_FALSE(Register(Request()).ok());  // GetBlade is not known to the stand-in
  EXPECT_TRUE(store_->rows().empty());
  EXPECT_TRUE(store_->entries().empty());
}

TEST_F(RegistrationHandlersTest, ListsByPagesNewestFirstAndByBlade) {
  for (const char* serial : {"sn1", "sn2", "sn1"}) Add(serial, Request());
  const auto name = [&](std::size_t i) { return "registrations/" + store_->rows()[i].registration_id; };
  v1::ListRegistrationsRequest request;
  request.set_page_size(2);
  std::string token;
  EXPECT_THAT(Names(request, &token), ElementsAre(name(2), name(1)));
  request.set_page_token(token);
  EXPECT_THAT(Names(request, &token), ElementsAre(name(0)));
  EXPECT_EQ(token, "");
  request.clear_page_token();
  request.set_blade("blades/sn1");
  EXPECT_THAT(Names(request, &token), ElementsAre(name(2), name(0)));
}

TEST_F(RegistrationHandlersTest, SaysWhatTheStoreSays) {
  store_->Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Register(Request(kSomeUuid)).status().code(), absl::StatusCode::kUnavailable);
  v1::GetRegistrationRequest get;
  get.set_name(std::string("registrations/") + kSomeUuid);
  v1::Registration registration;
  EXPECT_EQ(stub_->GetRegistration(runtime::ContextFor(5).get(), get, &registration).error_code(),
            grpc::StatusCode::UNAVAILABLE);
  store_->Fail(absl::OkStatus());
  const grpc::Status none = stub_->GetRegistration(runtime::ContextFor(5).get(), get, &registration);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(none)), "REGISTRATION_NOT_FOUND");
}

}  // namespace
}  // namespace sixpoint::registration

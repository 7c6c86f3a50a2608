// The handlers on a fake store: no PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/correction/correction_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/fake_results.h"

namespace sixpoint::correction {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Store = testing::FakeResults<storage::CorrectionRow, storage::CorrectionFilter>;

constexpr char kId[] = "018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e";

class CorrectionHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Correction> Correct(const v1::CorrectRequest& request) {
    v1::Correction correction;
    const grpc::Status status = stub_->Correct(runtime::ContextFor(30).get(), request, &correction);
    if (!status.ok()) return runtime::FromGrpc(status);
    return correction;
  }
  static v1::CorrectRequest Request(const std::string& request_id = "") {
    v1::CorrectRequest request;
    request.set_registration(testing::kRegistration);
    request.set_request_id(request_id);
    request.set_requested_by("operator");
    return request;
  }

  testing::StandIns plant_;
  std::shared_ptr<Store> store_ =
      std::make_shared<Store>(&storage::CorrectionRow::correction_id,
                              [](const storage::CorrectionRow& row, const storage::CorrectionFilter& filter) {
                                return filter.blade_serial.empty() || row.blade_serial == filter.blade_serial;
                              });
  CorrectionService service_{store_, std::make_unique<Peers>(plant_.Connect(), plant_.Connect(), plant_.Connect()), 4};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::CorrectionService::Stub> stub_ = v1::CorrectionService::NewStub(server_.Connect());
};

TEST_F(CorrectionHandlersTest, RecordsWhatItRestsOnWithTheAnswer) {
  v1::CorrectRequest request = Request();
  request.set_nc_template("G90\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  ASSERT_EQ(store_->rows().size(), 1u);
  const storage::CorrectionRow row = store_->rows().front();
  EXPECT_EQ(correction->name(), "corrections/" + row.correction_id);
  EXPECT_EQ(row.nc_template, request.nc_template());
  EXPECT_EQ(row.nc_program, correction->nc_program());
  EXPECT_NE(row.nc_program, "");
  EXPECT_EQ(row.requested_by, "operator");
  const storage::RecordEntry entry = store_->entries().front();
  EXPECT_EQ(entry.name, correction->name());
  EXPECT_THAT(entry.inputs, ElementsAre(testing::kRegistration, "machines/m1@1", "parts/p1@1",
                                        testing::kSensorCalibration, testing::kRotationCalibration));
}

TEST_F(CorrectionHandlersTest, ARetryGetsTheKeptAnswerEvenWhereTheWorldHasChanged) {
  const auto first = Correct(Request(kId));
  ASSERT_TRUE(first.ok()) << first.status();
  plant_.calibration.expired = true;
  const auto again = Correct(Request(kId));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->SerializeAsString(), first->SerializeAsString());
  EXPECT_EQ(store_->rows().size(), 1u);
  v1::CorrectRequest other = Request(kId);
  other.add_groups("G1");
  EXPECT_EQ(Correct(other).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(CorrectionHandlersTest, NothingIsRecordedOfWhatIsRefusedOrFails) {
  v1::CorrectRequest request = Request();
  request.add_groups("G9");
  EXPECT_THAT(std::string(Correct(request).status().message()),
              HasSubstr("groups[0]: G9, want a hole group of parts/p1"));
  plant_.calibration.expired = true;
  EXPECT_EQ(Correct(Request()).status().code(), absl::StatusCode::kFailedPrecondition);
  plant_.calibration.expired = false;
  store_->Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Correct(Request(kId)).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(store_->rows().empty());
}

TEST_F(CorrectionHandlersTest, ListsByPagesNewestFirst) {
  std::vector<std::string> names;
  for (int i = 0; i < 3; ++i) names.push_back(Correct(Request())->name());
  v1::ListCorrectionsRequest request;
  request.set_page_size(2);
  v1::ListCorrectionsResponse page;
  ASSERT_TRUE(stub_->ListCorrections(runtime::ContextFor(5).get(), request, &page).ok());
  ASSERT_EQ(page.corrections_size(), 2);
  EXPECT_EQ(page.corrections(0).name(), names[2]);
  request.set_page_token(page.next_page_token());
  v1::ListCorrectionsResponse last;
  ASSERT_TRUE(stub_->ListCorrections(runtime::ContextFor(5).get(), request, &last).ok());
  ASSERT_EQ(last.corrections_size(), 1);
  EXPECT_EQ(last.corrections(0).name(), names[0]);
  EXPECT_EQ(last.next_page_token(), "");
  request.set_blade("blades/other");
  EXPECT_EQ(stub_->ListCorrections(runtime::ContextFor(5).get(), request, &page).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);  // a token of other filters
}

TEST_F(CorrectionHandlersTest, NamesWhatItDoesNotKnow) {
  v1::GetCorrectionRequest get;
  get.set_name(std::string("corrections/") + kId);
  v1::Correction correction;
  const grpc::Status status = stub_->GetCorrection(runtime::ContextFor(5).get(), get, &correction);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(status)), "CORRECTION_NOT_FOUND");
}

}  // namespace
}  // namespace sixpoint::correction

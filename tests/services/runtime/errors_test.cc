#include "services/runtime/errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace sixpoint::runtime {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

google::rpc::Status DetailsOf(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  return details;
}

TEST(ToGrpc, ARefusalNamesItsFieldForEveryClient) {
  const grpc::Status status = ToGrpc(Refuse("header.a_deg", 400, "-180 to 180"));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  const google::rpc::Status details = DetailsOf(status);
  EXPECT_EQ(details.code(), 3);
  EXPECT_EQ(details.message(), status.error_message());
  ASSERT_EQ(details.details_size(), 3);
  google::rpc::ErrorInfo info;
  ASSERT_TRUE(details.details(0).UnpackTo(&info));
  EXPECT_EQ(info.reason(), "INVALID_ARGUMENT");
  EXPECT_EQ(info.domain(), "sixpoint");
  google::rpc::BadRequest bad_request;
  ASSERT_TRUE(details.details(1).UnpackTo(&bad_request));
  ASSERT_EQ(bad_request.field_violations_size(), 1);
  EXPECT_EQ(bad_request.field_violations(0).field(), "header.a_deg");
  EXPECT_EQ(bad_request.field_violations(0).description(), "header.a_deg: 400, want -180 to 180");
}

TEST(ToGrpc, EveryCodeStaysItselfThereAndBack) {
  for (int number = 1; number <= 16; ++number) {
    const absl::Status before(static_cast<absl::StatusCode>(number), "why");
    const grpc::Status wire = ToGrpc(before);
    EXPECT_EQ(static_cast<int>(wire.error_code()), number);
    EXPECT_EQ(FromGrpc(wire).code(), before.code());
    EXPECT_EQ(ReasonOf(FromGrpc(wire)), "");
    const bool retried = wire.error_code() == grpc::StatusCode::UNAVAILABLE ||
                         wire.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED ||
                         wire.error_code() == grpc::StatusCode::ABORTED;
    bool told = false;
    const google::rpc::Status details = DetailsOf(wire);
    for (const auto& detail : details.details()) told = told || detail.Is<google::rpc::RetryInfo>();
    EXPECT_EQ(told, retried) << number;
  }
  EXPECT_TRUE(ToGrpc(absl::OkStatus()).ok());
  EXPECT_TRUE(FromGrpc(grpc::Status::OK).ok());
}

TEST(ToGrpc, ReasonMetadataAndMessageSurviveTwoHops) {
  const absl::Status before = Failure(errors::v1::CALIBRATION_EXPIRED, "calibrations/c1: expired",
                                      {{"resource", "calibrations/c1"}, {"in_force", "calibrations/c2"}});
  EXPECT_EQ(before.code(), absl::StatusCode::kFailedPrecondition);
  const absl::Status after = FromGrpc(ToGrpc(FromGrpc(ToGrpc(before))));
  EXPECT_EQ(after.code(), before.code());
  EXPECT_EQ(after.message(), before.message());
  EXPECT_EQ(ReasonOf(after), "CALIBRATION_EXPIRED");
  EXPECT_EQ(MetadataOf(after), MetadataOf(before));
  EXPECT_EQ(MetadataOf(after).at("in_force"), "calibrations/c2");
}

TEST(ToGrpc, AFailedPreconditionNamesItsReasonAndWhatItIsAbout) {
  const google::rpc::Status details =
      DetailsOf(ToGrpc(Failure(errors::v1::PART_WITHOUT_HOLES, "parts/p: no holes", {{"resource", "parts/p"}})));
  ASSERT_EQ(details.details_size(), 2);
  google::rpc::ErrorInfo info;
  ASSERT_TRUE(details.details(0).UnpackTo(&info));
  EXPECT_EQ(info.reason(), "PART_WITHOUT_HOLES");
  EXPECT_EQ(info.domain(), "sixpoint");
  EXPECT_EQ(info.metadata().at("resource"), "parts/p");
  google::rpc::PreconditionFailure failure;
  ASSERT_TRUE(details.details(1).UnpackTo(&failure));
  ASSERT_EQ(failure.violations_size(), 1);
  EXPECT_EQ(failure.violations(0).type(), "PART_WITHOUT_HOLES");
  EXPECT_EQ(failure.violations(0).subject(), "parts/p");
  EXPECT_EQ(failure.violations(0).description(), "parts/p: no holes");
}

TEST(ToGrpc, EveryViolationSurvivesTwoHops) {
  const absl::Status before = Refuse({{"name", "x, want y", "z"}, {"scans[3].a_deg", "400", "-180 to 180"}});
  EXPECT_EQ(FromGrpc(ToGrpc(FromGrpc(ToGrpc(before)))), before);
}

TEST(ToGrpc, MoreViolationsThanFitIntoTheHeaderAreCutAtTheEnd) {
  std::vector<Violation> many;
  for (int i = 0; i < 100; ++i) many.push_back({"scans[" + std::to_string(i) + "]", std::string(120, 'v'), "less"});
  const grpc::Status status = ToGrpc(Refuse(many));
  EXPECT_LT(status.error_message().size() + status.error_details().size() * 4 / 3, 8192u);
  const std::vector<Violation> told = ViolationsOf(FromGrpc(status));
  ASSERT_GT(told.size(), 3u);
  ASSERT_LT(told.size(), 100u);
  EXPECT_TRUE(std::equal(told.begin(), told.end(), many.begin()));
}

TEST(ToGrpc, InternalTellsTheLogNotTheClient) {
  ::testing::internal::CaptureStderr();
  const grpc::Status status = ToGrpc(absl::InternalError("column secret_table.password does not exist"));
  const std::string logged = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INTERNAL);
  EXPECT_THAT(status.error_message(), Not(HasSubstr("secret_table")));
  EXPECT_THAT(status.error_details(), Not(HasSubstr("secret_table")));
  EXPECT_THAT(logged, HasSubstr("secret_table"));
  // The reference that the client has finds the line.
  EXPECT_THAT(logged, HasSubstr(status.error_message().substr(status.error_message().size() - 36)));
}

TEST(ToGrpc, TheDetailsFitInAHeaderBlock) {
  const grpc::Status status =
      ToGrpc(Refuse(std::string(1 << 20, 'f'), std::string(1 << 20, 'v'), std::string(1 << 20, 'w')));
  EXPECT_LT(status.error_message().size() + status.error_details().size() * 4 / 3, 8192u);
}

TEST(FromGrpc, SurvivesAForeignPeer) {
  EXPECT_EQ(FromGrpc(grpc::Status(static_cast<grpc::StatusCode>(25), "odd")).code(), absl::StatusCode::kUnknown);
  const absl::Status garbled = FromGrpc(grpc::Status(grpc::StatusCode::NOT_FOUND, "gone", "\xff\xff not a message"));
  EXPECT_EQ(garbled.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(garbled.message(), "gone");
}

}  // namespace
}  // namespace sixpoint::runtime

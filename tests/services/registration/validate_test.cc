#include "services/registration/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/runtime/errors.h"

namespace sixpoint::registration {
namespace {

using ::testing::HasSubstr;

v1::RegisterRequest Good() {
  v1::RegisterRequest request;
  request.set_blade("blades/SN-0001");
  request.add_scans("scans/a");
  request.add_scans("scans/b");
  request.set_method(v1::METHOD_BEST_FIT);
  return request;
}

std::string MessageOf(const v1::RegisterRequest& request) {
  const absl::Status status = CheckRequest(request);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(CheckRequest, TakesAGoodOne) { EXPECT_TRUE(CheckRequest(Good()).ok()); }

TEST(CheckRequest, NamesFieldValueAndWhatWasWanted) {
  v1::RegisterRequest request = Good();
  request.set_blade("parts/p1");
  EXPECT_THAT(MessageOf(request), HasSubstr("blade: parts/p1"));
  request = Good();
  request.clear_scans();
  EXPECT_THAT(MessageOf(request), HasSubstr("scans: 0 scans, want 1 to 64"));
  request = Good();
  for (int i = 0; i < 64; ++i) request.add_scans("scans/" + std::to_string(i));
  EXPECT_THAT(MessageOf(request), HasSubstr("scans: 66 scans"));
  request = Good();
  request.add_scans("scans/a");
  EXPECT_THAT(MessageOf(request), HasSubstr("scans[2]: scans/a, want each scan once"));
  request = Good();
  request.set_method(v1::METHOD_UNSPECIFIED);
  EXPECT_THAT(MessageOf(request), HasSubstr("method: 0, want METHOD_BEST_FIT"));
  request.set_method(static_cast<v1::Method>(99));
  EXPECT_THAT(MessageOf(request), HasSubstr("method: 99"));
  request = Good();
  request.set_request_id("not a uuid");
  EXPECT_THAT(MessageOf(request), HasSubstr("request_id"));
  request = Good();
  request.set_requested_by(std::string(201, 'x'));
  EXPECT_THAT(MessageOf(request), HasSubstr("requested_by: 201 bytes"));
}

TEST(CheckScan, WantsThisBladeOnOneMachine) {
  ingest::v1::Scan first;
  first.set_name("scans/a");
  first.mutable_header()->set_subject("blades/SN-0001");
  first.mutable_header()->set_machine("machines/m1");
  EXPECT_TRUE(CheckScan(Good(), first, first).ok());
  ingest::v1::Scan scan = first;
  scan.mutable_header()->set_subject("artefacts/plate-1");
  EXPECT_THAT(std::string(CheckScan(Good(), scan, first).message()),
              HasSubstr("subject: artefacts/plate-1, want blades/SN-0001"));
  scan = first;
  scan.mutable_header()->set_machine("machines/m2");
  EXPECT_THAT(std::string(CheckScan(Good(), scan, first).message()), HasSubstr("machine: machines/m2"));
}

TEST(DatumsOf, RefusesAPartWithoutSixPoints) {
  plant::v1::Part part;
  part.set_name("parts/p1");
  const absl::Status status = DatumsOf(part).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(status), "SIX_POINTS_MISSING");
  EXPECT_THAT(std::string(status.message()), HasSubstr("has 0 points, want 6"));
}

}  // namespace
}  // namespace sixpoint::registration

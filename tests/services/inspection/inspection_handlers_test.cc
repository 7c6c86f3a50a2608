// The handlers on a fake store: no PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/inspection/inspection_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/fake_inspections.h"
#include "tests/support/sanitizer.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::Contains;
using ::testing::HasSubstr;

class InspectionHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Inspection> Inspect(const v1::InspectRequest& request) {
    v1::Inspection inspection;
    const grpc::Status status =
        stub_->Inspect(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &inspection);
    if (!status.ok()) return runtime::FromGrpc(status);
    return inspection;
  }
  v1::InspectRequest Request(const std::string& request_id = "") const {
    v1::InspectRequest request;
    request.set_blade("blades/sn1");
    for (const std::string& scan : plant_.scans) request.add_scans(scan);
    request.set_request_id(request_id);
    return request;
  }

  testing::StandIns plant_;
  std::shared_ptr<testing::FakeInspections> store_ = std::make_shared<testing::FakeInspections>();
  InspectionService service_{
      store_,
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {}};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::InspectionService::Stub> stub_ = v1::InspectionService::NewStub(server_.Connect());
};

TEST_F(InspectionHandlersTest, RecordsTheVerdictWithWhatItRestsOn) {
  const auto inspection = Inspect(Request());
  ASSERT_TRUE(inspection.ok()) << inspection.status();
  ASSERT_EQ(store_->rows().size(), 1u);
  EXPECT_EQ(inspection->name(), "inspections/" + store_->rows().front().inspection_id);
  EXPECT_EQ(store_->rows().front().holes.size(), static_cast<std::size_t>(inspection->holes_size()));
  const storage::RecordEntry entry = store_->entries().front();
  EXPECT_THAT(entry.inputs, Contains(testing::kRegistration));
  EXPECT_THAT(entry.inputs, Contains(plant_.scans.front()));
}

TEST_F(InspectionHandlersTest, ARetryRegistersNothingAnew) {
  const auto first = Inspect(Request(kSomeUuid));
  ASSERT_TRUE(first.ok()) << first.status();
  const int register_count = plant_.registration.register_count;
  const auto again = Inspect(Request(kSomeUuid));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->SerializeAsString(), first->SerializeAsString());
  EXPECT_EQ(plant_.registration.register_count, register_count);
  EXPECT_EQ(store_->rows().size(), 1u);
}

// The stand-in part at a station of two: where the other one is near, pins have the points alone that are nearer to this one.
TEST_F(InspectionHandlersTest, APinAtAStationHasNoPointsThatAreNearerToAnotherPart) {
  plant_.registration.registration.set_station("here");
  for (const char* name : {"here", "over"}) {
    plant::v1::Station& station = *plant_.plant.part.add_stations();
    station.set_station(name);
    station.set_capture_mm(0.5);
  }
  const Eigen::Isometry3d& pose = plant_.block.pose.zero_from_part;
  runtime::ToProto(pose, plant_.plant.part.mutable_stations(0)->mutable_zero_from_part_nominal());
  std::vector<int> counts;
  for (const double over_mm : {100.0, 12.0}) {  // a block of 10 mm: its lower face is 2 mm over this one's top
    runtime::ToProto(pose * Eigen::Translation3d(0, 0, over_mm),
                     plant_.plant.part.mutable_stations(1)->mutable_zero_from_part_nominal());
    const auto inspection = Inspect(Request());
    ASSERT_TRUE(inspection.ok()) << inspection.status();
    counts.push_back(inspection->holes(0).point_count());
  }
  EXPECT_GT(counts[0], 2 * counts[1]);
}

TEST_F(InspectionHandlersTest, NothingIsRecordedOfWhatIsRefusedOrFails) {
  v1::InspectRequest request = Request();
  request.clear_scans();
  EXPECT_THAT(std::string(Inspect(request).status().message()), HasSubstr("scans: 0 scans, want at least 1"));
  plant_.registration.refusal = absl::UnavailableError("registration: away");
  EXPECT_EQ(Inspect(Request()).status().code(), absl::StatusCode::kUnavailable);
  plant_.registration.refusal = absl::OkStatus();
  store_->Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Inspect(Request(kSomeUuid)).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(store_->rows().empty());
}

}  // namespace
}  // namespace sixpoint::inspection

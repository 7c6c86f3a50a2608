// Whether corrections were right, over real gRPC on a real PostgreSQL, with the rights that the service has.
#include "services/inspection/efficacy_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/support/cut_blades.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::inspection {
namespace {

using testing::CutBlade;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class EfficacyServiceTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Efficacy> Compute(v1::ComputeEfficacyRequest request) {
    if (request.machine().empty()) request.set_machine("machines/m1");
    v1::Efficacy efficacy;
    const auto context = runtime::ContextFor(20.0);
    const absl::Status status = runtime::FromGrpc(stub_->ComputeEfficacy(context.get(), request, &efficacy));
    if (!status.ok()) return status;
    return efficacy;
  }
  v1::Efficacy Computed(const v1::ComputeEfficacyRequest& request = {}) {
    const auto efficacy = Compute(request);
    EXPECT_TRUE(efficacy.ok()) << efficacy.status();
    return efficacy.ok() ? *efficacy : v1::Efficacy{};
  }
  // 30 um along X and -10 um along Y, blades 2 um apart.
  void CutMany(int first, int count) {
    for (int i = first; i < first + count; ++i)
      plant_.Cut({"SN-" + std::to_string(i), {0.030 + 0.002 * std::sin(2.6 * i), -0.010 + 0.002 * std::cos(5 * i), 0}});
  }
  testing::CutBlades plant_;
  std::unique_ptr<storage::Database> as_inspection_ =
      storage::Database::Open(testing::AsRole(plant_.database.conninfo(), "inspection"), 1);
  EfficacyService service_{storage::OutcomesIn(as_inspection_.get())};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::EfficacyService::Stub> stub_ = v1::EfficacyService::NewStub(server_.Connect());
};

TEST_F(EfficacyServiceTest, GivesAPlantedOffsetBackAndOffersIt) {
  CutMany(1, 8);
  const v1::Efficacy efficacy = Computed();
  EXPECT_EQ(efficacy.machine(), "machines/m1");
  ASSERT_THAT(efficacy.periods(), SizeIs(1));
  const v1::EfficacyPeriod& period = efficacy.periods(0);
  EXPECT_TRUE(period.in_force());
  EXPECT_EQ(period.machine(), "machines/m1@1");
  EXPECT_EQ(period.rotation_calibration(), plant_.calibrations().rotation);
  ASSERT_THAT(period.blades(), SizeIs(8));
  EXPECT_EQ(period.blades(0).blade(), "blades/SN-1");
  EXPECT_EQ(period.hole_count(), 32);
  EXPECT_THAT(period.not_offered(), IsEmpty());
  ASSERT_THAT(period.offered_offset().components(), SizeIs(2));
  const v1::OffsetEstimate &x = period.offered_offset().components(0), &y = period.offered_offset().components(1);
  EXPECT_EQ(x.component(), v1::OFFSET_COMPONENT_X);
  EXPECT_NEAR(x.value(), 0.030, x.expanded_uncertainty());
  EXPECT_NEAR(y.value(), -0.010, y.expanded_uncertainty());
  // The budget's 3 um of the sensor's calibration stay, however many blades there are.
  EXPECT_NEAR(x.shared_standard_uncertainty(), 0.003, 1e-9);
  EXPECT_LT(x.expanded_uncertainty(), 0.008);
  EXPECT_THAT(period.not_determined(), ElementsAre(v1::OFFSET_COMPONENT_Z));
  EXPECT_THAT(period.holes(), SizeIs(4));
}

// What the demo's plant has.
TEST_F(EfficacyServiceTest, OneBladeIsNotEnough) {
  CutMany(1, 1);
  const v1::Efficacy efficacy = Computed();
  ASSERT_THAT(efficacy.periods(), SizeIs(1));
  EXPECT_FALSE(efficacy.periods(0).has_offered_offset());
  EXPECT_THAT(efficacy.periods(0).not_offered(), ElementsAre(v1::NOT_OFFERED_TOO_FEW_BLADES));
  ASSERT_FALSE(efficacy.periods(0).offsets().empty());
  EXPECT_FALSE(efficacy.periods(0).offsets(0).has_expanded_uncertainty());
}

TEST_F(EfficacyServiceTest, ANewCalibrationBeginsAnewAndTheOldOneOffersNothing) {
  CutMany(1, 8);
  plant_.CalibrateAxesAnew();
  CutMany(9, 2);
  const v1::Efficacy efficacy = Computed();
  ASSERT_THAT(efficacy.periods(), SizeIs(2));
  EXPECT_THAT(efficacy.periods(0).blades(), SizeIs(2));
  EXPECT_TRUE(efficacy.periods(0).in_force());
  EXPECT_THAT(efficacy.periods(0).not_offered(), ElementsAre(v1::NOT_OFFERED_TOO_FEW_BLADES));
  EXPECT_THAT(efficacy.periods(1).blades(), SizeIs(8));
  EXPECT_FALSE(efficacy.periods(1).in_force());
  EXPECT_TRUE(efficacy.periods(1).position_test().significant());
  EXPECT_THAT(efficacy.periods(1).not_offered(), ElementsAre(v1::NOT_OFFERED_NOT_IN_FORCE));
  EXPECT_FALSE(efficacy.periods(1).has_offered_offset());
}

TEST_F(EfficacyServiceTest, CountsWhatItLeavesOut) {
  CutBlade blade{"SN-1"};
  blade.inspected = false;
  plant_.Cut(blade);
  blade = {"SN-2"};
  blade.positioning_open = true;
  plant_.Cut(blade);
  blade = {"SN-3"};
  blade.measured = false;
  plant_.Cut(blade);
  CutMany(4, 1);
  plant_.InspectAnew({"SN-4"});
  v1::LeftOut left_out = Computed().left_out();
  EXPECT_EQ(left_out.not_inspected(), 1);
  EXPECT_EQ(left_out.positioning_open(), 1);
  EXPECT_EQ(left_out.no_hole(), 1);
  EXPECT_EQ(left_out.superseded_inspections(), 1);
  EXPECT_EQ(left_out.withdrawn(), 0);
  plant_.Withdraw(plant_.calibrations().rotation);
  const v1::Efficacy after = Computed();
  EXPECT_EQ(after.left_out().withdrawn(), 3);
  EXPECT_THAT(after.periods(), IsEmpty());
}

TEST_F(EfficacyServiceTest, RefusesByFieldValueAndWanted) {
  const auto refusal = [&](const std::function<void(v1::ComputeEfficacyRequest*)>& set) {
    v1::ComputeEfficacyRequest request;
    set(&request);
    return std::string(Compute(request).status().message());
  };
  EXPECT_THAT(refusal([](auto* r) { r->set_machine("m1"); }), HasSubstr("machine: m1, want"));
  EXPECT_THAT(refusal([](auto* r) { r->set_part("p1"); }), HasSubstr("part: p1"));
  EXPECT_THAT(refusal([](auto* r) { r->set_calibration("calibrations/none"); }), HasSubstr("calibration: "));
  EXPECT_THAT(refusal([](auto* r) { r->set_least_blades(2); }), HasSubstr("least_blades: 2, want 3 to 1000"));
  EXPECT_THAT(refusal([](auto* r) { r->set_most_blades(201); }), HasSubstr("most_blades: 201, want 1 to 200"));
  EXPECT_THAT(refusal([](auto* r) {
                r->mutable_corrected()->mutable_from()->set_seconds(2000);
                r->mutable_corrected()->mutable_until()->set_seconds(1000);
              }),
              HasSubstr("corrected"));
}

}  // namespace
}  // namespace sixpoint::inspection

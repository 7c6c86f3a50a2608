// The handler that tells whether corrections were right, on a fake of the record: no PostgreSQL. What is read is held to the real one by
// tests/storage/outcomes_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "services/inspection/efficacy_service.h"
#include "tests/support/call.h"
#include "tests/support/fake_outcomes.h"
#include "tests/support/in_process_server.h"
#include "tests/support/listed_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class EfficacyHandlersTest : public ::testing::Test {
 protected:
  using Ask = std::function<void(v1::ComputeEfficacyRequest*)>;

  // Of machine m1, where it asks for no other.
  absl::StatusOr<v1::Efficacy> Compute(const Ask& ask = [](v1::ComputeEfficacyRequest*) {}) {
    v1::ComputeEfficacyRequest request;
    request.set_machine("machines/m1");
    ask(&request);
    return testing::Call(*stub_, &v1::EfficacyService::Stub::ComputeEfficacy, request);
  }
  v1::Efficacy Computed(const Ask& ask = [](v1::ComputeEfficacyRequest*) {}) {
    const auto efficacy = Compute(ask);
    EXPECT_TRUE(efficacy.ok()) << efficacy.status();
    return efficacy.value_or(v1::Efficacy());
  }
  std::vector<Violation> Refused(const Ask& ask) { return ViolationsOf(Compute(ask).status()); }
  // 30 um along X and -10 um along Y, blades 2 um apart.
  static testing::CutBlade Blade(int i) {
    return {"SN-" + std::to_string(i), {0.030 + 0.002 * std::sin(2.6 * i), -0.010 + 0.002 * std::cos(5 * i), 0}};
  }
  void CutMany(int first, int count) {
    for (int i = first; i < first + count; ++i) outcomes_->Cut(Blade(i));
  }

  std::shared_ptr<testing::FakeOutcomes> outcomes_ = std::make_shared<testing::FakeOutcomes>();
  EfficacyService service_{outcomes_};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::EfficacyService::Stub> stub_ = v1::EfficacyService::NewStub(server_.Connect());
};

TEST_F(EfficacyHandlersTest, OffersAPlantedOffsetWithWhatItRestsOn) {
  CutMany(1, 7);
  testing::CutBlade reported = Blade(8);
  reported.reported = true;
  const testing::CutNames names = outcomes_->Cut(reported);
  const v1::Efficacy efficacy = Computed();
  EXPECT_EQ(efficacy.machine(), "machines/m1");
  EXPECT_THAT(efficacy.rule(), HasSubstr("Hotelling"));
  EXPECT_FALSE(efficacy.truncated());
  ASSERT_THAT(efficacy.periods(), SizeIs(1));
  const v1::EfficacyPeriod& period = efficacy.periods(0);
  EXPECT_TRUE(period.in_force());
  EXPECT_EQ(period.machine(), "machines/m1@1");
  EXPECT_EQ(period.sensor_calibration(), outcomes_->calibrations().sensor);
  EXPECT_EQ(period.rotation_calibration(), outcomes_->calibrations().rotation);
  EXPECT_EQ(period.hole_count(), 32);
  ASSERT_THAT(period.blades(), SizeIs(8));
  const v1::BladeMean &first = period.blades(0), &last = period.blades(7);
  EXPECT_EQ(first.blade(), "blades/SN-1");
  EXPECT_EQ(first.reported_count(), 0);
  EXPECT_LT(first.corrected_at().seconds(), last.corrected_at().seconds());
  EXPECT_EQ(last.blade(), "blades/SN-8");
  EXPECT_EQ(last.inspection(), "inspections/" + names.inspection);
  EXPECT_EQ(last.hole_count(), 4);
  EXPECT_EQ(last.reported_count(), 4);
  EXPECT_NEAR(last.x_mm(), reported.off_mm.x(), 1e-6);
  EXPECT_THAT(period.not_offered(), IsEmpty());
  ASSERT_THAT(period.offered_offset().components(), SizeIs(2));
  const v1::OffsetEstimate &x = period.offered_offset().components(0), &y = period.offered_offset().components(1);
  EXPECT_EQ(x.component(), v1::OFFSET_COMPONENT_X);
  EXPECT_NEAR(x.value(), 0.030, x.expanded_uncertainty());
  EXPECT_NEAR(x.shared_standard_uncertainty(), 0.003, 1e-9);  // the 3 um of the sensor's calibration
  EXPECT_EQ(y.component(), v1::OFFSET_COMPONENT_Y);
  EXPECT_NEAR(y.value(), -0.010, y.expanded_uncertainty());
  EXPECT_THAT(period.not_determined(), ElementsAre(v1::OFFSET_COMPONENT_Z));
  EXPECT_THAT(period.holes(), SizeIs(4));
}

TEST_F(EfficacyHandlersTest, WithoutACorrectionThereIsNoPeriod) {
  const v1::Efficacy efficacy = Computed();
  EXPECT_EQ(efficacy.machine(), "machines/m1");
  EXPECT_THAT(efficacy.periods(), IsEmpty());
  EXPECT_FALSE(efficacy.truncated());
  CutMany(1, 1);
  EXPECT_THAT(Computed([](auto* r) { r->set_machine("machines/m2"); }).periods(), IsEmpty());
  EXPECT_THAT(Computed([](auto* r) { r->set_part("parts/p2"); }).periods(), IsEmpty());
  EXPECT_THAT(Computed([](auto* r) { r->set_calibration(std::string("calibrations/") + kSomeUuid); }).periods(),
              IsEmpty());
  EXPECT_THAT(Computed([](auto* r) { r->mutable_corrected()->mutable_from()->set_seconds(4'000'000'000); }).periods(),
              IsEmpty());
  EXPECT_THAT(Computed([this](auto* r) {
                r->set_part("parts/p1");
                r->set_calibration(outcomes_->calibrations().sensor);
                r->mutable_corrected()->mutable_until()->set_seconds(4'000'000'000);
              }).periods(),
              SizeIs(1));
}

TEST_F(EfficacyHandlersTest, AsManyBladesAsAreAskedForAreWantedForAnOffer) {
  const auto too_few = [this](int least_blades) {
    const v1::Efficacy efficacy = Computed([&](auto* r) { r->set_least_blades(least_blades); });
    const auto& reasons = efficacy.periods(0).not_offered();
    return std::count(reasons.begin(), reasons.end(), v1::NOT_OFFERED_TOO_FEW_BLADES) > 0;
  };
  CutMany(1, 4);
  EXPECT_TRUE(too_few(0));  // five
  EXPECT_FALSE(too_few(4));
  CutMany(5, 1);
  EXPECT_FALSE(too_few(0));
  EXPECT_TRUE(too_few(1000));
}

TEST_F(EfficacyHandlersTest, OtherCalibrationsAreAnotherPeriodAndOnlyThoseOfNowOffer) {
  CutMany(1, 8);
  const std::string before = outcomes_->calibrations().rotation;
  outcomes_->CalibrateAxesAnew();
  CutMany(9, 2);
  const v1::Efficacy efficacy = Computed();
  ASSERT_THAT(efficacy.periods(), SizeIs(2));  // the newest first
  EXPECT_THAT(efficacy.periods(0).blades(), SizeIs(2));
  EXPECT_TRUE(efficacy.periods(0).in_force());
  EXPECT_THAT(efficacy.periods(0).not_offered(), ElementsAre(v1::NOT_OFFERED_TOO_FEW_BLADES));
  EXPECT_THAT(efficacy.periods(1).blades(), SizeIs(8));
  EXPECT_EQ(efficacy.periods(1).rotation_calibration(), before);
  EXPECT_FALSE(efficacy.periods(1).in_force());
  EXPECT_THAT(efficacy.periods(1).not_offered(), ElementsAre(v1::NOT_OFFERED_NOT_IN_FORCE));
  EXPECT_FALSE(efficacy.periods(1).has_offered_offset());
}

TEST_F(EfficacyHandlersTest, CountsWhatItLeavesOut) {
  testing::CutBlade blade{"SN-1"};
  blade.inspected = false;
  outcomes_->Cut(blade);
  blade = {"SN-2"};
  blade.positioning_open = true;
  outcomes_->Cut(blade);
  blade = {"SN-3"};
  blade.measured = false;
  outcomes_->Cut(blade);
  CutMany(4, 1);
  outcomes_->InspectAnew({"SN-4"});
  const v1::Efficacy before = Computed();
  EXPECT_EQ(before.left_out().not_inspected(), 1);
  EXPECT_EQ(before.left_out().positioning_open(), 1);
  EXPECT_EQ(before.left_out().no_hole(), 1);
  EXPECT_EQ(before.left_out().superseded_inspections(), 1);
  EXPECT_EQ(before.left_out().withdrawn(), 0);
  EXPECT_THAT(before.periods(), SizeIs(1));
  outcomes_->Withdraw(outcomes_->calibrations().rotation);
  const v1::Efficacy after = Computed();
  EXPECT_EQ(after.left_out().withdrawn(), 3);
  EXPECT_THAT(after.periods(), IsEmpty());
}

TEST_F(EfficacyHandlersTest, SaysWhereThereIsMoreThanItTells) {
  CutMany(1, 3);
  const v1::Efficacy two = Computed([](auto* r) { r->set_most_blades(2); });
  EXPECT_TRUE(two.truncated());
  ASSERT_THAT(two.periods(), SizeIs(1));
  EXPECT_THAT(two.periods(0).blades(), SizeIs(2));  // the newest
  EXPECT_EQ(two.periods(0).blades(0).blade(), "blades/SN-2");
  EXPECT_FALSE(Computed([](auto* r) { r->set_most_blades(3); }).truncated());
  for (int i = 4; i <= 23; ++i) {  // a period each
    outcomes_->CalibrateAxesAnew();
    CutMany(i, 1);
  }
  const v1::Efficacy many = Computed();
  EXPECT_TRUE(many.truncated());
  EXPECT_THAT(many.periods(), SizeIs(20));
  EXPECT_EQ(many.periods(0).blades(0).blade(), "blades/SN-23");
}

TEST_F(EfficacyHandlersTest, RefusesEachFieldByItsValueAndWhatIsWanted) {
  const std::string id = "{id}, the id 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not '.'";
  EXPECT_THAT(Refused([](auto* r) { r->clear_machine(); }),
              ElementsAre(Violation{"machine", "empty", "machines/" + id}));
  EXPECT_THAT(Refused([](auto* r) { r->set_machine("m1"); }),
              ElementsAre(Violation{"machine", "m1", "machines/" + id}));
  EXPECT_THAT(Refused([](auto* r) { r->set_part("p1"); }), ElementsAre(Violation{"part", "p1", "parts/" + id}));
  EXPECT_THAT(Refused([](auto* r) { r->set_calibration("studies/s1"); }),
              ElementsAre(Violation{"calibration", "studies/s1", "calibrations/" + id}));
  EXPECT_THAT(Refused([](auto* r) { r->set_calibration("calibrations/none"); }),
              ElementsAre(Violation{"calibration", "none", "a UUID such as 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e"}));
  EXPECT_THAT(Refused([](auto* r) {
                r->mutable_corrected()->mutable_from()->set_seconds(1'800'000'000);
                r->mutable_corrected()->mutable_until()->set_seconds(1'700'000'000);
              }),
              ElementsAre(Violation{"corrected.until", "1700000000 s", "not before corrected.from"}));
  for (const int count : {-1, 2, 1001})
    EXPECT_THAT(Refused([&](auto* r) { r->set_least_blades(count); }),
                ElementsAre(Violation{"least_blades", std::to_string(count), "3 to 1000, or 0: 5"}));
  for (const int count : {-1, 201})
    EXPECT_THAT(Refused([&](auto* r) { r->set_most_blades(count); }),
                ElementsAre(Violation{"most_blades", std::to_string(count), "1 to 200, or 0: 100"}));
  EXPECT_THAT(Refused([](auto* r) {
                r->set_machine("m1");
                r->set_part("p1");
                r->set_most_blades(201);
              }),
              SizeIs(3))
      << "all that is wrong is told at once";
}

TEST_F(EfficacyHandlersTest, SaysWhatTheStoreSays) {
  CutMany(1, 1);
  outcomes_->Fail(absl::UnavailableError("database: away"));
  const absl::Status away = Compute().status();
  EXPECT_EQ(away.code(), absl::StatusCode::kUnavailable) << away;
  EXPECT_THAT(std::string(away.message()), HasSubstr("database: away"));
  outcomes_->Fail(absl::DeadlineExceededError("database: slow"));
  EXPECT_EQ(Compute().status().code(), absl::StatusCode::kDeadlineExceeded);
  outcomes_->Fail(absl::OkStatus());
  EXPECT_THAT(Computed().periods(), SizeIs(1));
}

// Where each hole stood when it was cut would be guessed.
TEST_F(EfficacyHandlersTest, WithoutItsAxesAPeriodIsNoAnswer) {
  CutMany(1, 1);
  outcomes_->LoseAxes();
  const absl::Status status = Compute().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal) << status;
  EXPECT_THAT(std::string(status.message()), ::testing::Not(HasSubstr("calibrations/"))) << "nobody's business";
}

}  // namespace
}  // namespace sixpoint::inspection

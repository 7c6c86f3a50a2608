// What is asked of a registration beyond its method comes back with it; what is wrong is said, never fitted quietly.
#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <random>

#include "services/runtime/call.h"
#include "services/runtime/geometry_proto.h"
#include "tests/metrology/mesh/shapes.h"
#include "tests/services/registration/fake_plant.h"

namespace sixpoint::registration {
namespace {

using Eigen::Vector3d;
using metrology::SurfacePoint;
using metrology::TriangleMesh;
using ::testing::HasSubstr;
using ::testing::Not;

class RegistrationEvidenceTest : public FakePlantTest {
 protected:
  RegistrationEvidenceTest() { Design(TrueBlade()); }
};

TEST_F(RegistrationEvidenceTest, TakesWhatIsAskedAndAnswersItWithItsEvidence) {
  Scan(TrueBlade());
  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  for (const v1::Freedom freedom :
       {v1::FREEDOM_TURN_X, v1::FREEDOM_TURN_Y, v1::FREEDOM_TURN_Z, v1::FREEDOM_SHIFT_X, v1::FREEDOM_SHIFT_Y})
    request.mutable_options()->add_degrees_of_freedom(freedom);
  for (const double weight : {1.0, 0.1, 2.5, 1e-3}) request.mutable_options()->add_scan_weights(weight);
  v1::Ball& out = *request.mutable_options()->add_regions_out()->mutable_ball();
  runtime::ToProto(Vector3d(0, 0, 20), out.mutable_centre_mm());
  out.set_radius_mm(6.1);
  // The nominal part is off along its x and y only; the one direction that is held stays as it is.
  Eigen::Isometry3d nominal = plant_.block.pose.zero_from_part;
  nominal.translation() += nominal.linear() * Vector3d(0.2, -0.1, 0);
  runtime::ToProto(nominal, plant_.plant.part.mutable_zero_from_part_nominal());
  const v1::Registration registration = Register(request);
  ASSERT_EQ(registration.evidence().outcome(), v1::OUTCOME_CONVERGED) << registration.evidence().remark();
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(registration.options(), request.options()));
  EXPECT_LT(ErrorUm(registration, NestMm()), 1);
  const auto surface = metrology::Surface::Prepare(TrueBlade());
  const Vector3d centroid = (*surface)->centroid_mm();
  const Vector3d moved = nominal.linear().transpose() * (PoseOf(registration) * centroid - nominal * centroid);
  EXPECT_NEAR(moved.z(), 0, 0.01 * moved.norm());  // each step is held in the axes it began with

  const v1::Evidence& evidence = registration.evidence();
  EXPECT_GT(evidence.noise_sigma_um(), 0.8);  // 2 um along the ray, aslant to the normals
  EXPECT_LT(evidence.noise_sigma_um(), 2);
  EXPECT_GT(evidence.surface_part(), 0.8);
  EXPECT_GT(evidence.information_kept(), 0.9);
  EXPECT_LE(evidence.information_kept(), 1);
  EXPECT_GT(evidence.patch_mm(), 0.2);
  EXPECT_GE(evidence.correlation_widening(), 1);
  EXPECT_THAT(evidence.weakest_direction_in_words(), HasSubstr("the part's"));
  EXPECT_EQ(evidence.agreements_size(), 6);  // of four scans that all see all
  EXPECT_EQ(Count("registration_agreements"), 6);
  for (const v1::ScanAgreement& agreement : evidence.agreements()) {
    EXPECT_GT(agreement.patch_count(), 100);
    // The rays of each view meet the blade at other angles: one noise for all is off by that.
    EXPECT_NEAR(agreement.difference_rms_um() / agreement.expected_rms_um(), 1, 0.5);
  }
  std::int64_t count = 0;
  for (const v1::RegionResidual& region : evidence.regions()) count += region.point_count();
  EXPECT_GT(count, 0.8 * static_cast<double>(evidence.point_count()));
  EXPECT_FALSE(evidence.has_allowance());
  EXPECT_FALSE(evidence.has_disagreement());
}

TEST_F(RegistrationEvidenceTest, AScanThatStandsOffShowsInItsAgreements) {
  Scan(TrueBlade());
  ingest::v1::ScanHeader& header = *plant_.ingest.scans.at(plant_.scans[0]).mutable_header();
  header.set_b_deg(header.b_deg() + 0.02);  // 10 um at 30 mm
  const v1::Registration registration = Register(Request(v1::METHOD_BEST_FIT));
  double with = 0, without = 0;
  for (const v1::ScanAgreement& agreement : registration.evidence().agreements()) {
    const bool its = agreement.scan() == plant_.scans[0] || agreement.other_scan() == plant_.scans[0];
    double& worst = its ? with : without;
    worst = std::max(worst, agreement.difference_rms_um() / agreement.expected_rms_um());
  }
  EXPECT_LT(without, 1.3);
  EXPECT_GT(with, 2);
}

// All scans, and of them the neighbourhood of the tip and the suction side, where the holes are.
TEST_F(RegistrationEvidenceTest, LocalByHoleGroupIsTheGroupsNeighbourhoodOfAllScans) {
  v1::RegisterRequest request = Request(v1::METHOD_LOCAL);
  v1::HoleGroupNeighbourhood& near = *request.mutable_options()->add_regions_in()->mutable_hole_group();
  near.set_group("G2");
  near.set_margin_mm(7);
  std::vector<Vector3d> starts;
  for (const plant::v1::Hole& hole : plant_.plant.part.hole_groups(0).holes())
    starts.emplace_back(hole.start_in_part_mm().x_mm(), hole.start_in_part_mm().y_mm(), hole.start_in_part_mm().z_mm());
  Scan(TrueBlade());
  const v1::Registration good = Register(request);
  ASSERT_EQ(good.evidence().outcome(), v1::OUTCOME_CONVERGED) << good.evidence().remark();
  EXPECT_LT(ErrorUm(good, starts), 1);
  EXPECT_GT(good.evidence().point_count(), 5000);
  EXPECT_LT(good.evidence().point_count(), 40000);  // of 80000
  ASSERT_TRUE(good.evidence().has_disagreement());
  EXPECT_FALSE(good.evidence().disagreement().beyond()) << good.evidence().ShortDebugString();
  EXPECT_LT(good.evidence().disagreement().greatest_um(), 2);

  // The tip is bent sideways by up to 0.1 mm: the region follows it, all the blade does not.
  Scan(TrueBlade(), nullptr, [](const SurfacePoint& on) {
    const double above = std::max(0.0, on.point_mm.z() - 5) / 15;
    return Vector3d(on.point_mm + Vector3d(0, 0.1 * above * above, 0));
  });
  const v1::Registration bent = Register(request);
  ASSERT_EQ(bent.evidence().outcome(), v1::OUTCOME_CONVERGED) << bent.evidence().remark();
  EXPECT_TRUE(bent.evidence().disagreement().beyond()) << bent.evidence().ShortDebugString();
  EXPECT_GT(bent.evidence().disagreement().greatest_um(), 20);
  EXPECT_THAT(bent.evidence().remark(), HasSubstr("from the best fit of the same scans"));
  EXPECT_EQ(Count("registrations WHERE disagrees"), 1);
  v1::ListRegistrationsRequest list;
  list.set_only_disagreeing(true);
  v1::ListRegistrationsResponse listed;
  ASSERT_TRUE(
      v1::RegistrationService::NewStub(channel_)->ListRegistrations(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.registrations_size(), 1);
  EXPECT_EQ(listed.registrations(0).name(), bent.name());

  near.set_group("G9");
  EXPECT_THAT(RefusalOf(request), HasSubstr("options.regions_in[0].hole_group.group: G9, want one of G2"));
}

// The nest's six places are true, the blade between them is a casting bent by 0.1 mm.
TEST_F(RegistrationEvidenceTest, SixPointsOnABentBladeDisagreeWithItsBestFit) {
  std::vector<Vector3d> places;
  for (const plant::v1::DatumPoint& datum : plant_.plant.part.six_points())
    places.emplace_back(datum.point_in_part_mm().x_mm(), datum.point_in_part_mm().y_mm(),
                        datum.point_in_part_mm().z_mm());
  const auto bent = [&](const SurfacePoint& on) {
    double away = 1;
    for (const Vector3d& place : places) away *= 1 - std::exp(-(on.point_mm - place).squaredNorm() / (2 * 3 * 3));
    return Vector3d(on.point_mm + Vector3d(0, 0.1 * away * (1 + on.point_mm.z() / 20), 0));
  };
  for (const v1::Method method : {v1::METHOD_SIX_POINT, v1::METHOD_SIX_POINT_NORMALS}) {
    Scan(TrueBlade());
    const v1::Registration good = Register(Request(method));
    ASSERT_EQ(good.evidence().outcome(), v1::OUTCOME_CONVERGED) << good.evidence().remark();
    ASSERT_TRUE(good.evidence().has_disagreement());
    EXPECT_FALSE(good.evidence().disagreement().beyond()) << good.evidence().ShortDebugString();
    EXPECT_THAT(good.evidence().remark(), Not(HasSubstr("best fit of the same scans")));
    Scan(TrueBlade(), nullptr, bent);
    const v1::Registration off = Register(Request(method));
    ASSERT_EQ(off.evidence().outcome(), v1::OUTCOME_CONVERGED) << off.evidence().remark();
    EXPECT_TRUE(off.evidence().disagreement().beyond()) << off.evidence().ShortDebugString();
    EXPECT_GT(off.evidence().disagreement().greatest_um(), 30);
    EXPECT_THAT(off.evidence().remark(), HasSubstr("from the best fit of the same scans"));
  }
}

// A blank 0.8 mm larger than the blade everywhere.
TEST_F(RegistrationEvidenceTest, ABlankIsFittedWithStockOrProvenTooSmall) {
  Scan(
      TrueBlade(), [](const SurfacePoint& on) { return on.feature == metrology::SurfaceFeature::kFace; },
      [](const SurfacePoint& on) { return Vector3d(on.point_mm + 0.8 * on.normal); });
  v1::RegisterRequest request = Request(v1::METHOD_ALLOWANCE);
  request.mutable_options()->mutable_allowance()->set_least_stock_mm(0.3);
  const v1::Registration registration = Register(request);
  ASSERT_EQ(registration.evidence().outcome(), v1::OUTCOME_CONVERGED) << registration.evidence().remark();
  EXPECT_GE(registration.evidence().allowance().least_stock_mm(), 0.3 - 1e-3);
  EXPECT_EQ(registration.evidence().allowance().lacking_mm(), 0);
  EXPECT_EQ(registration.options().allowance().greatest_stock_mm(), 5);  // filled in
  EXPECT_EQ(registration.scans_size(), 4);
  EXPECT_GT(registration.evidence().scans(0).points_used(), 15000);
  EXPECT_LT(ErrorUm(registration, NestMm()), 100);

  request.mutable_options()->mutable_allowance()->set_least_stock_mm(1.5);
  const v1::Registration small = Register(request);
  EXPECT_EQ(small.evidence().outcome(), v1::OUTCOME_INFEASIBLE) << small.evidence().remark();
  EXPECT_FALSE(small.has_zero_from_part());
  EXPECT_NEAR(small.evidence().allowance().lacking_mm(), 0.7, 0.05);
  ASSERT_GE(small.evidence().allowance().holding_size(), 2);
  double share = 0;
  for (const v1::AllowancePatch& patch : small.evidence().allowance().holding()) {
    share += patch.share();
    EXPECT_NEAR(patch.stock_mm(), 0.8, 0.05);
    EXPECT_NEAR(std::hypot(patch.normal().x(), patch.normal().y(), patch.normal().z()), 1, 1e-9);
  }
  EXPECT_NEAR(share, 1, 1e-6);
  EXPECT_EQ(Count("registrations WHERE outcome = 'INFEASIBLE' AND lacking_mm > 0.6"), 1);
  // Only of a pose is it known how well it is held; residuals this method has none.
  EXPECT_GE(registration.evidence().condition_number(), 1);
  EXPECT_EQ(registration.evidence().weakest_direction_size(), 6);
  EXPECT_EQ(small.evidence().condition_number(), 0);
  EXPECT_EQ(small.evidence().weakest_direction_size(), 0);
  EXPECT_EQ(Count("registrations WHERE outcome = 'INFEASIBLE' AND num_nulls(condition_number, weakest_direction, "
                  "weakest_standard_uncertainty_um) = 3"),
            1);
  EXPECT_EQ(Count("registrations WHERE residual_rms_um IS NULL AND residual_sigma_um > 0"), 2);
}

TEST_F(RegistrationEvidenceTest, FindsABladeThatLiesFarOffAndTurned) {
  Scan(TrueBlade());
  Eigen::Isometry3d far = plant_.block.pose.zero_from_part;
  far.linear() = far.linear() * metrology::RotationFromVector({1.2, -0.7, 2});
  far.translation() += Vector3d(30, -20, 40);
  runtime::ToProto(far, plant_.plant.part.mutable_zero_from_part_nominal());
  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  EXPECT_NE(Register(request).evidence().outcome(), v1::OUTCOME_CONVERGED);
  request.mutable_options()->set_coarse_start(true);
  const v1::Registration found = Register(request);
  ASSERT_EQ(found.evidence().outcome(), v1::OUTCOME_CONVERGED) << found.evidence().remark();
  EXPECT_LT(ErrorUm(found, NestMm()), 1);
}

}  // namespace
}  // namespace sixpoint::registration

#include "services/inspection/inspection_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/record.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::inspection {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class InspectionServiceTest : public ::testing::Test {
 protected:
  InspectionServiceTest() { Start(2); }

  void Start(int greatest_count) {
    server_.reset();
    InspectionServiceOptions options;
    options.pool = {greatest_count, 0};
    service_ = std::make_unique<InspectionService>(
        storage::InspectionsIn(plant_.database.database()),
        std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
        options);
    server_ = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{service_.get()});
    stub_ = v1::InspectionService::NewStub(server_->Connect());
  }

  absl::StatusOr<v1::Inspection> Inspect(const v1::InspectRequest& request) {
    v1::Inspection inspection;
    const grpc::Status status =
        stub_->Inspect(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &inspection);
    if (!status.ok()) return runtime::FromGrpc(status);
    return inspection;
  }
  v1::InspectRequest Request() const {
    v1::InspectRequest request;
    request.set_blade("blades/sn1");
    for (const std::string& scan : plant_.scans) request.add_scans(scan);
    return request;
  }
  std::int64_t Count(const std::string& table) {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
  }
  void ExpectRefusedWith(const std::string& withdrawn) {
    ASSERT_TRUE(Inspect(Request()).ok());
    plant_.Withdraw(withdrawn);
    const absl::Status refused = Inspect(Request()).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << refused;
    EXPECT_EQ(runtime::ReasonOf(refused), "CALIBRATION_WITHDRAWN");
    EXPECT_THAT(std::string(refused.message()), HasSubstr(withdrawn + ": withdrawn, want one in force"));
    EXPECT_EQ(Count("inspections"), 1);  // the one from before
    EXPECT_EQ(Count("record_entries WHERE kind = 'inspection'"), 1);
  }

  testing::JudgedPlant plant_;
  std::unique_ptr<InspectionService> service_;
  std::unique_ptr<testing::InProcessServer> server_;
  std::unique_ptr<v1::InspectionService::Stub> stub_;
};

TEST_F(InspectionServiceTest, JudgesTheBladeAndReadsBackTheSame) {
  const auto inspection = Inspect(Request());
  ASSERT_TRUE(inspection.ok()) << inspection.status();
  ASSERT_EQ(inspection->holes_size(), 2);
  EXPECT_EQ(inspection->verdict(), v1::VERDICT_NOT_CONFORM);
  const v1::HoleResult& good = inspection->holes(0);
  EXPECT_EQ(good.hole(), "H1");
  EXPECT_EQ(good.verdict(), v1::VERDICT_CONFORM) << good.reason();
  EXPECT_EQ(inspection->holes(1).position_verdict(), v1::VERDICT_NOT_CONFORM);
  const double position_mm = (plant_.block.pins[0].start_mm - plant_.block.holes[0].pin.start_mm).norm();
  EXPECT_NEAR(good.position_error_mm(), position_mm, 1e-3);
  EXPECT_NEAR(good.pin_diameter_mm(), 0.44, 2e-3);
  EXPECT_GT(good.position_expanded_uncertainty_um(), 0.1);
  EXPECT_EQ(good.position_tolerance_mm(), 0.06);
  EXPECT_NEAR(inspection->deviation().p50_um(), 5, 0.5);
  EXPECT_EQ(inspection->registration(), testing::kRegistration);
  EXPECT_THAT(inspection->decision_rule(), HasSubstr("ISO 14253-1"));
  ASSERT_EQ(inspection->scans_size(), 4);
  EXPECT_EQ(inspection->scans(3), plant_.scans[3]);

  v1::GetInspectionRequest get;
  get.set_name(inspection->name());
  v1::Inspection back;
  ASSERT_TRUE(stub_->GetInspection(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.SerializeAsString(), inspection->SerializeAsString());

  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, plant_.scans[2]);
  ASSERT_TRUE(derived.ok());
  std::vector<std::string> names;
  for (const storage::JournalEntry& journal : *derived) names.push_back(journal.entry.name);
  EXPECT_THAT(names, Contains(inspection->name()));
}

// A drawing's "diameter 0.06" is 0.03 to either side, and a pin that is thinner than its hole says less of it.
// The pins stand 20 and 80 um along X and 10 um along Y off; their drawn axis leans towards (0.3, 0.2).
TEST_F(InspectionServiceTest, TellsWhereHolesLieInTheSurfaceAndHowFarApartTheyAre) {
  const auto inspection = Inspect(Request());
  ASSERT_TRUE(inspection.ok()) << inspection.status();
  const Eigen::Vector2d along = Eigen::Vector2d(0.3, 0.2).normalized(), across(-along.y(), along.x());
  for (int i = 0; i < 2; ++i) {
    const v1::HoleResult& hole = inspection->holes(i);
    EXPECT_EQ(hole.measured_by(), v1::HOLE_MEASURED_BY_PIN);
    ASSERT_TRUE(hole.has_displacement());
    const v1::HoleDisplacement& lies = hole.displacement();
    EXPECT_EQ(lies.along_is(), v1::ALONG_IS_AXIS_IN_SURFACE);
    EXPECT_NEAR(lies.along_in_part().x(), along.x(), 1e-9);
    EXPECT_NEAR(lies.across_in_part().x(), across.x(), 1e-9);
    const Eigen::Vector2d off_um(20 + 60 * i, 10);
    // Twice U: by chance beyond in 1 of 16,000.
    EXPECT_NEAR(lies.along_um().value(), along.dot(off_um), 2 * lies.along_um().expanded_uncertainty());
    EXPECT_NEAR(lies.across_um().value(), across.dot(off_um), 2 * lies.across_um().expanded_uncertainty());
    EXPECT_LT(lies.along_um().expanded_uncertainty(), 5);
    EXPECT_FALSE(lies.along_um().budget().empty());
    // Nothing was compared here: as stated they are the same.
    ASSERT_TRUE(hole.has_in_stated_positioning());
    const v1::StatedPositioning& stated = hole.in_stated_positioning();
    EXPECT_EQ(stated.position_expanded_uncertainty_um(), hole.position_expanded_uncertainty_um());
    EXPECT_EQ(stated.inclination_expanded_uncertainty_deg(), hole.inclination_expanded_uncertainty_deg());
    EXPECT_EQ(stated.positioning_difference_deg(), 0);
    const double by_covariance_um = stated.displacement_coverage_factor() * std::sqrt(stated.along_variance_um2());
    EXPECT_GE(by_covariance_um, 0.999 * lies.along_um().expanded_uncertainty());
    EXPECT_LT(by_covariance_um, 1.5 * lies.along_um().expanded_uncertainty());
    // 0.44 mm wide, without play.
    ASSERT_TRUE(hole.has_diameter()) << hole.diameter_reason();
    EXPECT_NEAR(hole.diameter().diameter_mm(), 0.44, 1e-3 * hole.diameter().expanded_uncertainty_um());
    EXPECT_TRUE(hole.has_pin_diameter_expanded_uncertainty_um());
  }
  ASSERT_EQ(inspection->pitches_size(), 1);
  const v1::HolePitch& pitch = inspection->pitches(0);
  EXPECT_EQ(pitch.from(), "H1");
  EXPECT_EQ(pitch.to(), "H2");
  EXPECT_NEAR(pitch.nominal_pitch_mm(), 6, 1e-9);
  EXPECT_NEAR(pitch.pitch_mm(), 6.06, 2e-3 * pitch.expanded_uncertainty_um());
  EXPECT_NEAR(pitch.pitch_over_diameter(), pitch.pitch_mm() / 0.44, 1e-9);
  EXPECT_LT(pitch.expanded_uncertainty_um(), 5);
}

TEST_F(InspectionServiceTest, JudgesByTheZonesKindAndByThePinsPlay) {
  plant::v1::HoleGroup& group = *plant_.plant.part.mutable_hole_groups(0);
  group.set_position_tolerance_mm(0.04);
  group.set_position_zone(plant::v1::POSITION_ZONE_RADIUS);
  const auto radius = Inspect(Request());
  ASSERT_TRUE(radius.ok()) << radius.status();
  EXPECT_EQ(radius->holes(0).position_tolerance_mm(), 0.04);
  EXPECT_EQ(radius->holes(0).position_verdict(), v1::VERDICT_CONFORM);
  group.set_position_zone(plant::v1::POSITION_ZONE_DIAMETER);
  const auto diameter = Inspect(Request());
  ASSERT_TRUE(diameter.ok()) << diameter.status();
  EXPECT_EQ(diameter->holes(0).position_tolerance_mm(), 0.02);
  EXPECT_EQ(diameter->holes(0).position_error_mm(), radius->holes(0).position_error_mm());
  EXPECT_EQ(diameter->holes(0).position_verdict(), v1::VERDICT_NOT_CONFORM);

  plant::v1::GaugePin& pin = *group.mutable_gauge_pin();
  pin.set_greatest_play_mm(0.03);
  const auto loose = Inspect(Request());
  ASSERT_TRUE(loose.ok()) << loose.status();
  EXPECT_NEAR(loose->holes(0).pin_half_play_um(), 15.5, 1);
  EXPECT_GT(loose->holes(0).position_expanded_uncertainty_um(), 20);
  EXPECT_EQ(loose->holes(0).position_verdict(), v1::VERDICT_UNDECIDABLE);
  const double tilt_u_deg = loose->holes(0).inclination_expanded_uncertainty_deg();
  pin.set_least_depth_mm(2);
  const auto shallow = Inspect(Request());
  ASSERT_TRUE(shallow.ok()) << shallow.status();
  EXPECT_NEAR(shallow->holes(0).inclination_expanded_uncertainty_deg() / tilt_u_deg, 3, 0.1);

  pin.set_diameter_mm(0.4);
  const auto other = Inspect(Request());
  ASSERT_TRUE(other.ok()) << other.status();
  EXPECT_EQ(other->holes(0).verdict(), v1::VERDICT_NOT_MEASURED);
  EXPECT_THAT(other->holes(0).reason(), HasSubstr("want the gauge pin's 0.4 mm"));
  EXPECT_FALSE(other->holes(0).has_pin_half_play_um());

  group.clear_gauge_pin();
  const auto unknown = Inspect(Request());
  ASSERT_TRUE(unknown.ok()) << unknown.status();
  EXPECT_EQ(unknown->holes(0).position_verdict(), v1::VERDICT_UNDECIDABLE);
  EXPECT_THAT(unknown->holes(0).reason(), HasSubstr("how loosely the pin stands is not stated"));
}

// B reaches 0.05 deg beyond its commands; the scans were taken where they say plus that.
TEST_F(InspectionServiceTest, TakesScansAtTheAnglesOfItsRegistration) {
  const auto before = Inspect(Request());
  ASSERT_TRUE(before.ok()) << before.status();
  plant_.Characterise(true, std::vector<double>(8, 0.06), std::vector<double>(8, 0.04), 0.002);
  for (const std::string& scan : plant_.scans) {
    ingest::v1::ScanHeader& header = *plant_.ingest.scans.at(scan).mutable_header();
    header.set_b_deg(header.b_deg() - 0.05);
    registration::v1::ScanAngle& angle = *plant_.registration.registration.add_angles();
    angle.set_axis("B");
    angle.set_characterisation(testing::kBCharacterisation);
    angle.set_commanded_deg(header.b_deg());
    angle.set_reached_deg(header.b_deg() + 0.05);
    angle.set_standard_uncertainty_deg(0.002);
    angle.set_half_reversal_deg(0.01);
    for (int i = 0; i < 6; ++i) angle.add_pose_per_rad(0);
  }
  v1::InspectRequest request = Request();
  request.set_apply_axis_tables(true);
  const auto inspection = Inspect(request);
  ASSERT_TRUE(inspection.ok()) << inspection.status();
  EXPECT_TRUE(plant_.registration.applied_axis_tables);
  EXPECT_NEAR(inspection->holes(0).position_error_mm(), before->holes(0).position_error_mm(), 1e-6);
  // The pins, 10 mm off B's axis, move by 0.01 deg against a pose that does not: 1.8 um, twice, beside what was there.
  EXPECT_GT(inspection->holes(0).position_expanded_uncertainty_um(),
            before->holes(0).position_expanded_uncertainty_um() + 1.5);
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, testing::kBCharacterisation);
  ASSERT_TRUE(derived.ok());
  ASSERT_EQ(derived->size(), 1u);
  EXPECT_EQ(derived->front().entry.name, inspection->name());
}

// Pairs stand 10 times their uncertainty from the best fit, and the nest 50 um from the pairs: no hole is passed as if that
// were not so. Asked for by name, the nest is what the datum points define, and the flag says what it differs from.
TEST_F(InspectionServiceTest, CoversPositioningsThatDisagreeAndSaysSo) {
  using registration::v1::Method;
  plant_.registration.registration.mutable_evidence()->clear_disagreement();
  const auto calm = Inspect(Request());
  ASSERT_TRUE(calm.ok()) << calm.status();
  EXPECT_EQ(calm->positioning().method(), registration::v1::METHOD_SIX_POINT);
  EXPECT_FALSE(calm->positioning().has_disagreement_um());
  EXPECT_FALSE(calm->positioning().disagrees());
  EXPECT_EQ(calm->holes(0).verdict(), v1::VERDICT_CONFORM);

  // What registration says of its ratio is what counts, whatever its limit is.
  auto& disagreement = *plant_.registration.registration.mutable_evidence()->mutable_disagreement();
  disagreement.set_greatest_um(12);
  disagreement.set_ratio(4);
  const auto explained = Inspect(Request());
  ASSERT_TRUE(explained.ok()) << explained.status();
  EXPECT_EQ(explained->positioning().disagreement_ratio(), 4);
  EXPECT_FALSE(explained->positioning().disagrees());

  disagreement.set_greatest_um(30);
  disagreement.set_ratio(10);
  disagreement.set_beyond(true);
  registration::v1::Registration& nest = plant_.registration.by_method[registration::v1::METHOD_SIX_POINT_NORMALS];
  nest = plant_.registration.registration;
  // Along the block's x, so by 50 um on its top.
  const auto& rotation = nest.zero_from_part().rotation();
  auto& translation = *nest.mutable_zero_from_part()->mutable_translation_mm();
  translation.set_x_mm(translation.x_mm() + 0.05 * rotation.Get(0));
  translation.set_y_mm(translation.y_mm() + 0.05 * rotation.Get(3));
  translation.set_z_mm(translation.z_mm() + 0.05 * rotation.Get(6));
  plant_.registration.asked.clear();
  v1::InspectRequest request = Request();
  request.set_request_id("00000000-0000-7000-8000-0000000000cc");
  const auto covered = Inspect(request);
  ASSERT_TRUE(covered.ok()) << covered.status();
  EXPECT_TRUE(covered->positioning().disagrees());
  EXPECT_TRUE(covered->positioning().covered());
  EXPECT_EQ(covered->positioning().disagreement_um(), 30);
  EXPECT_EQ(covered->positioning().disagreement_ratio(), 10);
  EXPECT_EQ(covered->holes(0).position_error_mm(), calm->holes(0).position_error_mm());
  EXPECT_NEAR(covered->holes(0).positioning_difference_um(), 50, 0.5);
  EXPECT_GT(covered->holes(0).position_expanded_uncertainty_um(), 50);
  EXPECT_EQ(covered->holes(0).position_verdict(), v1::VERDICT_UNDECIDABLE);
  std::vector<Method> methods;
  std::set<std::string> ids;
  for (const auto& one : plant_.registration.asked) {
    methods.push_back(one.method());
    ids.insert(one.request_id());
    EXPECT_TRUE(one.for_inspection());
  }
  EXPECT_THAT(methods, ElementsAre(registration::v1::METHOD_SIX_POINT, registration::v1::METHOD_BEST_FIT,
                                   registration::v1::METHOD_SIX_POINT_NORMALS));
  EXPECT_EQ(ids.size(), 3u);  // each an answer of its own, found again by a retry
  v1::GetInspectionRequest get;
  get.set_name(covered->name());
  v1::Inspection back;
  ASSERT_TRUE(stub_->GetInspection(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.SerializeAsString(), covered->SerializeAsString());

  request = Request();
  request.set_method(registration::v1::METHOD_SIX_POINT_NORMALS);
  const auto by_nest = Inspect(request);
  ASSERT_TRUE(by_nest.ok()) << by_nest.status();
  EXPECT_EQ(by_nest->positioning().method(), registration::v1::METHOD_SIX_POINT_NORMALS);
  EXPECT_TRUE(by_nest->positioning().disagrees());
  EXPECT_FALSE(by_nest->positioning().covered());
  EXPECT_FALSE(by_nest->holes(0).has_positioning_difference_um());

  // A best fit is compared with the pairs, and covered as they are.
  request.set_method(registration::v1::METHOD_BEST_FIT);
  const auto by_best_fit = Inspect(request);
  ASSERT_TRUE(by_best_fit.ok()) << by_best_fit.status();
  EXPECT_TRUE(by_best_fit->positioning().covered());
  EXPECT_NEAR(by_best_fit->holes(0).positioning_difference_um(), 50, 0.5);
}

// The part has no datum points to make the nest of, or the nest's fit gives no pose: the uncertainties hold what was found, and the
// result says that they lack something.
TEST_F(InspectionServiceTest, DoesNotCallPositioningsCoveredWhereOneIsLacking) {
  auto& disagreement = *plant_.registration.registration.mutable_evidence()->mutable_disagreement();
  disagreement.set_greatest_um(30);
  disagreement.set_ratio(10);
  disagreement.set_beyond(true);
  auto& refusal = plant_.registration.refusal_by_method[registration::v1::METHOD_SIX_POINT_NORMALS];
  for (const absl::Status& cannot : {runtime::Failure(errors::v1::SIX_POINTS_MISSING, "parts/p1: no six points"),
                                     runtime::Refuse("part.six_points[P1]", "3 mm off the CAD", "within 0.02")}) {
    refusal = cannot;
    const auto inspection = Inspect(Request());
    ASSERT_TRUE(inspection.ok()) << inspection.status();
    EXPECT_TRUE(inspection->positioning().disagrees());
    EXPECT_FALSE(inspection->positioning().covered()) << cannot;
  }
  refusal = absl::OkStatus();
  registration::v1::Registration& nest = plant_.registration.by_method[registration::v1::METHOD_SIX_POINT_NORMALS];
  nest = plant_.registration.registration;
  nest.mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
  const auto unsettled = Inspect(Request());
  ASSERT_TRUE(unsettled.ok()) << unsettled.status();
  EXPECT_FALSE(unsettled->positioning().covered());
}

// What is no property of the part says nothing about its positionings: the call ends, and a smaller uncertainty is not stored.
TEST_F(InspectionServiceTest, EndsWhereThePlantCannotMakeTheComparisonNow) {
  auto& disagreement = *plant_.registration.registration.mutable_evidence()->mutable_disagreement();
  disagreement.set_greatest_um(30);
  disagreement.set_ratio(10);
  disagreement.set_beyond(true);
  plant_.registration.refusal_by_method[registration::v1::METHOD_SIX_POINT_NORMALS] =
      runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN, "machines/m1: withdrawn");
  EXPECT_EQ(runtime::ReasonOf(Inspect(Request()).status()), "CALIBRATION_WITHDRAWN");
  EXPECT_EQ(Count("inspections"), 0);
}

// A casting makes the best fit so uncertain that nothing disagrees with it: its shape alone says that the positioning matters.
// The tolerance is 60 um.
TEST_F(InspectionServiceTest, TakesAShapeThatDeviatesForADisagreement) {
  for (const double model_sigma_um : {5.9, 6.1}) {
    plant_.registration.registration.mutable_evidence()->set_model_sigma_um(model_sigma_um);
    const auto inspection = Inspect(Request());
    ASSERT_TRUE(inspection.ok()) << inspection.status();
    EXPECT_EQ(inspection->positioning().disagrees(), model_sigma_um > 6);
    EXPECT_EQ(inspection->positioning().covered(), model_sigma_um > 6);
  }
}

TEST_F(InspectionServiceTest, PassesHowToPositionToRegistration) {
  v1::InspectRequest request = Request();
  request.set_method(registration::v1::METHOD_LOCAL);
  auto& region = *request.mutable_options()->add_regions_in()->mutable_hole_group();
  region.set_group("G1");
  region.set_margin_mm(4);
  const auto inspection = Inspect(request);
  ASSERT_TRUE(inspection.ok()) << inspection.status();
  EXPECT_EQ(inspection->positioning().method(), registration::v1::METHOD_LOCAL);
  ASSERT_EQ(plant_.registration.asked.size(), 1u);
  EXPECT_EQ(plant_.registration.asked[0].options().regions_in(0).hole_group().group(), "G1");
  request.set_method(registration::v1::METHOD_ALLOWANCE);
  const absl::Status refused = Inspect(request).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("method: METHOD_ALLOWANCE, want six-point"));
}

TEST_F(InspectionServiceTest, StoresAHoleThatWasNotMeasuredWithItsReason) {
  plant::v1::Hole& hole = *plant_.plant.part.mutable_hole_groups(0)->add_holes();
  hole = plant_.plant.part.hole_groups(0).holes(0);
  hole.set_hole("H3");
  hole.mutable_start_in_part_mm()->set_y_mm(-10);  // no pin there
  const auto inspection = Inspect(Request());
  ASSERT_TRUE(inspection.ok()) << inspection.status();
  const v1::HoleResult& missing = inspection->holes(2);
  EXPECT_EQ(missing.verdict(), v1::VERDICT_NOT_MEASURED);
  EXPECT_FALSE(missing.has_position_error_mm());
  EXPECT_FALSE(missing.has_position_expanded_uncertainty_um());
  EXPECT_FALSE(missing.has_inclination_expanded_uncertainty_deg());
  EXPECT_NE(missing.reason(), "");
  v1::GetInspectionRequest get;
  get.set_name(inspection->name());
  v1::Inspection back;
  ASSERT_TRUE(stub_->GetInspection(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_FALSE(back.holes(2).has_position_error_mm());
  EXPECT_FALSE(back.holes(2).has_position_expanded_uncertainty_um());
}

TEST_F(InspectionServiceTest, AnswersARetryOnce) {
  v1::InspectRequest request = Request();
  request.set_request_id("00000000-0000-7000-8000-0000000000bb");
  const auto first = Inspect(request), second = Inspect(request);
  ASSERT_TRUE(first.ok() && second.ok()) << first.status() << second.status();
  EXPECT_EQ(first->name(), second->name());
  EXPECT_EQ(Count("inspections"), 1);
  EXPECT_EQ(plant_.registration.register_count, 1);
}

TEST_F(InspectionServiceTest, RefusesWhatItCannotRestOnAndStoresNothing) {
  v1::InspectRequest unknown = Request();
  unknown.add_scans("scans/none");
  EXPECT_EQ(Inspect(unknown).status().code(), absl::StatusCode::kNotFound);
  plant_.ingest.scans.at(plant_.scans[1]).mutable_header()->set_kind(ingest::v1::SCAN_KIND_LOCAL);
  const absl::Status wrong_kind = Inspect(Request()).status();
  EXPECT_EQ(wrong_kind.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(wrong_kind.message()), HasSubstr("scans[1]: s1 of the kind SCAN_KIND_LOCAL"));
  EXPECT_EQ(plant_.registration.register_count, 0);
  plant_.ingest.scans.at(plant_.scans[1]).mutable_header()->set_kind(ingest::v1::SCAN_KIND_PINS);
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_TOO_LITTLE_OVERLAP);
  EXPECT_EQ(runtime::ReasonOf(Inspect(Request()).status()), "REGISTRATION_NOT_CONVERGED");
  EXPECT_EQ(Count("inspections"), 0);
  EXPECT_EQ(Count("record_entries WHERE kind = 'inspection'"), 0);
}

// The registration service refuses to register with it; nothing is judged.
TEST_F(InspectionServiceTest, PassesOnThatACalibrationWasWithdrawn) {
  plant_.registration.refusal =
      runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN,
                       "machines/m1: its sensor calibration was withdrawn (sensor was knocked), want one in force");
  const absl::Status refused = Inspect(Request()).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(refused), "CALIBRATION_WITHDRAWN");
  EXPECT_THAT(std::string(refused.message()), HasSubstr("(sensor was knocked), want one in force"));
  EXPECT_EQ(Count("inspections"), 0);
}

// It was registered and judged with a calibration that somebody withdrew meanwhile: the storing refuses.
TEST_F(InspectionServiceTest, StoresNothingThatRestsOnAWithdrawnSensorCalibration) {
  ExpectRefusedWith(testing::kSensorCalibration);
}

TEST_F(InspectionServiceTest, StoresNothingThatRestsOnAWithdrawnRotationCalibration) {
  ExpectRefusedWith(testing::kRotationCalibration);
}

TEST_F(InspectionServiceTest, RowsCannotBeChanged) {
  ASSERT_TRUE(Inspect(Request()).ok());
  for (const std::string statement :
       {"UPDATE inspections SET verdict = 'CONFORM'", "DELETE FROM inspection_holes", "TRUNCATE inspection_scans"}) {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    EXPECT_FALSE(transaction->Execute(statement).ok()) << statement;
  }
}

TEST_F(InspectionServiceTest, ListsByBladeAndRefusesMoreThanItsSlots) {
  const auto made = Inspect(Request());
  ASSERT_TRUE(made.ok()) << made.status();
  v1::ListInspectionsRequest request;
  request.set_blade("blades/sn1");
  v1::ListInspectionsResponse response;
  ASSERT_TRUE(stub_->ListInspections(runtime::ContextFor(10).get(), request, &response).ok());
  ASSERT_EQ(response.inspections_size(), 1);
  EXPECT_EQ(response.inspections(0).holes_size(), 0);
  request.set_verdict(made->verdict());
  request.set_part(plant_.plant.part.name());
  request.set_view(list::v1::VIEW_FULL);
  ASSERT_TRUE(stub_->ListInspections(runtime::ContextFor(10).get(), request, &response).ok());
  ASSERT_EQ(response.inspections_size(), 1);
  EXPECT_EQ(response.inspections(0).SerializeAsString(), made->SerializeAsString());
  request.set_verdict(made->verdict() == v1::VERDICT_CONFORM ? v1::VERDICT_NOT_CONFORM : v1::VERDICT_CONFORM);
  ASSERT_TRUE(stub_->ListInspections(runtime::ContextFor(10).get(), request, &response).ok());
  EXPECT_EQ(response.inspections_size(), 0);
  Start(0);
  EXPECT_EQ(runtime::ReasonOf(Inspect(Request()).status()), "INSPECTIONS_FULL");
}

}  // namespace
}  // namespace sixpoint::inspection

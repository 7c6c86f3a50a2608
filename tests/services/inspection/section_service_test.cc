// Sections of an extruded airfoil with closed forms that stands where the pinned block does: kept, and read back; what was not seen is told.
#include "services/inspection/section_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/inspection/section_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/record.h"
#include "tests/services/inspection/airfoil_plant.h"
#include "tests/support/sanitizer.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kDeg = 180 / 3.14159265358979323846;

class SectionServiceTest : public ::testing::Test {
 protected:
  static v1::MeasureSectionsRequest Request(const std::vector<double>& heights_mm = {-6, 4, 8}) {
    v1::MeasureSectionsRequest request;
    request.set_registration(testing::kRegistration);
    for (const double height_mm : heights_mm) {
      v1::SectionPlane& plane = *request.add_sections();
      plane.set_section("z " + std::to_string(static_cast<int>(height_mm)));
      plane.mutable_origin_in_part_mm()->set_z_mm(height_mm);
    }
    return request;
  }
  absl::StatusOr<v1::SectionMeasurement> Measure(const v1::MeasureSectionsRequest& request) {
    v1::SectionMeasurement measurement;
    const grpc::Status status =
        stub_->MeasureSections(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), request, &measurement);
    if (!status.ok()) return runtime::FromGrpc(status);
    return measurement;
  }
  static const v1::SectionValue& ValueOf(const v1::Section& section, v1::SectionParameter parameter) {
    for (const v1::SectionValue& value : section.values())
      if (value.parameter() == parameter) return value;
    ADD_FAILURE() << v1::SectionParameter_Name(parameter);
    return v1::SectionValue::default_instance();
  }
  std::vector<v1::SectionOutline> OutlinesOf(const std::string& name) {
    v1::DownloadSectionOutlinesRequest request;
    request.set_name(name);
    const auto context = runtime::ContextFor(10);
    const auto reader = stub_->DownloadSectionOutlines(context.get(), request);
    std::vector<v1::SectionOutline> all;
    for (v1::SectionOutline one; reader->Read(&one);) all.push_back(one);
    EXPECT_TRUE(reader->Finish().ok());
    return all;
  }
  std::int64_t Count(const std::string& table) {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
  }

  testing::AirfoilPlant plant_;
  SectionService service_{
      storage::SectionsIn(plant_.database.database()),
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {}};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::SectionService::Stub> stub_ = v1::SectionService::NewStub(server_.Connect());
};

TEST_F(SectionServiceTest, AreThoseOfTheClosedFormAndReadBackTheSame) {
  const auto measurement = Measure(Request());
  ASSERT_TRUE(measurement.ok()) << measurement.status();
  const metrology::BladeTruth truth = metrology::TruthOf(plant_.blade);
  ASSERT_EQ(measurement->sections_size(), 3);
  for (const v1::Section& section : measurement->sections()) {
    ASSERT_EQ(section.reason(), "");
    EXPECT_EQ(section.leading(), v1::SECTION_END_ROUND);
    EXPECT_EQ(section.trailing(), v1::SECTION_END_ROUND);
    EXPECT_GT(section.point_count(), 4000);
    EXPECT_NEAR(section.noise_um(), 2, 1);
    const auto expect = [&](v1::SectionParameter parameter, v1::SectionUnit unit, double exact, double nominal_within) {
      const v1::SectionValue& value = ValueOf(section, parameter);
      EXPECT_EQ(value.unit(), unit);
      ASSERT_TRUE(value.has_value()) << value.ShortDebugString();
      EXPECT_NEAR(value.nominal(), exact, nominal_within) << v1::SectionParameter_Name(parameter);
      // Twice U: by chance beyond in 1 of 16,000.
      EXPECT_NEAR(value.value(), exact, 2 * value.expanded_uncertainty()) << v1::SectionParameter_Name(parameter);
      EXPECT_LT(value.expanded_uncertainty(), 0.1);
    };
    expect(v1::SECTION_PARAMETER_CHORD_NOSE_TAIL, v1::SECTION_UNIT_MM, truth.chord_mm, 2e-3);
    expect(v1::SECTION_PARAMETER_STAGGER_NOSE_TAIL, v1::SECTION_UNIT_DEG, truth.stagger_rad * kDeg, 5e-3);
    expect(v1::SECTION_PARAMETER_THICKNESS_INSCRIBED, v1::SECTION_UNIT_MM, truth.thickness_mm, 2e-3);
    expect(v1::SECTION_PARAMETER_LEADING_RADIUS, v1::SECTION_UNIT_MM, truth.lead_radius_mm, 2e-3);
    expect(v1::SECTION_PARAMETER_TWIST, v1::SECTION_UNIT_DEG, 0, 1e-12);
    expect(v1::SECTION_PARAMETER_BOW_X, v1::SECTION_UNIT_MM, 0, 1e-12);
    EXPECT_GT(ValueOf(section, v1::SECTION_PARAMETER_PROFILE_LOCATION_GREATEST).value(), 0);
    EXPECT_LT(ValueOf(section, v1::SECTION_PARAMETER_PROFILE_LOCATION_LEAST).value(), 0);
  }
  EXPECT_EQ(ValueOf(measurement->sections(0), v1::SECTION_PARAMETER_TWIST).value(), 0);
  EXPECT_EQ(measurement->reference_section(), "z -6");

  v1::GetSectionMeasurementRequest get;
  get.set_name(measurement->name());
  v1::SectionMeasurement back;
  ASSERT_TRUE(stub_->GetSectionMeasurement(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.DebugString(), measurement->DebugString());
  v1::ListSectionMeasurementsRequest list;
  list.set_blade("blades/sn1");
  v1::ListSectionMeasurementsResponse listed;
  ASSERT_TRUE(stub_->ListSectionMeasurements(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.sections_size(), 1);
  EXPECT_THAT(listed.sections(0).sections(0).values(), IsEmpty());  // the basic view
  list.set_view(list::v1::VIEW_FULL);
  ASSERT_TRUE(stub_->ListSectionMeasurements(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.sections_size(), 1);
  EXPECT_EQ(listed.sections(0).DebugString(), measurement->DebugString());
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, plant_.scans[2]);
  ASSERT_TRUE(derived.ok());
  std::vector<std::string> names;
  for (const storage::JournalEntry& journal : *derived) names.push_back(journal.entry.name);
  EXPECT_THAT(names, Contains(measurement->name()));
}

TEST_F(SectionServiceTest, OutlinesAreWhatTheProfileTells) {
  const auto measurement = Measure(Request({4}));
  ASSERT_TRUE(measurement.ok()) << measurement.status();
  const auto outlines = OutlinesOf(measurement->name());
  ASSERT_EQ(outlines.size(), 1u);
  const v1::SectionOutline& outline = outlines.front();
  ASSERT_EQ(outline.measured_mm_size(), 2 * outline.deviations_um_size());
  ASSERT_GT(outline.deviations_um_size(), 100);
  ASSERT_GT(outline.nominal_mm_size(), 200);
  EXPECT_EQ(outline.part_from_section().translation_mm().z_mm(), 4);
  double least_um = std::numeric_limits<double>::infinity(), greatest_um = -least_um;
  for (const double um : outline.deviations_um()) {
    least_um = std::min(least_um, um);
    greatest_um = std::max(greatest_um, um);
  }
  const v1::Section& section = measurement->sections(0);
  EXPECT_NEAR(least_um, 1e3 * ValueOf(section, v1::SECTION_PARAMETER_PROFILE_LOCATION_LEAST).value(), 1e-9);
  EXPECT_NEAR(greatest_um, 1e3 * ValueOf(section, v1::SECTION_PARAMETER_PROFILE_LOCATION_GREATEST).value(), 1e-9);
  for (const v1::SectionValue& value : section.values()) {  // of one section nothing is told over the span
    EXPECT_NE(value.parameter(), v1::SECTION_PARAMETER_TWIST);
    EXPECT_NE(value.parameter(), v1::SECTION_PARAMETER_THROAT);
  }
}

TEST_F(SectionServiceTest, WhatWasNotSeenIsNotMeasuredAndSaysWhy) {
  v1::MeasureSectionsRequest request = Request({-6, 4, 12});
  request.mutable_neighbour()->mutable_offset_in_part_mm()->set_y_mm(30);
  request.mutable_neighbour()->set_standard_uncertainty_um(5);
  const auto measurement = Measure(request);
  ASSERT_TRUE(measurement.ok()) << measurement.status();
  const v1::Section& none = measurement->sections(2);
  EXPECT_EQ(none.reason(), "no point was seen there");
  EXPECT_FALSE(none.has_noise_um());
  EXPECT_EQ(none.leading(), v1::SECTION_END_UNSPECIFIED);
  ASSERT_FALSE(none.values().empty());
  for (const v1::SectionValue& value : none.values()) {
    EXPECT_FALSE(value.has_value());
    EXPECT_FALSE(value.has_expanded_uncertainty());
    EXPECT_NE(value.reason(), "");
  }
  EXPECT_TRUE(ValueOf(none, v1::SECTION_PARAMETER_CHORD_NOSE_TAIL).has_nominal());
  EXPECT_TRUE(ValueOf(measurement->sections(1), v1::SECTION_PARAMETER_TWIST).has_value());
  EXPECT_THAT(ValueOf(measurement->sections(1), v1::SECTION_PARAMETER_BOW_X).reason(), HasSubstr("at least 3"));
  const v1::SectionValue& throat = ValueOf(measurement->sections(0), v1::SECTION_PARAMETER_THROAT);
  ASSERT_TRUE(throat.has_value()) << throat.reason();
  EXPECT_NEAR(throat.value(), throat.nominal(), 0.03);
  EXPECT_GT(throat.expanded_uncertainty(), 0.01);
  EXPECT_THAT(OutlinesOf(measurement->name())[2].measured_mm(), IsEmpty());
}

TEST_F(SectionServiceTest, ARetryComputesNothingAnew) {
  v1::MeasureSectionsRequest request = Request({4});
  request.set_request_id(kSomeUuid);
  const auto first = Measure(request);
  ASSERT_TRUE(first.ok()) << first.status();
  const auto downloads = plant_.ingest.downloads();
  const auto again = Measure(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->SerializeAsString(), first->SerializeAsString());
  EXPECT_EQ(plant_.ingest.downloads(), downloads);
  EXPECT_EQ(Count("section_measurements"), 1);
}

TEST_F(SectionServiceTest, RefusesWhatCannotBeMeantAndKeepsNothing) {
  const auto refusal = [this](const std::function<void(v1::MeasureSectionsRequest*)>& change) {
    v1::MeasureSectionsRequest request = Request();
    change(&request);
    const auto measurement = Measure(request);
    return measurement.ok() ? std::string("no refusal") : std::string(measurement.status().message());
  };
  using R = v1::MeasureSectionsRequest;
  EXPECT_THAT(refusal([](R* r) { r->set_registration("scans/s1"); }), HasSubstr("registration: scans/s1"));
  EXPECT_THAT(refusal([](R* r) { r->clear_sections(); }), HasSubstr("sections: 0, want 1 to 32 of them"));
  EXPECT_THAT(refusal([](R* r) { r->set_half_width_mm(std::nan("")); }), HasSubstr("half_width_mm: NaN"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_sections(1)->set_section("z -6"); }),
              HasSubstr("sections[1].section: z -6, want another one: it is used before"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_sections(1)->clear_origin_in_part_mm(); }),
              HasSubstr("sections[1].origin_in_part_mm: not stated, want a point of the plane"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_sections(2)->mutable_origin_in_part_mm()->set_z_mm(50); }),
              HasSubstr("sections[2].plane.origin_mm: 50, want a plane that meets the part"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_sections(0)->mutable_reference_in_part()->set_z(1); }),
              HasSubstr("sections[0].plane.reference: 0, want a direction across the normal"));
  EXPECT_THAT(refusal([](R* r) { r->set_reference_section("tip"); }),
              HasSubstr("reference_section: tip, want one of `sections`, or none"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_neighbour()->mutable_offset_in_part_mm()->set_y_mm(30); }),
              HasSubstr("neighbour.standard_uncertainty_um: not stated, want 0 or more"));
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
  EXPECT_EQ(runtime::ReasonOf(Measure(Request()).status()), "REGISTRATION_NOT_CONVERGED");
  EXPECT_EQ(Count("section_measurements"), 0);
  EXPECT_EQ(Count("record_entries WHERE kind = 'section'"), 0);
}

TEST_F(SectionServiceTest, WhatIsNotRecordedIsNotFound) {
  v1::GetSectionMeasurementRequest get;
  get.set_name(std::string("sections/") + kSomeUuid);
  v1::SectionMeasurement measurement;
  const absl::Status missing =
      runtime::FromGrpc(stub_->GetSectionMeasurement(runtime::ContextFor(10).get(), get, &measurement));
  EXPECT_EQ(runtime::ReasonOf(missing), "SECTION_MEASUREMENT_NOT_FOUND") << missing;
}

// A plate without round ends, of whose sections only the top was seen: what has no bounds is told so, and recorded.
TEST(SectionsOfABlock, AreRecordedWithWhatTheyHave) {
  testing::JudgedPlant plant;
  for (const std::string& scan : plant.scans) plant.registration.registration.add_scans(scan);
  SectionService service(
      storage::SectionsIn(plant.database.database()),
      std::make_unique<clients::BladePeers>(plant.Connect(), plant.Connect(), plant.Connect(), plant.Connect()), {});
  testing::InProcessServer server({&service});
  v1::MeasureSectionsRequest request;
  request.set_registration(testing::kRegistration);
  for (const double height_mm : {-5.0, -2.0}) {
    v1::SectionPlane& plane = *request.add_sections();
    plane.set_section("z " + std::to_string(static_cast<int>(height_mm)));
    plane.mutable_origin_in_part_mm()->set_z_mm(height_mm);
  }
  v1::SectionMeasurement measurement;
  const grpc::Status status =
      v1::SectionService::NewStub(server.Connect())
          ->MeasureSections(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &measurement);
  ASSERT_TRUE(status.ok()) << status.error_message();
  for (const v1::Section& section : measurement.sections())
    for (const v1::SectionValue& value : section.values()) EXPECT_NE(value.has_value(), !value.reason().empty());
}

}  // namespace
}  // namespace sixpoint::inspection

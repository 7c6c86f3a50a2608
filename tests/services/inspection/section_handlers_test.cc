// The handlers of section measurements on a fake store: no PostgreSQL, and no section is measured.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/inspection/section_service.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/call.h"
#include "tests/support/fake_sections.h"
#include "tests/support/listed_results.h"
#include "tests/support/must.h"
#include "tests/support/sample_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class SectionHandlersTest : public ::testing::Test {
 protected:
  using Row = storage::SectionMeasurementRow;
  using Stub = v1::SectionService::Stub;

  static Row Sample() {
    Row row = testing::SampleSections();
    row.blade_serial = "sn1";
    row.part_id = "p1";
    row.part_revision = 1;
    row.registration_id = std::string(testing::kRegistration).substr(14);
    row.scan_ids = {"s0", "s1"};
    return row;
  }
  // As if the request had been answered with it; gives its name.
  std::string Put(Row row = Sample(), const v1::MeasureSectionsRequest& request = {}) {
    row.section_measurement_id = storage::NewUuid();
    testing::Must(
        store_->Record(runtime::RecordedRequestOf("inspection.MeasureSections", request, ""), row, {}, {}).status());
    return "sections/" + row.section_measurement_id;
  }
  static v1::MeasureSectionsRequest Request(const std::string& request_id = "") {
    v1::MeasureSectionsRequest request;
    request.set_registration(testing::kRegistration);
    request.set_request_id(request_id);
    v1::SectionPlane& plane = *request.add_sections();
    plane.set_section("50 %");
    plane.mutable_origin_in_part_mm()->set_z_mm(-5);
    return request;
  }
  absl::StatusOr<v1::SectionMeasurement> Measure(const v1::MeasureSectionsRequest& request) {
    return testing::Call(*stub_, &Stub::MeasureSections, request);
  }
  absl::StatusOr<v1::SectionMeasurement> Get(const std::string& name) {
    v1::GetSectionMeasurementRequest request;
    request.set_name(name);
    return testing::Call(*stub_, &Stub::GetSectionMeasurement, request);
  }
  absl::StatusOr<v1::ListSectionMeasurementsResponse> List(const v1::ListSectionMeasurementsRequest& request) {
    return testing::Call(*stub_, &Stub::ListSectionMeasurements, request);
  }
  testing::Streamed<v1::SectionOutline> Outlines(const std::string& name) {
    v1::DownloadSectionOutlinesRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &Stub::DownloadSectionOutlines, request);
  }
  // Of every handler that is given a name.
  std::vector<absl::Status> StatusesOf(const std::string& name) {
    v1::ReplaySectionMeasurementRequest replay;
    replay.set_name(name);
    return {Get(name).status(), Outlines(name).status,
            testing::Call(*stub_, &Stub::ReplaySectionMeasurement, replay).status()};
  }

  testing::StandIns plant_;
  std::shared_ptr<testing::FakeSections> store_ = std::make_shared<testing::FakeSections>();
  SectionService service_{
      store_,
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {}};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::SectionService::NewStub(server_.Connect());
};

TEST_F(SectionHandlersTest, AMeasurementIsReadByItsName) {
  Put();
  const std::string name = Put();
  const auto measurement = Get(name);
  ASSERT_TRUE(measurement.ok()) << measurement.status();
  EXPECT_EQ(measurement->name(), name);
  EXPECT_EQ(measurement->blade(), "blades/sn1");
  EXPECT_EQ(measurement->part(), "parts/p1");
  EXPECT_THAT(measurement->scans(), ElementsAre("scans/s0", "scans/s1"));
  EXPECT_EQ(measurement->record_sequence(), 2);
  ASSERT_THAT(measurement->sections(), SizeIs(1));
  const v1::Section& section = measurement->sections(0);
  EXPECT_EQ(section.leading(), v1::SECTION_END_ROUND);
  EXPECT_EQ(section.trailing(), v1::SECTION_END_SQUARE);
  ASSERT_THAT(section.values(), SizeIs(2));
  EXPECT_EQ(section.values(0).parameter(), v1::SECTION_PARAMETER_CHORD_NOSE_TAIL);
  EXPECT_EQ(section.values(0).value(), 30.01);
  EXPECT_FALSE(section.values(1).has_value());
  EXPECT_EQ(section.values(1).reason(), "no double tangent");
}

TEST_F(SectionHandlersTest, ListsByPagesNewestFirstAndByWhatIsAskedFor) {
  Row other = Sample();
  other.blade_serial = "sn2";
  other.sensor_calibration_id = kSomeUuid;
  const std::vector<std::string> names = {Put(), Put(other), Put(), Put(), Put()};
  testing::ExpectPagesNewestFirst<v1::ListSectionMeasurementsRequest>(
      names, [this](const auto& request) { return List(request); }, [](const auto& page) { return page.sections(); });
  v1::ListSectionMeasurementsRequest request;
  request.set_blade("blades/sn2");
  EXPECT_THAT(testing::ListedNames(List(request)->sections()), ElementsAre(names[1]));
  request.set_blade("blades/sn3");
  EXPECT_THAT(List(request)->sections(), IsEmpty());
  request.clear_blade();
  request.set_calibration(std::string("calibrations/") + kSomeUuid);
  EXPECT_THAT(testing::ListedNames(List(request)->sections()), ElementsAre(names[1]));
}

TEST_F(SectionHandlersTest, AListLeavesTheValuesOutUnlessTheWholeIsAskedFor) {
  const std::string name = Put();
  v1::ListSectionMeasurementsRequest request;
  const auto basic = List(request);
  ASSERT_TRUE(basic.ok()) << basic.status();
  ASSERT_THAT(basic->sections(), SizeIs(1));
  ASSERT_THAT(basic->sections(0).sections(), SizeIs(1));
  EXPECT_EQ(basic->sections(0).sections(0).plane().section(), "50 %");
  EXPECT_THAT(basic->sections(0).sections(0).values(), IsEmpty());
  request.set_view(list::v1::VIEW_FULL);
  const auto full = List(request);
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_EQ(full->sections(0).DebugString(), Get(name)->DebugString());
}

TEST_F(SectionHandlersTest, AListRefusesEachFieldByItsName) {
  testing::ExpectListRefusals<v1::ListSectionMeasurementsRequest>(
      [this](const auto& request) { return List(request); });
}

TEST_F(SectionHandlersTest, OutlinesAreStreamedEachWithItsSection) {
  Row row = Sample();
  row.sections.push_back(row.sections.front());
  row.sections.back().section = "90 %";
  row.outlines.push_back({{1, 0, 0, 7, 0, 0, -1, 8, 0, 1, 0, 9}, {1, 2, 3, 4, 5, 6}, {}, {}, {}});
  const auto streamed = Outlines(Put(row));
  ASSERT_TRUE(streamed.status.ok()) << streamed.status;
  ASSERT_THAT(streamed.messages, SizeIs(2));
  EXPECT_EQ(streamed.messages[0].section(), "50 %");
  EXPECT_THAT(streamed.messages[0].deviations_um(), ElementsAre(1, 2, 3));
  EXPECT_THAT(streamed.messages[0].gaps_before(), ElementsAre(0));
  const v1::SectionOutline& second = streamed.messages[1];
  EXPECT_EQ(second.section(), "90 %");
  EXPECT_THAT(second.part_from_section().rotation(), ElementsAre(1, 0, 0, 0, 0, -1, 0, 1, 0));
  EXPECT_EQ(second.part_from_section().translation_mm().y_mm(), 8);
  EXPECT_THAT(second.nominal_mm(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(second.measured_mm(), IsEmpty());
}

// Which outline were whose would be guessed.
TEST_F(SectionHandlersTest, AnOutlineTooFewIsDataLoss) {
  Row row = Sample();
  row.outlines.clear();
  const auto streamed = Outlines(Put(row));
  EXPECT_EQ(streamed.status.code(), absl::StatusCode::kDataLoss) << streamed.status;
  EXPECT_THAT(std::string(streamed.status.message()), HasSubstr("outlines of 0 sections, want 1"));
  EXPECT_THAT(streamed.messages, IsEmpty());
}

TEST_F(SectionHandlersTest, WhatIsNotRecordedIsNotFoundAndOtherNamesAreRefused) {
  Put();
  const std::string name = std::string("sections/") + kSomeUuid;
  for (const absl::Status& status : StatusesOf(name)) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_EQ(runtime::ReasonOf(status), "SECTION_MEASUREMENT_NOT_FOUND");
    EXPECT_EQ(runtime::MetadataOf(status)["resource"], name);
  }
  for (const absl::Status& status : StatusesOf(std::string("deviations/") + kSomeUuid))
    EXPECT_EQ(testing::RefusedField(status), "name");
}

TEST_F(SectionHandlersTest, SaysWhatTheStoreSays) {
  const std::string name = Put();
  store_->Fail(absl::ResourceExhaustedError("database: full"));
  std::vector<absl::Status> statuses = StatusesOf(name);
  statuses.push_back(List({}).status());
  statuses.push_back(Measure(Request()).status());
  for (const absl::Status& status : statuses) {
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("database: full"));
  }
}

// A row of a newer release, after a step back to this one.
TEST_F(SectionHandlersTest, AWordThatThisReleaseDoesNotKnowIsDataLoss) {
  Row row = Sample();
  row.sections.front().values.front().parameter = "CHORD_GUESSED";
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
  row = Sample();
  row.sections.front().found->leading_end = "TORN";
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(SectionHandlersTest, ARetryGetsWhatTheFirstCallRecordedWithoutAnyWork) {
  const std::string name = Put(Sample(), Request(kSomeUuid));
  plant_.registration.registration.set_name("registrations/gone");  // work would fail
  const auto again = Measure(Request(kSomeUuid));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->DebugString(), Get(name)->DebugString());
  EXPECT_THAT(store_->rows(), SizeIs(1));
  v1::MeasureSectionsRequest other = Request(kSomeUuid);
  other.set_half_width_mm(1);
  EXPECT_EQ(Measure(other).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(Measure(Request()).status().code(), absl::StatusCode::kNotFound) << "nothing is kept without an id";
}

TEST_F(SectionHandlersTest, NothingIsRecordedOfWhatIsRefused) {
  v1::MeasureSectionsRequest request = Request();
  request.clear_sections();
  EXPECT_EQ(testing::RefusedField(Measure(request).status()), "sections");
  request = Request();
  request.set_reference_section("tip");
  EXPECT_EQ(testing::RefusedField(Measure(request).status()), "reference_section");
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
  EXPECT_EQ(runtime::ReasonOf(Measure(Request()).status()), "REGISTRATION_NOT_CONVERGED");
  EXPECT_THAT(plant_.ingest.downloads(), IsEmpty());
  EXPECT_THAT(store_->rows(), IsEmpty());
  EXPECT_THAT(store_->entries(), IsEmpty());
}

}  // namespace
}  // namespace sixpoint::inspection

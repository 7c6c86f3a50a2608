// The handlers of other instruments' measurements on fake stores: no PostgreSQL. What files may hold is tested in measurement_service_test.cc
// and measurement_refusals_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "services/inspection/measurement_service.h"
#include "storage/blobs.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/call.h"
#include "tests/support/fake_assessments.h"
#include "tests/support/fake_measurements.h"
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

// Knows parts and whose blades are.
class PlantWithBlades final : public plant::v1::PlantService::Service {
 public:
  std::map<std::string, std::string> part_of;  // by the blade's name
  grpc::Status GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest* request,
                       plant::v1::Part* response) override {
    response->set_name(request->name().substr(0, request->name().find('@')));
    return grpc::Status::OK;
  }
  grpc::Status GetBlade(grpc::ServerContext*, const plant::v1::GetBladeRequest* request,
                        plant::v1::Blade* response) override {
    if (part_of.count(request->name()) == 0) return {grpc::StatusCode::NOT_FOUND, request->name() + " is not known"};
    response->set_name(request->name());
    response->set_part(part_of.at(request->name()));
    return grpc::Status::OK;
  }
};

class MeasurementHandlersTest : public ::testing::Test {
 protected:
  using Row = storage::MeasurementRow;
  using Stub = v1::MeasurementService::Stub;

  // A drawing of one chord.
  MeasurementHandlersTest() {
    plant_.part_of = {{"blades/sn1", "parts/p1"}, {"blades/sn2", "parts/p1"}, {"blades/x1", "parts/another"}};
    plant::v1::Drawing drawing;
    drawing.set_name("drawings/d1");
    drawing.set_revision(1);
    drawing.set_part("parts/p1");
    drawing.add_part_revisions(1);
    plant::v1::Characteristic& chord = *drawing.add_characteristics();
    chord.set_characteristic("1");
    chord.set_name("chord");
    chord.set_quantity(plant::v1::CHARACTERISTIC_QUANTITY_SECTION_CHORD);
    chord.set_unit(plant::v1::CHARACTERISTIC_UNIT_MM);
    for (const char* name : {"drawings/d1", "drawings/d1@1"}) drawings_.drawings[name] = drawing;
  }
  static std::string Line(const std::string& serial, const std::string& value) {
    return serial + ",1," + value + ",mm,2024-05-01T11:06:41Z\n";
  }
  static v1::ImportMeasurementsRequest Request(const std::string& lines, const std::string& request_id = "") {
    v1::ImportMeasurementsRequest request;
    request.set_drawing("drawings/d1");
    request.set_content("serial,characteristic,value,unit,measured_at\n" + lines);
    request.set_format(v1::MEASUREMENT_FORMAT_CSV);
    request.mutable_instrument()->set_kind(v1::INSTRUMENT_KIND_CMM);
    request.mutable_instrument()->set_manufacturer("Acme");
    request.mutable_instrument()->set_model("C-1");
    request.mutable_instrument()->set_serial_number("4711");
    request.set_request_id(request_id);
    return request;
  }
  static Row Sample(const std::string& serial = "sn1") {
    Row row = testing::SampleMeasurement();
    row.blade_serial = serial;
    row.file.drawing_id = "d1";
    row.file.part_id = "p1";
    return row;
  }
  // As if the request had been answered with it alone; gives its name.
  std::string Put(const Row& row = Sample(), const v1::ImportMeasurementsRequest& request = {}) {
    storage::MeasurementImport import;
    import.measurements = {row};
    import.measurements.front().measurement_id = storage::NewUuid();
    testing::Must(
        store_->Record(runtime::RecordedRequestOf("inspection.ImportMeasurements", request, ""), import, {}, {})
            .status());
    return "measurements/" + import.measurements.front().measurement_id;
  }
  // What this plant found of that chord, by the drawing's first revision.
  void PutOurs(const std::string& serial, double value) {
    storage::AssessmentRow row = testing::SampleAssessment();
    row.assessment_id = storage::NewUuid();
    row.blade_serial = serial;
    row.drawing_id = "d1";
    row.findings.front().value = value;
    testing::Must(assessments_->Record({}, row, {}, {}).status());
  }
  absl::StatusOr<v1::ImportMeasurementsResponse> Import(const v1::ImportMeasurementsRequest& request) {
    return testing::Call(*stub_, &Stub::ImportMeasurements, request);
  }
  absl::StatusOr<v1::Measurement> Get(const std::string& name) {
    v1::GetMeasurementRequest request;
    request.set_name(name);
    return testing::Call(*stub_, &Stub::GetMeasurement, request);
  }
  absl::StatusOr<v1::ListMeasurementsResponse> List(const v1::ListMeasurementsRequest& request) {
    return testing::Call(*stub_, &Stub::ListMeasurements, request);
  }
  absl::StatusOr<v1::CompareMeasurementsResponse> Compare(const std::string& drawing,
                                                          const std::string& instrument = "") {
    v1::CompareMeasurementsRequest request;
    request.set_drawing(drawing);
    request.set_instrument_serial_number(instrument);
    return testing::Call(*stub_, &Stub::CompareMeasurements, request);
  }

  PlantWithBlades plant_;
  testing::StandInDrawings drawings_;
  testing::InProcessServer plant_server_{{&plant_, &drawings_}};
  std::shared_ptr<testing::FakeMeasurements> store_ = std::make_shared<testing::FakeMeasurements>();
  std::shared_ptr<testing::FakeAssessments> assessments_ = std::make_shared<testing::FakeAssessments>();
  MeasurementService service_{
      store_, store_, OurValuesOf(assessments_),
      std::make_shared<const clients::BladePeers>(plant_server_.Connect(), plant_server_.Connect(),
                                                  plant_server_.Connect(), plant_server_.Connect())};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::MeasurementService::NewStub(server_.Connect());
};

TEST_F(MeasurementHandlersTest, AFileIsRecordedAsAMeasurementOfEachBlade) {
  const v1::ImportMeasurementsRequest request = Request(Line("sn2", "30.01") + Line("sn1", "30.02"));
  const auto response = Import(request);
  ASSERT_TRUE(response.ok()) << response.status();
  ASSERT_THAT(response->measurements(), SizeIs(2));
  EXPECT_EQ(response->measurements(0).blade(), "blades/sn2");
  EXPECT_EQ(response->measurements(1).blade(), "blades/sn1");
  EXPECT_EQ(response->measurements(1).value_count(), 1);
  EXPECT_THAT(response->measurements(1).values(), IsEmpty());
  ASSERT_THAT(store_->rows(), SizeIs(2));
  const auto read = Get(response->measurements(1).name());
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->drawing(), "drawings/d1@1");
  EXPECT_EQ(read->part(), "parts/p1");
  EXPECT_EQ(read->file_sha256(), storage::Sha256Hex(request.content()));
  EXPECT_EQ(read->measured_at().seconds(), 1'714'561'601);
  EXPECT_EQ(read->instrument().serial_number(), "4711");
  EXPECT_THAT(read->requested_by(), ::testing::StartsWith("ipv4:127.0.0.1:"));  // no certificate
  ASSERT_THAT(read->values(), SizeIs(1));
  EXPECT_EQ(read->values(0).value(), 30.02);
}

TEST_F(MeasurementHandlersTest, ARetryGetsWhatTheFirstCallRecordedWithoutAnyWork) {
  const v1::ImportMeasurementsRequest request = Request(Line("nobody's", "30.01"), kSomeUuid);
  const std::string name = Put(Sample(), request);
  const auto again = Import(request);  // nobody knows the blade: work would fail
  ASSERT_TRUE(again.ok()) << again.status();
  ASSERT_THAT(again->measurements(), SizeIs(1));
  EXPECT_EQ(again->measurements(0).name(), name);
  EXPECT_EQ(again->measurements(0).value_count(), 1);
  EXPECT_THAT(store_->rows(), SizeIs(1));
  EXPECT_EQ(Import(Request(Line("sn1", "30"), kSomeUuid)).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(MeasurementHandlersTest, RefusesEachFieldByItsNameAndRecordsNothing) {
  const auto field = [this](const std::function<void(v1::ImportMeasurementsRequest*)>& spoil) {
    v1::ImportMeasurementsRequest request = Request(Line("sn1", "30.01"));
    spoil(&request);
    return testing::RefusedField(Import(request).status());
  };
  using R = v1::ImportMeasurementsRequest;
  EXPECT_EQ(field([](R* r) { r->set_drawing("parts/p1"); }), "drawing");
  EXPECT_EQ(field([](R* r) { r->set_drawing("drawings/d2"); }), "drawing") << "not known";
  EXPECT_EQ(field([](R* r) { r->clear_content(); }), "content");
  EXPECT_EQ(field([](R* r) { r->clear_format(); }), "format");
  EXPECT_EQ(field([](R* r) { r->mutable_instrument()->clear_kind(); }), "instrument.kind");
  EXPECT_EQ(field([](R* r) { r->set_content(r->content() + Line("sn3", "30")); }), "content: serial") << "not known";
  EXPECT_EQ(field([](R* r) { r->set_content(r->content() + Line("x1", "30")); }), "content: serial") << "another part";
  EXPECT_THAT(store_->rows(), IsEmpty());
}

TEST_F(MeasurementHandlersTest, ListsByPagesNewestFirstAndByWhatIsAskedFor) {
  Row other = Sample("sn2");
  other.file.drawing_id = "d2";
  other.file.part_id = "p2";
  other.file.instrument.serial_number = "9";
  other.file.sha256 = std::string(64, 'e');
  const std::vector<std::string> names = {Put(), Put(other), Put(), Put(), Put()};
  testing::ExpectPagesNewestFirst<v1::ListMeasurementsRequest>(
      names, [this](const auto& request) { return List(request); },
      [](const auto& page) { return page.measurements(); });
  using L = v1::ListMeasurementsRequest;
  for (const std::function<void(L*)>& ask :
       {std::function<void(L*)>([](L* l) { l->set_blade("blades/sn2"); }),
        std::function<void(L*)>([](L* l) { l->set_part("parts/p2"); }),
        std::function<void(L*)>([](L* l) { l->set_drawing("drawings/d2"); }),
        std::function<void(L*)>([](L* l) { l->set_instrument_serial_number("9"); }),
        std::function<void(L*)>([](L* l) { l->set_file_sha256(std::string(64, 'e')); })}) {
    L request;
    ask(&request);
    const auto listed = List(request);
    ASSERT_TRUE(listed.ok()) << listed.status();
    EXPECT_THAT(testing::ListedNames(listed->measurements()), ElementsAre(names[1])) << request.ShortDebugString();
  }
}

TEST_F(MeasurementHandlersTest, AListLeavesTheValuesOutUnlessTheWholeIsAskedFor) {
  const std::string name = Put();
  v1::ListMeasurementsRequest request;
  const auto basic = List(request);
  ASSERT_TRUE(basic.ok()) << basic.status();
  ASSERT_THAT(basic->measurements(), SizeIs(1));
  EXPECT_THAT(basic->measurements(0).values(), IsEmpty());
  EXPECT_EQ(basic->measurements(0).value_count(), 1);  // how many there are, in lists too
  EXPECT_EQ(basic->measurements(0).measured_count(), 1);
  EXPECT_THAT(basic->measurements(0).left_out(), IsEmpty());
  EXPECT_EQ(basic->measurements(0).left_out_count(), 1);
  request.set_view(list::v1::VIEW_FULL);
  const auto full = List(request);
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_THAT(full->measurements(0).values(), SizeIs(1));
  EXPECT_EQ(full->measurements(0).DebugString(), Get(name)->DebugString());
}

TEST_F(MeasurementHandlersTest, AListRefusesEachFieldByItsName) {
  const auto field = [this](const std::function<void(v1::ListMeasurementsRequest*)>& ask) {
    v1::ListMeasurementsRequest request;
    ask(&request);
    return testing::RefusedField(List(request).status());
  };
  using L = v1::ListMeasurementsRequest;
  EXPECT_EQ(field([](L* l) { l->set_blade("parts/p1"); }), "blade");
  EXPECT_EQ(field([](L* l) { l->set_part("blades/sn1"); }), "part");
  EXPECT_EQ(field([](L* l) { l->set_drawing("parts/p1"); }), "drawing");
  EXPECT_EQ(field([](L* l) { l->set_file_sha256("E" + std::string(63, '0')); }), "file_sha256");
  EXPECT_EQ(field([](L* l) { l->mutable_recorded()->mutable_from()->set_seconds(1); }), "recorded.from.seconds");
  EXPECT_EQ(field([](L* l) { l->set_view(static_cast<list::v1::View>(7)); }), "view");
  EXPECT_EQ(field([](L* l) { l->set_page_token("of another list"); }), "page_token");
}

TEST_F(MeasurementHandlersTest, OursStandBesideTheirsByTheSameRevision) {
  Row other_revision = Sample("sn2");
  other_revision.file.drawing_revision = 2;
  Put(other_revision);
  Put();
  PutOurs("sn1", 30.05);
  PutOurs("sn2", 30.05);
  const auto compared = Compare("drawings/d1");
  ASSERT_TRUE(compared.ok()) << compared.status();
  EXPECT_EQ(compared->drawing(), "drawings/d1@1");
  EXPECT_EQ(compared->measurement_count(), 1);
  EXPECT_FALSE(compared->truncated());
  ASSERT_THAT(compared->biases(), SizeIs(1));
  ASSERT_THAT(compared->biases(0).pairs(), SizeIs(1));
  EXPECT_EQ(compared->biases(0).name(), "chord");
  EXPECT_EQ(compared->biases(0).pairs(0).blade(), "blades/sn1");
  EXPECT_EQ(compared->biases(0).pairs(0).ours(), 30.05);
  EXPECT_EQ(compared->biases(0).pairs(0).theirs(), 30.02);
  EXPECT_EQ(Compare("drawings/d1", "another")->measurement_count(), 0);
  EXPECT_EQ(testing::RefusedField(Compare("parts/p1").status()), "drawing");
  EXPECT_EQ(testing::RefusedField(Compare("drawings/d2").status()), "drawing") << "not known";
}

TEST_F(MeasurementHandlersTest, WhatIsNotRecordedIsNotFoundAndWhatCannotBeReadIsDataLoss) {
  const std::string name = std::string("measurements/") + kSomeUuid;
  const absl::Status missing = Get(name).status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound) << missing;
  EXPECT_EQ(runtime::ReasonOf(missing), "MEASUREMENT_NOT_FOUND");
  EXPECT_EQ(runtime::MetadataOf(missing)["resource"], name);
  EXPECT_EQ(testing::RefusedField(Get(std::string("sections/") + kSomeUuid).status()), "name");
  Row row = Sample();
  row.file.instrument.kind = "PENDULUM";
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(MeasurementHandlersTest, SaysWhatTheStoresSay) {
  const std::string name = Put();
  assessments_->Fail(absl::DeadlineExceededError("database: slow"));
  EXPECT_EQ(Compare("drawings/d1").status().code(), absl::StatusCode::kDeadlineExceeded);
  store_->Fail(absl::ResourceExhaustedError("database: full"));
  for (const absl::Status& status : {Get(name).status(), List({}).status(), Compare("drawings/d1").status(),
                                     Import(Request(Line("sn1", "30"))).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("database: full"));
  }
  EXPECT_THAT(store_->rows(), SizeIs(1));
}

}  // namespace
}  // namespace sixpoint::inspection

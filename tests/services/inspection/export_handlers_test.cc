// The handler of exports on fake stores: no PostgreSQL. What each format says is tested in tests/exchange.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <map>

#include "exchange/aqdef.h"
#include "exchange/csv.h"
#include "exchange/qif.h"
#include "services/inspection/export_service.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "tests/support/becomes.h"
#include "tests/support/call.h"
#include "tests/support/exposed.h"
#include "tests/support/fake_assessments.h"
#include "tests/support/fake_deviations.h"
#include "tests/support/fake_inspections.h"
#include "tests/support/in_process_server.h"
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
using ::testing::MatchesRegex;
using ::testing::Not;
using ::testing::SizeIs;

// Knows machine m1 alone, and counts how often it is asked.
class CountedMachines final : public plant::v1::PlantService::Service {
 public:
  std::atomic<int> asked_count{0};
  std::function<void(const grpc::ServerContext& context)> meanwhile;  // before it answers; may be empty
  grpc::Status GetMachine(grpc::ServerContext* context, const plant::v1::GetMachineRequest* request,
                          plant::v1::Machine* response) override {
    ++asked_count;
    if (meanwhile) meanwhile(*context);
    if (request->name().rfind("machines/m1@", 0) != 0)
      return {grpc::StatusCode::NOT_FOUND, request->name() + " is not known"};
    response->set_name("machines/m1");
    response->mutable_sensor()->set_model("LS-1");
    response->mutable_sensor()->set_serial_number("77");
    return grpc::Status::OK;
  }
};

class ExportHandlersTest : public ::testing::Test {
 protected:
  using Request = v1::ExportResultsRequest;
  using Ask = std::function<void(Request*)>;

  template <typename Row>
  static Row OfBlade(const std::string& serial, Row row) {
    row.blade_serial = serial;
    row.machine_id = "m1";
    row.machine_revision = 1;
    row.part_id = "p1";
    row.part_revision = 2;
    return row;
  }
  static storage::InspectionRow Sample(const std::string& serial = "sn1") {
    return OfBlade(serial, testing::SampleInspection());
  }
  static storage::DeviationMapRow SampleMap(const std::string& serial = "sn1") {
    return OfBlade(serial, testing::SampleDeviation());
  }
  // Each gives the name.
  std::string Put(storage::InspectionRow row) {
    row.inspection_id = storage::NewUuid();
    testing::Must(inspections_->Record({}, row, {}, {}).status());
    return "inspections/" + row.inspection_id;
  }
  std::string Put(storage::DeviationMapRow row) {
    row.deviation_id = storage::NewUuid();
    testing::Must(deviations_->Record({}, row, {}, {}).status());
    return "deviations/" + row.deviation_id;
  }
  std::string Put(storage::AssessmentRow row) {
    row.assessment_id = storage::NewUuid();
    testing::Must(assessments_->Record({}, row, {}, {}).status());
    return "assessments/" + row.assessment_id;
  }
  struct Received {
    std::vector<std::string> files;  // as they came
    std::map<std::string, std::string> content;
    absl::Status status;
  };
  Received Export(
      v1::ExportFormat format, const Ask& ask = [](Request*) {}) {
    Request request;
    request.set_format(format);
    ask(&request);
    const auto streamed = testing::CallStream(*stub_, &v1::ExportService::Stub::ExportResults, request);
    Received received;
    received.status = streamed.status;
    for (const v1::ExportResultsResponse& piece : streamed.messages) {
      if (received.content.count(piece.file()) == 0) received.files.push_back(piece.file());
      received.content[piece.file()] += piece.content();
    }
    return received;
  }
  // Of a CSV file.
  static std::vector<std::string> ResultsIn(const Received& csv) {
    const auto file = csv.content.find("results.csv");
    const auto parts = exchange::FromCsv(file == csv.content.end() ? "no file" : file->second);
    EXPECT_TRUE(parts.ok()) << parts.status();
    std::vector<std::string> results;
    if (parts.ok())
      for (const exchange::InspectedPart& part : *parts) results.push_back(part.result);
    return results;
  }
  std::vector<std::string> Exported(const Ask& ask) {
    const Received csv = Export(v1::EXPORT_FORMAT_CSV, ask);
    EXPECT_TRUE(csv.status.ok()) << csv.status;
    return ResultsIn(csv);
  }
  static std::string IdIn(const std::string& name) { return name.substr(name.find('/') + 1); }

  CountedMachines machines_;
  testing::InProcessServer plant_server_{{&machines_}};
  std::shared_ptr<testing::FakeInspections> inspections_ = std::make_shared<testing::FakeInspections>();
  std::shared_ptr<testing::FakeDeviations> deviations_ = std::make_shared<testing::FakeDeviations>();
  std::shared_ptr<testing::FakeAssessments> assessments_ = std::make_shared<testing::FakeAssessments>();
  ExportService service_{inspections_, deviations_, assessments_,
                         std::make_shared<const clients::BladePeers>(plant_server_.Connect(), plant_server_.Connect(),
                                                                     plant_server_.Connect(), plant_server_.Connect())};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::ExportService::Stub> stub_ = v1::ExportService::NewStub(server_.Connect());
};

TEST_F(ExportHandlersTest, AQifDocumentIsOfEachResultAfterThePlanThatItNames) {
  const std::string older = Put(Sample()), newer = Put(Sample("sn2")), map = Put(SampleMap());
  const Received qif = Export(v1::EXPORT_FORMAT_QIF);
  ASSERT_TRUE(qif.status.ok()) << qif.status;
  const auto is_plan = MatchesRegex("p1@2_plan_[0-9a-f]{8}[.]qif");
  ASSERT_THAT(qif.files, ElementsAre(is_plan, "sn2_" + IdIn(newer) + ".qif", "sn1_" + IdIn(older) + ".qif", is_plan,
                                     "sn1_" + IdIn(map) + ".qif"));
  const auto holes = exchange::FromQif(qif.content.at(qif.files[1]));
  ASSERT_TRUE(holes.ok()) << holes.status();
  EXPECT_EQ(holes->result, newer);
  EXPECT_EQ(holes->serial, "sn2");
  EXPECT_EQ(holes->sensor_serial_number, "77");
  ASSERT_THAT(holes->values, SizeIs(4));
  EXPECT_EQ(holes->characteristics[0].name, "G1/H1/position");
  EXPECT_EQ(holes->values[0].value, 0.02);
  EXPECT_EQ(holes->values[0].verdict, exchange::Verdict::kConform);
  EXPECT_FALSE(holes->values[2].value.has_value());
  EXPECT_EQ(holes->values[2].verdict, exchange::Verdict::kNotMeasured);
  const auto profile = exchange::FromQif(qif.content.at(qif.files[4]));
  ASSERT_TRUE(profile.ok()) << profile.status();
  EXPECT_EQ(profile->result, map);
  ASSERT_THAT(profile->values, SizeIs(1));
  EXPECT_EQ(profile->characteristics[0].name, "17");
  EXPECT_DOUBLE_EQ(profile->values[0].value.value_or(0), 0.003);
  EXPECT_THAT(qif.content.at(qif.files[4]), Not(HasSubstr("PointSet")));  // nobody asked for them
}

TEST_F(ExportHandlersTest, OneCsvFileHasThemAllAndIsThereWithoutAny) {
  const Received none = Export(v1::EXPORT_FORMAT_CSV);
  ASSERT_TRUE(none.status.ok()) << none.status;
  EXPECT_EQ(none.content, (std::map<std::string, std::string>{{"results.csv", exchange::CsvHead()}}));
  const std::string older = Put(Sample()), map = Put(SampleMap()), newer = Put(Sample());
  const Received csv = Export(v1::EXPORT_FORMAT_CSV);
  ASSERT_TRUE(csv.status.ok()) << csv.status;
  EXPECT_THAT(csv.files, ElementsAre("results.csv"));
  EXPECT_THAT(ResultsIn(csv), ElementsAre(newer, older, map));
  EXPECT_EQ(exchange::FromCsv(csv.content.at("results.csv"))->front().values[1].value, 0.25);
}

TEST_F(ExportHandlersTest, AnAqdefFileIsOfWhatHasTheSameCharacteristics) {
  const std::string older = Put(Sample()), map = Put(SampleMap()), newer = Put(Sample("sn2"));
  storage::InspectionRow other = Sample("sn3");
  other.holes.resize(1);
  const std::string of_one_hole = Put(other);
  const Received aqdef = Export(v1::EXPORT_FORMAT_AQDEF);
  ASSERT_TRUE(aqdef.status.ok()) << aqdef.status;
  ASSERT_THAT(aqdef.files, ElementsAre("p1@2_" + IdIn(of_one_hole) + ".dfq", "p1@2_" + IdIn(newer) + ".dfq",
                                       "p1@2_" + IdIn(map) + ".dfq"));
  const auto both = exchange::FromAqdef(aqdef.content.at(aqdef.files[1]));
  ASSERT_TRUE(both.ok()) << both.status();
  ASSERT_THAT(*both, SizeIs(2));
  std::vector<std::string> serials = {both->front().serial, both->back().serial};
  std::sort(serials.begin(), serials.end());
  EXPECT_THAT(serials, ElementsAre("sn1", "sn2"));
  EXPECT_EQ(both->front().values[0].value, 0.02);
  EXPECT_THAT(Export(v1::EXPORT_FORMAT_AQDEF, [](Request* r) { r->set_blade("blades/sn9"); }).files, IsEmpty());
}

TEST_F(ExportHandlersTest, AssessmentsAreToldInsteadOfInspectionsAndMaps) {
  Put(Sample());
  Put(SampleMap());
  storage::AssessmentRow row = OfBlade("sn1", testing::SampleAssessment());
  row.drawing_id = "d1";
  const std::string judged = Put(row);
  row.machine_id.clear();  // of other instruments' measurements alone
  row.machine_revision = 0;
  const std::string elsewhere = Put(row);
  const Received csv = Export(v1::EXPORT_FORMAT_CSV, [](Request* r) { r->set_assessments(true); });
  ASSERT_TRUE(csv.status.ok()) << csv.status;
  EXPECT_THAT(ResultsIn(csv), ElementsAre(elsewhere, judged));
  const auto parts = exchange::FromCsv(csv.content.at("results.csv"));
  EXPECT_EQ(parts->front().characteristics[0].name, "1");
  EXPECT_EQ(parts->front().values[0].value, 0.1);
  EXPECT_EQ(parts->front().values[0].verdict, exchange::Verdict::kNotConform);
  EXPECT_EQ(parts->front().machine, "");
  EXPECT_EQ(machines_.asked_count, 1);
}

TEST_F(ExportHandlersTest, FindsByWhatIsAskedFor) {
  storage::InspectionRow inspection = Sample("other-1");
  inspection.verdict = "CONFORM";
  inspection.sensor_calibration_id = kSomeUuid;
  storage::DeviationMapRow map = SampleMap("other-1");
  map.verdict = "CONFORM";
  map.rotation_calibration_id = kSomeUuid;
  inspection.part_id = map.part_id = "p2";
  storage::DeviationMapRow out = SampleMap();
  out.verdict = "NOT_CONFORM";
  const auto of_other = ElementsAre(Put(inspection), Put(map));
  Put(Sample());
  Put(out);
  EXPECT_THAT(Exported([](Request* r) { r->set_blade("blades/other-1"); }), of_other);
  EXPECT_THAT(Exported([](Request* r) { r->set_part("parts/p2"); }), of_other);
  EXPECT_THAT(Exported([](Request* r) { r->set_verdict(v1::VERDICT_CONFORM); }), of_other);
  EXPECT_THAT(Exported([](Request* r) { r->set_calibration(std::string("calibrations/") + kSomeUuid); }), of_other);
  EXPECT_THAT(Exported([](Request* r) { r->set_machine("machines/m1"); }), SizeIs(4));
  EXPECT_THAT(Exported([](Request* r) { r->set_machine("machines/m2"); }), IsEmpty());
  EXPECT_THAT(Exported([](Request* r) { r->mutable_recorded()->mutable_from()->set_seconds(4'000'000'000); }),
              IsEmpty());
}

// An older one that has the verdict does not stand for the newest, nor does a map without anything to tell.
TEST_F(ExportHandlersTest, OfABladeTheNewestThatHasSomethingToTell) {
  storage::InspectionRow conform = Sample();
  conform.verdict = "CONFORM";
  Put(conform);
  const std::string newest = Put(Sample()), of_other = Put(Sample("sn2")), map = Put(SampleMap());
  storage::DeviationMapRow unjudged = SampleMap();
  unjudged.profiles.clear();
  unjudged.verdict.clear();
  Put(unjudged);
  EXPECT_THAT(Exported([](Request* r) { r->set_only_newest(true); }), ElementsAre(of_other, newest, map));
  EXPECT_THAT(Exported([](Request* r) {
                r->set_only_newest(true);
                r->set_verdict(v1::VERDICT_CONFORM);
              }),
              ElementsAre(map));
}

TEST_F(ExportHandlersTest, ReadsPageByPageAndEachRevisionOfAMachineOnce) {
  std::vector<std::string> names;
  for (int i = 0; i < 2 * kExportPage + 50; ++i) {
    storage::InspectionRow row = Sample();
    row.machine_revision = 1 + i % 2;
    names.push_back(Put(row));
  }
  std::atomic<int> page_count{0};
  inspections_->BeforeList([&] { ++page_count; });
  EXPECT_EQ(Exported([](Request*) {}), std::vector<std::string>(names.rbegin(), names.rend()));
  EXPECT_EQ(page_count, 3);
  EXPECT_EQ(machines_.asked_count, 2);
}

TEST_F(ExportHandlersTest, MoreThanAnExportHoldsIsRefused) {
  storage::InspectionRow row = Sample();
  row.holes.clear();
  for (int i = 0; i < 5000; ++i) Put(row);
  EXPECT_TRUE(Export(v1::EXPORT_FORMAT_CSV).status.ok());
  Put(row);
  EXPECT_THAT(
      ViolationsOf(Export(v1::EXPORT_FORMAT_CSV).status),
      ElementsAre(Violation{"recorded", "more than 5000 results", "a part, a machine or a time with fewer of them"}));
}

TEST_F(ExportHandlersTest, RefusesEachFieldByItsValueAndWhatIsWanted) {
  Put(Sample());
  const auto refused = [this](v1::ExportFormat format, const Ask& ask) {
    const Received received = Export(format, ask);
    EXPECT_THAT(received.files, IsEmpty());
    return ViolationsOf(received.status);
  };
  const auto of_csv = [&](const Ask& ask) { return refused(v1::EXPORT_FORMAT_CSV, ask); };
  const char* const formats = "EXPORT_FORMAT_QIF, EXPORT_FORMAT_AQDEF or EXPORT_FORMAT_CSV";
  EXPECT_THAT(refused(v1::EXPORT_FORMAT_UNSPECIFIED, [](Request*) {}),
              ElementsAre(Violation{"format", "EXPORT_FORMAT_UNSPECIFIED", formats}));
  EXPECT_THAT(refused(static_cast<v1::ExportFormat>(9), [](Request*) {}),
              ElementsAre(Violation{"format", "empty", formats}));
  const std::string id = "{id}, the id 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not '.'";
  EXPECT_THAT(of_csv([](Request* r) { r->set_blade("sn1"); }), ElementsAre(Violation{"blade", "sn1", "blades/" + id}));
  EXPECT_THAT(of_csv([](Request* r) { r->set_machine("m1"); }),
              ElementsAre(Violation{"machine", "m1", "machines/" + id}));
  EXPECT_THAT(of_csv([](Request* r) { r->set_part("machines/m1"); }),
              ElementsAre(Violation{"part", "machines/m1", "parts/" + id}));
  EXPECT_THAT(of_csv([](Request* r) { r->set_calibration("c1"); }),
              ElementsAre(Violation{"calibration", "c1", "calibrations/" + id}));
  EXPECT_THAT(of_csv([](Request* r) {
                r->mutable_recorded()->mutable_from()->set_seconds(1'800'000'000);
                r->mutable_recorded()->mutable_until()->set_seconds(1'700'000'000);
              }),
              ElementsAre(Violation{"recorded.until", "1700000000 s", "not before recorded.from"}));
  EXPECT_THAT(of_csv([](Request* r) { r->set_verdict(static_cast<v1::Verdict>(99)); }),
              ElementsAre(Violation{"verdict", "99", "a verdict, or none"}));
  const Violation no_points{"deviation_points", "true", "false, unless maps are written as EXPORT_FORMAT_QIF"};
  EXPECT_THAT(of_csv([](Request* r) { r->set_deviation_points(true); }), ElementsAre(no_points));
  EXPECT_THAT(refused(v1::EXPORT_FORMAT_QIF,
                      [](Request* r) {
                        r->set_deviation_points(true);
                        r->set_assessments(true);
                      }),
              ElementsAre(no_points));
  EXPECT_EQ(machines_.asked_count, 0);
}

TEST_F(ExportHandlersTest, SaysWhatTheStoresSay) {
  deviations_->Fail(absl::UnavailableError("database: away"));
  assessments_->Fail(absl::ResourceExhaustedError("database: full"));
  const absl::Status away = Export(v1::EXPORT_FORMAT_QIF).status;
  EXPECT_EQ(away.code(), absl::StatusCode::kUnavailable) << away;
  EXPECT_THAT(std::string(away.message()), HasSubstr("database: away"));
  EXPECT_EQ(Export(v1::EXPORT_FORMAT_QIF, [](Request* r) { r->set_assessments(true); }).status.code(),
            absl::StatusCode::kResourceExhausted);
  inspections_->Fail(absl::DeadlineExceededError("database: slow"));
  EXPECT_EQ(Export(v1::EXPORT_FORMAT_QIF).status.code(), absl::StatusCode::kDeadlineExceeded);
}

TEST_F(ExportHandlersTest, WhatWasReadBeforeTheStoreFailedIsSentWithWhatItSays) {
  for (int i = 0; i < kExportPage + 1; ++i) Put(Sample());
  std::atomic<int> page_count{0};
  inspections_->BeforeList([&] {
    if (++page_count == 2) inspections_->Fail(absl::UnavailableError("database: away"));
  });
  const Received csv = Export(v1::EXPORT_FORMAT_CSV);
  EXPECT_EQ(csv.status.code(), absl::StatusCode::kUnavailable) << csv.status;
  EXPECT_THAT(std::string(csv.status.message()), HasSubstr("database: away"));
  EXPECT_THAT(ResultsIn(csv), SizeIs(kExportPage));
}

TEST_F(ExportHandlersTest, AMachineThatIsNotKnownIsToldAsThePlantSays) {
  storage::InspectionRow row = Sample();
  row.machine_id = "m2";
  Put(row);
  const Received qif = Export(v1::EXPORT_FORMAT_QIF);
  EXPECT_EQ(qif.status.code(), absl::StatusCode::kNotFound) << qif.status;
  EXPECT_THAT(std::string(qif.status.message()), HasSubstr("machines/m2@1"));
  EXPECT_THAT(qif.files, IsEmpty());
}

TEST_F(ExportHandlersTest, PointsOfAProfileAreItsMapsPatchesAndOthersAreDataLoss) {
  const auto with_points = [](Request* r) { r->set_deviation_points(true); };
  const std::string map = Put(SampleMap());
  const Received good = Export(v1::EXPORT_FORMAT_QIF, with_points);
  ASSERT_TRUE(good.status.ok()) << good.status;
  EXPECT_THAT(good.content.at("sn1_" + IdIn(map) + ".qif"), HasSubstr("PointSet"));
  storage::DeviationMapRow damaged = SampleMap("sn2");
  damaged.patches.normals_in_part.pop_back();
  const std::string name = Put(damaged);
  const absl::Status status = Export(v1::EXPORT_FORMAT_QIF, with_points).status;
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr(name + ": its patches or regions are not its own"));
  EXPECT_TRUE(Export(v1::EXPORT_FORMAT_QIF).status.ok());     // without them nobody looks
  machines_.meanwhile = [this](const grpc::ServerContext&) {  // when the maps are read, and before their patches are
    deviations_->Fail(absl::ResourceExhaustedError("database: full"));
  };
  EXPECT_EQ(Export(v1::EXPORT_FORMAT_QIF, with_points).status.code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(ExportHandlersTest, NothingIsReadOnForAClientThatIsGone) {
  storage::InspectionRow row = Sample();
  for (int i = 1; i <= kExportPage; ++i) {
    row.machine_revision = i;
    Put(row);
  }
  Put(SampleMap());
  const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  machines_.meanwhile = [&](const grpc::ServerContext& asked) {
    context->TryCancel();
    EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30), [&] { return asked.IsCancelled(); }));
  };
  Request request;
  request.set_format(v1::EXPORT_FORMAT_CSV);
  const auto reader = stub_->ExportResults(context.get(), request);
  for (v1::ExportResultsResponse piece; reader->Read(&piece);) continue;
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30),
                               [] { return testing::Exposed("sixpoint_pool_running{pool=\"exports\"}") == 0; }));
  EXPECT_EQ(machines_.asked_count, 1);
}

}  // namespace
}  // namespace sixpoint::inspection

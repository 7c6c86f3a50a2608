// The service over real gRPC on a real PostgreSQL, between a plant and an ingest that are stood in for.
#include "services/calibration/study_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/record.h"
#include "tests/services/calibration/stand_ins.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::calibration {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class StudyServiceTest : public ::testing::Test {
 protected:
  StudyServiceTest()
      : plant_server_({&plant_}),
        ingest_server_({&ingest_}),
        service_(storage::StudiesIn(database_.database()), storage::CalibrationsIn(database_.database()),
                 plant_server_.Connect(), ingest_server_.Connect()),
        server_({&service_}),
        stub_(v1::StudyService::NewStub(server_.Connect())) {
    ingest_.kind = ingest::v1::SCAN_KIND_ARM;
    testing::RegisterUsual(database_.database());
  }

  template <typename Request>
  absl::StatusOr<v1::Study> Call(grpc::Status (v1::StudyService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                                v1::Study*),
                                 const Request& request) {
    v1::Study study;
    const grpc::Status status = (stub_.get()->*method)(runtime::ContextFor(30).get(), request, &study);
    if (!status.ok()) return runtime::FromGrpc(status);
    return study;
  }

  static v1::RunGaugeRrRequest Wings() {
    const double values[3][4][2] = {{{58.5, 59.5}, {77.8, 80.9}, {84.0, 83.6}, {70.1, 68.3}},
                                    {{69.8, 69.8}, {56.0, 54.5}, {50.7, 49.3}, {63.8, 65.8}},
                                    {{56.6, 57.5}, {77.8, 79.2}, {69.9, 69.2}, {62.1, 64.5}}};
    v1::RunGaugeRrRequest request;
    request.set_outer_name("cage");
    request.set_inner_name("female");
    request.set_unit("um");
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j)
        for (const double value : values[i][j]) {
          v1::Observation* o = request.add_observations();
          o->set_outer(std::to_string(i));
          o->set_inner(std::to_string(j));
          o->set_value(value);
        }
    return request;
  }

  v1::RunGaugeStudyRequest Strip(int count, double sigma_mm) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> noise(0, sigma_mm);
    v1::RunGaugeStudyRequest request;
    for (int s = 0; s < count; ++s) {
      const std::string name = "scans/g" + std::to_string(s);
      metrology::Points& points = ingest_.scans[name].points_mm;
      for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 100; ++j) points.emplace_back(0.1 * i, 0.1 * j, 0.02 * j * 0.1 + noise(random));
      request.add_scans(name);
    }
    return request;
  }

  testing::ThrowawayDatabase database_;
  FakePlant plant_{testing::ArtefactBench::Usual()};
  FakeIngest ingest_;
  testing::InProcessServer plant_server_, ingest_server_;
  StudyService service_;
  testing::InProcessServer server_;
  std::unique_ptr<v1::StudyService::Stub> stub_;
};

TEST_F(StudyServiceTest, AStudyIsStoredWholeAndReadBackToTheSameBits) {
  v1::RunGaugeRrRequest request = Wings();
  request.set_machine("machines/m1");
  request.mutable_environment()->set_temperature_c(20.25);
  request.set_request_id(storage::NewUuid());
  const auto made = Call(&v1::StudyService::Stub::RunGaugeRr, request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->verdict(), v1::STUDY_VERDICT_REPORTED);
  EXPECT_THAT(made->inputs(), ElementsAre("machines/m1@3"));
  EXPECT_NEAR(made->gauge_rr().lines(1).variance(), 94.94, 0.01);
  EXPECT_EQ(made->gauge_rr().confidence(), 0.95);
  EXPECT_EQ(made->environment().temperature_c(), 20.25);
  const auto again = Call(&v1::StudyService::Stub::RunGaugeRr, request);
  EXPECT_EQ(again->SerializeAsString(), made->SerializeAsString());

  v1::GetStudyRequest get;
  get.set_name(made->name());
  const auto found = Call(&v1::StudyService::Stub::GetStudy, get);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->SerializeAsString(), made->SerializeAsString());
  auto transaction = database_.database()->Begin(testing::Soon());
  EXPECT_EQ(transaction->Execute("SELECT count(*) FROM studies")->Int(0, 0), 1);
  EXPECT_FALSE(transaction->Execute("UPDATE studies SET verdict = 'ACCEPTED'").ok());
}

TEST_F(StudyServiceTest, GaugeRrIsJudgedByItsInterval) {
  v1::RunGaugeRrRequest request = Wings();
  request.set_part_level(v1::PART_LEVEL_OUTER);  // the females are the gauge: 95 of 114 of the variance
  request.set_limit_percent(10);
  EXPECT_EQ(Call(&v1::StudyService::Stub::RunGaugeRr, request)->verdict(), v1::STUDY_VERDICT_REJECTED);
  request.set_part_level(v1::PART_LEVEL_INNER);
  request.set_limit_percent(50);  // point estimate 41 %, but three cages say little
  EXPECT_EQ(Call(&v1::StudyService::Stub::RunGaugeRr, request)->verdict(), v1::STUDY_VERDICT_UNDECIDABLE);
  request.mutable_observations(0)->set_value(std::nan(""));
  EXPECT_THAT(std::string(Call(&v1::StudyService::Stub::RunGaugeRr, request).status().message()),
              HasSubstr("observations[0].value"));
}

TEST_F(StudyServiceTest, AGaugeStudyRestsOnItsScans) {
  v1::RunGaugeStudyRequest request = Strip(20, 0.5e-3);
  request.set_limit_um(3);
  for (int i = 0; i < 20; ++i) testing::RecordName(database_.database(), "scan", "scans/g" + std::to_string(i));
  const auto made = Call(&v1::StudyService::Stub::RunGaugeStudy, request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->verdict(), v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_EQ(made->gauge().scan_count(), 20);
  EXPECT_EQ(made->gauge().stations_size(), made->gauge().station_count());
  // Draco adds a uniform rounding of at most 0.25 um.
  EXPECT_NEAR(made->gauge().standard_deviation_um(), 0.5, 0.06);
  auto transaction = database_.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, "scans/g7");
  ASSERT_EQ(derived->size(), 1u);
  EXPECT_EQ(derived->front().entry.name, made->name());

  v1::ListStudiesRequest list;
  list.set_kind(v1::STUDY_KIND_GAUGE);
  list.set_machine("machines/m1");
  v1::ListStudiesResponse page;
  ASSERT_TRUE(stub_->ListStudies(runtime::ContextFor(10).get(), list, &page).ok());
  ASSERT_EQ(page.studies_size(), 1);
  EXPECT_EQ(page.studies(0).gauge().stations_size(), 0);
  list.set_view(list::v1::VIEW_FULL);
  list.set_verdict(v1::STUDY_VERDICT_ACCEPTED);
  ASSERT_TRUE(stub_->ListStudies(runtime::ContextFor(10).get(), list, &page).ok());
  ASSERT_EQ(page.studies_size(), 1);
  EXPECT_EQ(page.studies(0).gauge().stations_size(), made->gauge().station_count());
  list.set_verdict(v1::STUDY_VERDICT_REJECTED);
  ASSERT_TRUE(stub_->ListStudies(runtime::ContextFor(10).get(), list, &page).ok());
  EXPECT_EQ(page.studies_size(), 0);
  list.clear_verdict();
  list.set_kind(v1::STUDY_KIND_ARM);
  ASSERT_TRUE(stub_->ListStudies(runtime::ContextFor(10).get(), list, &page).ok());
  EXPECT_EQ(page.studies_size(), 0);
}

TEST_F(StudyServiceTest, RefusesTooFewScansAndTheWrongKind) {
  const auto message = [](const absl::Status& status) { return std::string(status.message()); };
  EXPECT_THAT(message(Call(&v1::StudyService::Stub::RunGaugeStudy, Strip(9, 1e-3)).status()),
              HasSubstr("scans: 9 scans, want at least 10"));
  v1::RunGaugeStudyRequest gauge = Strip(12, 1e-3);
  gauge.set_scans(3, gauge.scans(2));
  EXPECT_THAT(message(Call(&v1::StudyService::Stub::RunGaugeStudy, gauge).status()), HasSubstr("want each scan once"));
  gauge = Strip(12, 1e-3);
  gauge.set_scans(3, "scans/unknown");
  EXPECT_THAT(message(Call(&v1::StudyService::Stub::RunGaugeStudy, gauge).status()),
              HasSubstr("scans: scans/unknown, want one that the plant knows"));
  ingest_.kind = ingest::v1::SCAN_KIND_ARTEFACT;
  v1::RunArmStudyRequest arm;
  *arm.mutable_scans() = Strip(12, 1e-3).scans();
  EXPECT_THAT(message(Call(&v1::StudyService::Stub::RunArmStudy, arm).status()),
              HasSubstr("scans/g0 of kind SCAN_KIND_ARTEFACT, want scans of kind SCAN_KIND_ARM"));
  ingest_.kind = ingest::v1::SCAN_KIND_AIRFOIL;
  EXPECT_THAT(message(Call(&v1::StudyService::Stub::RunGaugeStudy, Strip(12, 1e-3)).status()), HasSubstr("of kind"));
  v1::RunRepeatStudyRequest repeat;
  for (int i = 0; i < 3; ++i) repeat.add_calibrations("calibrations/" + storage::NewUuid());
  EXPECT_THAT(message(Call(&v1::StudyService::Stub::RunRepeatStudy, repeat).status()),
              HasSubstr("want one that is recorded"));
  auto transaction = database_.database()->Begin(testing::Soon());
  EXPECT_EQ(transaction->Execute("SELECT count(*) FROM studies")->Int(0, 0), 0);
}

TEST_F(StudyServiceTest, ASphereCheckHasAVerdictForEachError) {
  v1::RunSphereCheckRequest request;
  for (int i = 0; i < 30; ++i) {
    const double t = 0.05 * i, f = 2.4 * i;
    runtime::ToProto(12.5 * Eigen::Vector3d(std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t)),
                     request.add_points_mm());
  }
  request.set_diameter_mm(25);
  request.set_size_mpe_um(2);
  request.set_length_mpe_um(2);
  v1::LengthMeasurement* length = request.add_lengths();
  length->set_standard("block-100");
  length->set_calibrated_mm(100);
  length->set_calibrated_standard_uncertainty_um(0.1);
  length->set_measured_mm(100.005);
  const auto made = Call(&v1::StudyService::Stub::RunSphereCheck, request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->sphere_check().errors(0).verdict(), v1::STUDY_VERDICT_REPORTED);  // no MPE of form
  EXPECT_EQ(made->sphere_check().errors(1).verdict(), v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_EQ(made->sphere_check().errors(2).verdict(), v1::STUDY_VERDICT_REJECTED);
  EXPECT_NEAR(made->sphere_check().errors(2).error_um(), 5, 1e-6);
  EXPECT_EQ(made->verdict(), v1::STUDY_VERDICT_REJECTED);
}

// ISO 10360-8: of a scanner form and size of 25 places, dispersion and size of all points, and the form of a flat.
TEST_F(StudyServiceTest, AScannersCheckHasItsOwnErrors) {
  v1::RunSphereCheckRequest request;
  for (int i = 0; i < 4000; ++i) {  // a golden spiral over the cap
    const double z = 1 - 0.5 * (i + 0.5) / 4000, f = 2.399963 * i, across = std::sqrt(1 - z * z);
    const double radius_mm = 12.5 + (i % 2 == 0 ? 1e-3 : -1e-3);
    runtime::ToProto(radius_mm * Eigen::Vector3d(across * std::cos(f), across * std::sin(f), z),
                     request.add_points_mm());
  }
  for (int i = 0; i < 400; ++i)
    runtime::ToProto(Eigen::Vector3d(i % 20, i / 20, (i % 20 + i / 20) % 2 == 0 ? 2e-3 : -2e-3),
                     request.add_plane_points_mm());
  request.set_diameter_mm(25);
  request.set_optical(true);
  request.set_dispersion_mpe_um(5);
  request.set_flat_form_mpe_um(2);
  const auto made = Call(&v1::StudyService::Stub::RunSphereCheck, request);
  ASSERT_TRUE(made.ok()) << made.status();
  const auto& errors = made->sphere_check().errors();
  ASSERT_EQ(errors.size(), 5);
  EXPECT_EQ(errors[2].quantity(), "dispersion");
  EXPECT_NEAR(errors[2].error_um(), 2, 0.05);
  EXPECT_EQ(errors[2].verdict(), v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_EQ(errors[4].quantity(), "flat form");
  EXPECT_NEAR(errors[4].error_um(), 4, 0.05);
  EXPECT_EQ(errors[4].verdict(), v1::STUDY_VERDICT_REJECTED);
  request.mutable_points_mm()->DeleteSubrange(30, request.points_mm_size() - 30);
  const auto few = Call(&v1::StudyService::Stub::RunSphereCheck, request);
  EXPECT_TRUE(absl::IsInvalidArgument(few.status())) << few.status();
}

}  // namespace
}  // namespace sixpoint::calibration

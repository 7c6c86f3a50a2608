// What leaves as files is what the inspections and maps of the pinned block hold, in each format the same.
#include "services/inspection/export_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "exchange/aqdef.h"
#include "exchange/csv.h"
#include "exchange/qif.h"
#include "services/inspection/deviation_service.h"
#include "services/inspection/inspection_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::inspection {
namespace {

using exchange::InspectedPart;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class ExportServiceTest : public ::testing::Test {
 protected:
  ExportServiceTest() {
    for (const std::string& scan : plant_.scans) plant_.registration.registration.add_scans(scan);
  }

  v1::Inspection Inspect() {
    v1::InspectRequest request;
    request.set_blade("blades/sn1");
    for (const std::string& scan : plant_.scans) request.add_scans(scan);
    v1::Inspection inspection;
    const grpc::Status status =
        v1::InspectionService::NewStub(server_.Connect())
            ->Inspect(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &inspection);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return inspection;
  }
  // Of the whole surface: within 20 um of the CAD, and of form alone with other limits.
  v1::DeviationMap Map(v1::ProfileZone zone = v1::PROFILE_ZONE_FORM_AND_LOCATION) {
    v1::MapDeviationRequest request;
    request.set_registration(testing::kRegistration);
    request.set_patch_mm(2);
    const std::tuple<const char*, double, double> profiles[] = {
        {"17", 0.02, 0.1}, {"18", 0.03, 0.1}, {"19", 0.02, 0.99}};
    for (const auto& [characteristic, upper_mm, least_coverage] : profiles) {
      v1::ProfileTolerance& profile = *request.add_profiles();
      profile.set_characteristic(characteristic);
      profile.set_zone(zone);
      profile.set_lower_mm(-0.02);
      profile.set_upper_mm(upper_mm);
      profile.set_least_coverage(least_coverage);
    }
    v1::DeviationMap map;
    const grpc::Status status =
        v1::DeviationService::NewStub(server_.Connect())
            ->MapDeviation(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &map);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return map;
  }
  absl::StatusOr<std::map<std::string, std::string>> Export(v1::ExportResultsRequest request, v1::ExportFormat format) {
    request.set_format(format);
    const auto context = runtime::ContextFor(sixpoint::testing::kPatience * 60);
    const auto stub = v1::ExportService::NewStub(server_.Connect());
    const auto reader = stub->ExportResults(context.get(), request);
    std::map<std::string, std::string> files;
    for (v1::ExportResultsResponse piece; reader->Read(&piece);) files[piece.file()] += piece.content();
    const grpc::Status status = reader->Finish();
    if (!status.ok()) return runtime::FromGrpc(status);
    return files;
  }
  static std::string File(const std::map<std::string, std::string>& files, const std::string& end) {
    for (const auto& [name, content] : files)
      if (name.size() >= end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0) return content;
    ADD_FAILURE() << end << ": no such file";
    return "";
  }
  static std::string Id(const std::string& name) { return name.substr(name.find('/') + 1); }

  testing::JudgedPlant plant_;
  std::shared_ptr<const clients::BladePeers> peers_ = std::make_shared<const clients::BladePeers>(
      plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect());
  InspectionService inspections_{storage::InspectionsIn(plant_.database.database()), peers_, {}};
  DeviationService deviations_{storage::DeviationsIn(plant_.database.database()), peers_, {}};
  ExportService exports_{storage::InspectionsIn(plant_.database.database()),
                         storage::DeviationsIn(plant_.database.database()),
                         storage::AssessmentsIn(plant_.database.database()), peers_};
  testing::InProcessServer server_{{&inspections_, &deviations_, &exports_}};
};

// The hole's own two rows.
void ExpectHole(const v1::HoleResult& hole, const InspectedPart& part, std::size_t at) {
  ASSERT_GE(part.values.size(), at + 2);
  EXPECT_EQ(part.characteristics[at].name, hole.group() + "/" + hole.hole() + "/position");
  EXPECT_EQ(part.characteristics[at + 1].name, hole.group() + "/" + hole.hole() + "/inclination");
  EXPECT_EQ(part.values[at].value, hole.position_error_mm());
  EXPECT_EQ(part.values[at + 1].value, hole.inclination_error_deg());
  EXPECT_DOUBLE_EQ(*part.values[at].expanded_uncertainty, hole.position_expanded_uncertainty_um() / 1e3);
  EXPECT_EQ(part.characteristics[at].upper, hole.position_tolerance_mm());
}

TEST_F(ExportServiceTest, EveryFormatHasTheSameValues) {
  const v1::Inspection inspection = Inspect();
  const v1::DeviationMap map = Map();
  const auto qif = Export({}, v1::EXPORT_FORMAT_QIF);
  ASSERT_TRUE(qif.ok()) << qif.status();
  EXPECT_THAT(*qif, SizeIs(4));  // two results, and the plan of each
  const auto holes = exchange::FromQif(File(*qif, Id(inspection.name()) + ".qif"));
  ASSERT_TRUE(holes.ok()) << holes.status();
  EXPECT_EQ(holes->serial, "sn1");
  EXPECT_EQ(holes->verdict, exchange::Verdict::kNotConform);
  for (int i = 0; i < inspection.holes_size(); ++i)
    ExpectHole(inspection.holes(i), *holes, 2 * static_cast<std::size_t>(i));
  const auto profiles = exchange::FromQif(File(*qif, Id(map.name()) + ".qif"));
  ASSERT_TRUE(profiles.ok()) << profiles.status();
  ASSERT_THAT(profiles->values, SizeIs(3));
  EXPECT_DOUBLE_EQ(*profiles->values[0].worst_positive, map.profiles(0).highest().mean_um() / 1e3);
  EXPECT_DOUBLE_EQ(*profiles->values[0].worst_negative, map.profiles(0).lowest().mean_um() / 1e3);
  EXPECT_EQ(profiles->values[0].verdict, exchange::Verdict::kConform);
  // Seen in part only: no value passes for one.
  EXPECT_EQ(map.profiles(2).verdict(), v1::VERDICT_NOT_MEASURED);
  EXPECT_TRUE(map.profiles(2).has_lowest());
  EXPECT_EQ(profiles->values[2].verdict, exchange::Verdict::kNotMeasured);
  EXPECT_FALSE(profiles->values[2].value.has_value());

  const auto csv = Export({}, v1::EXPORT_FORMAT_CSV);
  ASSERT_TRUE(csv.ok()) << csv.status();
  const auto rows = exchange::FromCsv(File(*csv, "results.csv"));
  ASSERT_TRUE(rows.ok()) << rows.status();
  const auto aqdef = Export({}, v1::EXPORT_FORMAT_AQDEF);
  ASSERT_TRUE(aqdef.ok()) << aqdef.status();
  ASSERT_THAT(*aqdef, SizeIs(2));
  for (const InspectedPart& written : {*holes, *profiles}) {
    const bool of_holes = written.values.size() > 3;
    const auto from_dfq = exchange::FromAqdef(File(*aqdef, Id(of_holes ? inspection.name() : map.name()) + ".dfq"));
    ASSERT_TRUE(from_dfq.ok()) << from_dfq.status();
    ASSERT_THAT(*from_dfq, SizeIs(1));
    const auto row = std::find_if(rows->begin(), rows->end(), [&](const InspectedPart& part) {
      return part.values.size() == written.values.size();
    });
    ASSERT_NE(row, rows->end());
    for (std::size_t i = 0; i < written.values.size(); ++i) {
      EXPECT_EQ(row->values[i].value, written.values[i].value);
      EXPECT_EQ(row->values[i].verdict, written.values[i].verdict);
      EXPECT_EQ(from_dfq->front().values[i].value, written.values[i].value);
      EXPECT_EQ(from_dfq->front().values[i].verdict, written.values[i].verdict);
    }
  }
}

// All numbers that stand in elements of that name, in their order.
std::vector<double> NumbersIn(const std::string& document, const std::string& element) {
  std::vector<double> numbers;
  const std::string open = "<" + element + ">";
  for (std::size_t at = 0; (at = document.find(open, at)) != std::string::npos;) {
    at += open.size();
    std::istringstream text(document.substr(at, document.find('<', at) - at));
    for (double number; text >> number;) numbers.push_back(number);
  }
  return numbers;
}

TEST_F(ExportServiceTest, PointsOfAProfileAreThePatchesInItsZone) {
  for (const v1::ProfileZone zone : {v1::PROFILE_ZONE_FORM_AND_LOCATION, v1::PROFILE_ZONE_FORM}) {
    const v1::DeviationMap map = Map(zone);
    v1::ExportResultsRequest request;
    EXPECT_THAT(File(*Export(request, v1::EXPORT_FORMAT_QIF), Id(map.name()) + ".qif"), Not(HasSubstr("PointSet")));
    request.set_deviation_points(true);
    const auto files = Export(request, v1::EXPORT_FORMAT_QIF);
    ASSERT_TRUE(files.ok()) << files.status();
    const std::string document = File(*files, Id(map.name()) + ".qif");
    EXPECT_TRUE(exchange::FromQif(document).ok());
    // Of both that were measured the points; of the one whose zone lies about the CAD QIF has a place for each deviation.
    const auto patches =
        storage::DeviationsIn(plant_.database.database())->Patches(Id(map.name()), storage::Deadline::max());
    ASSERT_TRUE(patches.ok() && patches->has_value()) << patches.status();
    std::size_t seen = 0;
    for (const double mean_um : (*patches)->means_um) seen += std::isfinite(mean_um);
    ASSERT_GT(seen, 100U);
    const std::vector<double> deviations_mm = NumbersIn(document, "Deviation"),
                              points_mm = NumbersIn(document, "Points"), normals = NumbersIn(document, "Normals");
    ASSERT_EQ(deviations_mm.size(), seen);
    ASSERT_EQ(points_mm.size(), 6 * seen);
    ASSERT_EQ(normals.size(), 6 * seen);
    const auto [least, greatest] = std::minmax_element(deviations_mm.begin(), deviations_mm.end());
    EXPECT_NEAR(*least, map.profiles(0).lowest().mean_um() / 1e3, 1e-9);
    EXPECT_NEAR(*greatest, map.profiles(0).highest().mean_um() / 1e3, 1e-9);
    std::size_t k = 0;
    for (std::size_t i = 0; i < (*patches)->means_um.size(); ++i) {
      if (!std::isfinite((*patches)->means_um[i])) continue;
      if (zone == v1::PROFILE_ZONE_FORM_AND_LOCATION) {
        EXPECT_DOUBLE_EQ(1e3 * deviations_mm[k], (*patches)->means_um[i]);
      }
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(points_mm[3 * k + axis],
                    (*patches)->centres_in_part_mm[3 * i + axis] + deviations_mm[k] * normals[3 * k + axis], 1e-9);
      ++k;
    }
  }
}

TEST_F(ExportServiceTest, FiltersLetThroughWhatWasAskedFor) {
  Inspect();
  const v1::Inspection newest = Inspect();
  v1::ExportResultsRequest request;
  request.set_blade("blades/sn1");
  EXPECT_THAT(*Export(request, v1::EXPORT_FORMAT_QIF), SizeIs(3));
  request.set_only_newest(true);
  const auto one = Export(request, v1::EXPORT_FORMAT_QIF);
  EXPECT_THAT(*one, SizeIs(2));
  File(*one, Id(newest.name()) + ".qif");
  request.set_verdict(v1::VERDICT_CONFORM);
  EXPECT_THAT(*Export(request, v1::EXPORT_FORMAT_QIF), IsEmpty());
  EXPECT_EQ(*Export(request, v1::EXPORT_FORMAT_CSV),
            (std::map<std::string, std::string>{{"results.csv", exchange::CsvHead()}}));
  request.Clear();
  request.set_machine("machines/other");
  EXPECT_THAT(*Export(request, v1::EXPORT_FORMAT_AQDEF), IsEmpty());
}

TEST_F(ExportServiceTest, RefusesWhatItCannotWrite) {
  EXPECT_THAT(std::string(Export({}, v1::EXPORT_FORMAT_UNSPECIFIED).status().message()), HasSubstr("format: "));
  v1::ExportResultsRequest request;
  request.set_deviation_points(true);
  EXPECT_THAT(std::string(Export(request, v1::EXPORT_FORMAT_CSV).status().message()), HasSubstr("deviation_points: "));
  request.set_assessments(true);
  EXPECT_THAT(std::string(Export(request, v1::EXPORT_FORMAT_QIF).status().message()), HasSubstr("deviation_points: "));
  request.Clear();
  request.set_part("machines/m1");
  EXPECT_THAT(std::string(Export(request, v1::EXPORT_FORMAT_CSV).status().message()), HasSubstr("part: machines/m1"));
}

}  // namespace
}  // namespace sixpoint::inspection

// How often an inspection reads a scan: registration's service and inspection's, each on an ingest of its own that counts.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "services/inspection/inspection_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "tests/services/registration/fake_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::inspection {
namespace {

using Eigen::Vector3d;
using registration::v1::Method;

class ReadsTest : public registration::FakePlantTest {
 protected:
  ReadsTest() : registrations_ingest_server_({&registrations_ingest_}) {
    Design(registration::TrueBlade());
    DescribeHoles();
    ScanBent();
  }

  void DescribeHoles() {
    plant::v1::HoleGroup& group = *plant_.plant.part.mutable_hole_groups(0);
    group.set_depth_mm(5);
    group.set_position_tolerance_mm(0.1);
    group.set_inclination_tolerance_deg(1);
    runtime::ToProto(Vector3d(0, 1, 0), group.mutable_axis_in_part());
    for (int i = 0; i < group.holes_size(); ++i) {
      group.mutable_holes(i)->set_hole("H" + std::to_string(i));
      runtime::ToProto(Vector3d(0, 1, 0), group.mutable_holes(i)->mutable_normal_in_part());
    }
  }

  // Everywhere but at its datum points: so an inspection asks for all three positionings.
  void ScanBent() {
    std::vector<Vector3d> places;
    for (const plant::v1::DatumPoint& datum : plant_.plant.part.six_points())
      places.emplace_back(datum.point_in_part_mm().x_mm(), datum.point_in_part_mm().y_mm(),
                          datum.point_in_part_mm().z_mm());
    Scan(registration::TrueBlade(), nullptr, [&](const metrology::SurfacePoint& on) {
      double away = 1;
      for (const Vector3d& place : places) away *= 1 - std::exp(-(on.point_mm - place).squaredNorm() / (2 * 3 * 3));
      return Vector3d(on.point_mm + Vector3d(0, 0.1 * away * (1 + on.point_mm.z() / 20), 0));
    });
    registrations_ingest_.scans = plant_.ingest.scans;
    registrations_ingest_.blocks = plant_.ingest.blocks;
  }

  // Both services anew: nothing was read.
  void ServeBoth(std::size_t kept_bytes) {
    inspections_server_.reset();
    registration::RegistrationLimits limits;
    limits.memory.scan_bytes = kept_bytes;
    Serve(limits, registrations_ingest_server_.Connect());
    inspections_ = std::make_unique<InspectionService>(
        storage::InspectionsIn(plant_.database.database()),
        std::make_unique<clients::BladePeers>(plant_server_.Connect(), plant_.Connect(), plant_.Connect(), channel_),
        InspectionServiceOptions());
    inspections_server_ = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{inspections_.get()});
  }

  v1::Inspection Inspect(Method method) {
    v1::InspectRequest request;
    request.set_blade("blades/sn1");
    for (const std::string& scan : plant_.scans) request.add_scans(scan);
    request.set_method(method);
    v1::Inspection inspection;
    const grpc::Status status =
        v1::InspectionService::NewStub(inspections_server_->Connect())
            ->Inspect(runtime::ContextFor(sixpoint::testing::kPatience * 300).get(), request, &inspection);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return inspection;
  }

  // What was downloaded of the scans since, each equally often.
  static int DownloadsOfEach(const testing::StandInIngest& ingest, std::map<std::string, int>* before) {
    const std::map<std::string, int> now = ingest.downloads();
    int of_each = -1;
    for (const auto& [scan, count] : now) {
      const int since = count - (*before)[scan];
      if (of_each < 0) of_each = since;
      EXPECT_EQ(since, of_each) << scan;
    }
    *before = now;
    return of_each;
  }

  testing::StandInIngest registrations_ingest_;
  testing::InProcessServer registrations_ingest_server_;
  std::map<std::string, int> registrations_before_, inspections_before_;
  std::unique_ptr<InspectionService> inspections_;
  std::unique_ptr<testing::InProcessServer> inspections_server_;
};

// Three registrations of the same scans and the comparison with the CAD: each service downloads each scan once, and the surface once for all.
TEST_F(ReadsTest, EachServiceReadsEachScanOnceHoweverManyPositioningsAreCompared) {
  ServeBoth(std::size_t{128} << 20);
  for (const Method method : {registration::v1::METHOD_SIX_POINT, registration::v1::METHOD_BEST_FIT}) {
    const std::int64_t registrations = Count("registrations");
    const v1::Inspection inspection = Inspect(method);
    EXPECT_TRUE(inspection.positioning().disagrees());
    EXPECT_TRUE(inspection.positioning().covered());
    EXPECT_EQ(Count("registrations"), registrations + 3);
    // The second inspection's scans are still kept from the first.
    const int expected = method == registration::v1::METHOD_SIX_POINT ? 1 : 0;
    EXPECT_EQ(DownloadsOfEach(registrations_ingest_, &registrations_before_), expected);
    EXPECT_EQ(DownloadsOfEach(plant_.ingest, &inspections_before_), 1);
  }
  EXPECT_EQ(blades_.download_count, 2);
}

// An inspection by a best fit reads them for the datum points too, which come after it.
TEST_F(ReadsTest, ABestFitThatIsComparedReadsThemOnce) {
  ServeBoth(std::size_t{128} << 20);
  EXPECT_TRUE(Inspect(registration::v1::METHOD_BEST_FIT).positioning().covered());
  EXPECT_EQ(DownloadsOfEach(registrations_ingest_, &registrations_before_), 1);
}

TEST_F(ReadsTest, WhatIsKeptGivesTheBitsOfWhatIsReadAgain) {
  const auto values = [](v1::Inspection inspection) {
    for (const auto clear :
         {&v1::Inspection::clear_name, &v1::Inspection::clear_registration, &v1::Inspection::clear_recorded_at,
          &v1::Inspection::clear_record_sequence, &v1::Inspection::clear_requested_by})
      (inspection.*clear)();
    return inspection.SerializeAsString();
  };
  for (const Method method : {registration::v1::METHOD_SIX_POINT, registration::v1::METHOD_BEST_FIT,
                              registration::v1::METHOD_SIX_POINT_NORMALS}) {
    ServeBoth(0);
    const v1::Inspection anew = Inspect(method);
    ServeBoth(std::size_t{128} << 20);
    EXPECT_EQ(values(Inspect(method)), values(anew));
    EXPECT_EQ(values(Inspect(method)), values(anew));  // all from what is kept
  }
}

// Points that were deleted meanwhile are gone: nothing is computed from a copy of them.
TEST_F(ReadsTest, NothingIsMadeOfPointsThatWereDeleted) {
  ServeBoth(std::size_t{128} << 20);
  registration::v1::RegisterRequest request = Request(registration::v1::METHOD_BEST_FIT);
  request.set_for_inspection(true);
  ASSERT_TRUE(TryRegister(request).ok());
  ASSERT_TRUE(TryRegister(request).ok());
  EXPECT_EQ(DownloadsOfEach(registrations_ingest_, &registrations_before_), 1);
  registrations_ingest_.deleted.insert(plant_.scans[2]);
  EXPECT_EQ(runtime::ReasonOf(TryRegister(request).status()), "POINTS_DELETED");
}

}  // namespace
}  // namespace sixpoint::inspection

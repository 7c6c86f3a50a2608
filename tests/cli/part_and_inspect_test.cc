// What `sixpoint part add` and `sixpoint inspect` ask of a plant that only remembers it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "tests/cli/command_run.h"
#include "tests/cli/plant_with_inspection.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct PlantThatTakesParts final : PlantWithInspection {
  bool knows_solids = true;
  plant::v1::Part taken;
  grpc::Status CreatePart(grpc::ServerContext*, const plant::v1::CreatePartRequest* in, plant::v1::Part* out) override {
    taken = in->part();
    *out = taken;
    out->set_name("parts/" + in->part_id());
    out->set_revision(1);
    if (!knows_solids) out->clear_solid();
    return grpc::Status::OK;
  }
};

struct Inspections final : inspection::v1::InspectionService::Service {
  std::vector<inspection::v1::InspectRequest> asked;
  grpc::Status Inspect(grpc::ServerContext*, const inspection::v1::InspectRequest* in,
                       inspection::v1::Inspection* out) override {
    asked.push_back(*in);
    out->set_name("inspections/i1");
    out->set_verdict(inspection::v1::VERDICT_CONFORM);
    return grpc::Status::OK;
  }
};

class PartAndInspectTest : public ::testing::Test {
 protected:
  PartAndInspectTest() : server_({&plant_, &inspections_}) {
    plant_.address = server_.address();
    folder_ = std::filesystem::path(::testing::TempDir()) / "sixpoint_part_and_inspect_test";
    std::filesystem::create_directories(folder_);
  }
  ~PartAndInspectTest() override { std::filesystem::remove_all(folder_); }
  Ended Run(const std::string& words) const {
    return RunCommand(words + " --server " + server_.address(),
                      [](Session* session) { session->credentials = grpc::InsecureChannelCredentials(); });
  }
  // Of a STEP file, with those lines more.
  std::string Part(const std::string& more) const {
    std::ofstream(folder_ / "fixture.step") << "ISO-10303-21;\n";
    const std::string file = (folder_ / "part.yaml").string();
    std::ofstream(file) << "id: vane\ncad: fixture.step\ncad_unit: mm\nhole_groups: []\n" + more +
                               "zero_from_part_nominal:\n  - [1, 0, 0, 0]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, "
                               "0, 0, 1]\n";
    return file;
  }

  PlantThatTakesParts plant_;
  Inspections inspections_;
  testing::InProcessServer server_;
  std::filesystem::path folder_;
};

// By the command line before the file, and by neither where none is said.
TEST_F(PartAndInspectTest, SaysWhichSolidOfAnAssemblyIsThePart) {
  Ended ended = Run("part add " + Part("") + " --solid blade");
  ASSERT_EQ(ended.exit_code, kDone) << ended.err;
  EXPECT_EQ(plant_.taken.solid(), "blade");
  EXPECT_THAT(ended.out, HasSubstr("solid    blade"));
  ASSERT_EQ(Run("part add " + Part("solid: clamp\n") + " --solid 2").exit_code, kDone);
  EXPECT_EQ(plant_.taken.solid(), "2");
  ended = Run("part add " + Part("solid: clamp\n"));
  ASSERT_EQ(ended.exit_code, kDone) << ended.err;
  EXPECT_EQ(plant_.taken.solid(), "clamp");
  ASSERT_EQ(Run("part add " + Part("")).exit_code, kDone);
  EXPECT_EQ(plant_.taken.solid(), "");
  EXPECT_NE(Run("part add " + Part("") + " --solid").err, "");
}

// One of an older release takes the whole file for the part: that is no success.
TEST_F(PartAndInspectTest, FailsWhereThePlantDoesNotKnowSolids) {
  plant_.knows_solids = false;
  const Ended ended = Run("part add " + Part("") + " --solid 2");
  EXPECT_NE(ended.exit_code, kDone);
  EXPECT_THAT(ended.err, HasSubstr("parts/vane: the plant took no solid, want a plant of this release"));
  EXPECT_EQ(Run("part add " + Part("")).exit_code, kDone);
}

TEST_F(PartAndInspectTest, AsksAnInspectionWithWhatARegistrationIsAskedWith) {
  const Ended ended =
      Run("inspect --blade SN-1 --scans s1,s2 --method local --in holes:G1:2 --weights 1,0.5 --coarse --axis-tables "
          "--sensor-calibration c1");
  ASSERT_EQ(ended.exit_code, kDone) << ended.err;
  ASSERT_EQ(inspections_.asked.size(), 1u);
  const inspection::v1::InspectRequest& asked = inspections_.asked[0];
  EXPECT_EQ(asked.blade(), "blades/SN-1");
  EXPECT_THAT(asked.scans(), ElementsAre("scans/s1", "scans/s2"));
  EXPECT_EQ(asked.method(), registration::v1::METHOD_LOCAL);
  EXPECT_EQ(asked.options().regions_in(0).hole_group().group(), "G1");
  EXPECT_THAT(asked.options().scan_weights(), ElementsAre(1, 0.5));
  EXPECT_TRUE(asked.options().coarse_start());
  EXPECT_TRUE(asked.apply_axis_tables());
  EXPECT_EQ(asked.sensor_calibration(), "calibrations/c1");
  EXPECT_NE(asked.request_id(), "");
}

TEST_F(PartAndInspectTest, AMachinedBladeIsNoBlank) {
  EXPECT_THAT(Run("inspect --blade SN-1 --scans s1 --method allowance").err, HasSubstr("allowance"));
  EXPECT_THAT(Run("inspect --blade SN-1 --scans s1 --least-stock-mm 0.2").err, HasSubstr("--least-stock-mm"));
  EXPECT_THAT(Run("inspect --blade SN-1 --scans s1 --clamping 7").err, HasSubstr("--clamping"));
  EXPECT_THAT(Run("inspect --blade SN-1").err, HasSubstr("--scans"));
  EXPECT_THAT(Run("inspect --scans s1").err, HasSubstr("--blade"));
  ASSERT_EQ(Run("inspect --blade SN-1 --scans s1").exit_code, kDone);
  ASSERT_EQ(inspections_.asked.size(), 1u);
  EXPECT_EQ(inspections_.asked[0].method(), registration::v1::METHOD_UNSPECIFIED);
  EXPECT_FALSE(inspections_.asked[0].has_options());
}

}  // namespace
}  // namespace sixpoint::cli

#include "simulator/plant_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "metrology/frames/angles.h"
#include "metrology/surface/surface.h"
#include "simulator/plant_scans.h"

namespace sixpoint::simulator {
namespace {

using metrology::kRadPerDeg;

std::set<std::string> AllErrors() { return {kErrorNames.begin(), kErrorNames.end()}; }

std::map<std::string, std::string> FilesOf(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) {
      std::ifstream file(entry.path(), std::ios::binary);
      files[entry.path().lexically_relative(folder)] = std::string(std::istreambuf_iterator<char>(file), {});
    }
  return files;
}

class PlantFilesTest : public ::testing::Test {
 protected:
  PlantFilesTest() { std::filesystem::remove_all(folder_); }
  ~PlantFilesTest() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ = std::filesystem::path(::testing::TempDir()) / "sixpoint-plant-files";
};

TEST_F(PlantFilesTest, TheSameSeedWritesTheSameBytesOnAnyNumberOfThreads) {
  const PlantWorld world = DrawPlant(3, {});
  ASSERT_TRUE(WritePlant(world, folder_ / "one", 1).ok());
  const auto again = WritePlant(DrawPlant(3, {}), folder_ / "two", 2);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_GT(again->point_count, 1'000'000);
  EXPECT_LT(again->point_count, 4'000'000);
  const auto one = FilesOf(folder_ / "one"), two = FilesOf(folder_ / "two");
  ASSERT_EQ(one.size(), static_cast<std::size_t>(again->scan_count) + 3);
  EXPECT_TRUE(one == two);

  // All that the harsher world has is stated, the truth in no part of the data set.
  const nlohmann::json dataset = nlohmann::json::parse(one.at("dataset.json"));
  for (const char* key :
       {"axis_tables", "approach", "touch_common_standard_uncertainty_um", "series", "pin", "sensor_speckle",
        "sensor_field_standard_uncertainty_um", "encoder_latency_standard_uncertainty_um"})
    EXPECT_TRUE(dataset["error_sources"].contains(key)) << key;
  EXPECT_FALSE(dataset.contains("correction"));
  const nlohmann::json truth = nlohmann::json::parse(one.at("truth.json"));
  EXPECT_EQ(truth["drilled_holes"].size(), 18u);
}

TEST(DrawPlant, AnotherSeedIsAnotherPlant) {
  const PlantWorld one = DrawPlant(1, AllErrors()), other = DrawPlant(2, AllErrors());
  EXPECT_GT(std::abs(one.part.airfoil.span_mm - other.part.airfoil.span_mm), 0.01);
  EXPECT_GT((one.truth.t_sm_mm - other.truth.t_sm_mm).norm(), 0.1);
  EXPECT_FALSE(one.zero_from_part.isApprox(other.zero_from_part, 1e-6));
  for (const PlantWorld* world : {&one, &other}) EXPECT_GT(NestConditioning(world->part.six_points), 0.15);
}

// A world without any error: what is read of the blade, taken to the part by the truth, lies on its CAD.
TEST(Stage, WithoutErrorsReadsTheBladeWhereTheTruthHasIt) {
  const PlantWorld world = DrawPlant(2, AllErrors());
  const Stage stage(world);
  const auto surface = metrology::Surface::Prepare(world.part.mesh);
  ASSERT_TRUE(surface.ok()) << surface.status();
  int looked_at = 0;
  for (const PlannedScan& scan : PlanScans(world)) {
    if (scan.kind != "airfoil" || scan.serial != kFinishedSerial) continue;
    const Eigen::Isometry3d machine_from_part =
        world.truth.axes.MachineFromZero(scan.plan.a_deg * kRadPerDeg, scan.plan.b_deg * kRadPerDeg) *
        world.zero_from_part;
    const metrology::Points points_mm = stage.Read(scan, 2);
    for (std::size_t i = 0; i < points_mm.size(); i += 97, ++looked_at) {
      const Eigen::Vector3d p = points_mm[i];
      const Eigen::Vector3d machine = world.truth.machine_from_sensor * Eigen::Vector3d(0, p.y(), p.z()) +
                                      Eigen::Vector3d(p.x(), 0, 0) - scan.plan.v0_mm + world.truth.t_sm_mm;
      // The blade that is scanned lies within 2 um of the CAD's facets, its readings within their step.
      ASSERT_NEAR((*surface)->Closest(machine_from_part.inverse() * machine).signed_distance_mm, 0, 3e-3) << scan.id;
    }
  }
  EXPECT_GT(looked_at, 1000);
}

// And the true corrections stand each group along Z, its starts where the real axes take them.
TEST(TrueCorrections, StandTheGroupAlongZ) {
  const PlantWorld world = DrawPlant(5, {});
  const std::vector<TrueCorrection> corrections = TrueCorrections(world, world.zero_from_part);
  ASSERT_EQ(corrections.size(), 3u);
  for (std::size_t g = 0; g < corrections.size(); ++g) {
    const auto [a_deg, b_deg] = world.Reached_deg(corrections[g].a_deg, corrections[g].b_deg);
    const Eigen::Isometry3d machine_from_part =
        world.truth.axes.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg) * world.zero_from_part;
    const DesignedHoleGroup& group = world.part.hole_groups[g];
    EXPECT_NEAR((machine_from_part.linear() * group.axis - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-9);
    // A part that is warm stands where its pose at 20 C has it, grown about the axis that carries it.
    const Eigen::Vector3d about = world.truth.axes.b.point_mm;
    const Eigen::Vector3d grown =
        about + world.part_seen * (world.ZeroFromPartAt20() * group.holes[0].start_mm - about);
    const Eigen::Vector3d start = world.truth.axes.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg) * grown;
    EXPECT_NEAR((start - corrections[g].starts_mm[0]).norm(), 0, 1e-9);
  }
}

}  // namespace
}  // namespace sixpoint::simulator

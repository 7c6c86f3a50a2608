#include "services/registration/drawn_holes.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "metrology/cad/tessellation.h"
#include "metrology/surface/surface.h"
#include "tests/metrology/cad/foreign_cad.h"

namespace sixpoint::registration {
namespace {

// Of two holes of 1 mm on the flat side one is drawn.
TEST(DrawnHoles, AreCounted) {
  const std::string path = std::filesystem::temp_directory_path() / ("drawn-holes-" + std::to_string(getpid()));
  std::ofstream(path, std::ios::binary) << testing::StepOfBlade({{10}, 0.5});
  auto mesh = metrology::TessellateCad(metrology::CadFormat::kStep, path, {});
  std::filesystem::remove(path);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const auto surface = metrology::Surface::Prepare(*std::move(mesh));
  ASSERT_TRUE(surface.ok()) << surface.status();
  plant::v1::Part part;
  plant::v1::HoleGroup& group = *part.add_hole_groups();
  group.set_diameter_mm(1);
  group.set_depth_mm(6);
  group.mutable_axis_in_part()->set_y(-1);
  for (const double height_mm : {10.0, 20.0}) {
    auto& start = *group.add_holes()->mutable_start_in_part_mm();
    start.set_y_mm(-2.5);
    start.set_z_mm(height_mm);
  }
  EXPECT_EQ(CountDrawnHoles(part, **surface), 1);
  group.mutable_holes()->RemoveLast();
  group.mutable_holes(0)->mutable_start_in_part_mm()->set_z_mm(15);
  EXPECT_EQ(CountDrawnHoles(part, **surface), 0);
}

}  // namespace
}  // namespace sixpoint::registration

// A map's colours lie where its patches do, however large the part's triangles are.
#include "services/inspection/deviation_drawing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "tests/metrology/inspection/pinned_block.h"

namespace sixpoint::inspection {
namespace {

using ::testing::HasSubstr;

double Length(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return std::hypot(double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]);
}

double Area(const std::array<float, 3>& a, const std::array<float, 3>& b, const std::array<float, 3>& c) {
  const double p = Length(a, b), q = Length(b, c), r = Length(c, a), s = (p + q + r) / 2;
  return std::sqrt(std::max(0.0, s * (s - p) * (s - q) * (s - r)));
}

// 30 x 30 x 10 mm of twelve triangles; each patch deviates by its own number, the lower side was not seen.
struct Block {
  std::shared_ptr<const metrology::Surface> surface = *metrology::Surface::Prepare(metrology::BlockMesh());
  metrology::SurfacePatches patches = *metrology::SurfacePatches::Make(*surface, 2);
  std::vector<double> means_um;
  Block() {
    for (const metrology::SurfacePatch& patch : patches.patches())
      means_um.push_back(patch.normal.z() < -0.9 ? std::numeric_limits<double>::quiet_NaN()
                                                 : static_cast<double>(means_um.size()));
  }
};

TEST(DeviationDrawing, EachPatchHasItsAreaInItsColour) {
  const Block block;
  const report::DeviationSurface drawn = DeviationSurfaceOf(*block.surface, block.patches, block.means_um);
  ASSERT_EQ(drawn.deviation_of.size(), drawn.triangles.size());
  ASSERT_EQ(drawn.deviations_um.size(), block.means_um.size() + 1);
  std::map<std::uint32_t, double> area_mm2;
  double unseen_mm2 = 0;
  for (std::size_t t = 0; t < drawn.triangles.size(); ++t) {
    const auto& [i, j, k] = drawn.triangles[t];
    const auto &a = drawn.vertices_mm[i], &b = drawn.vertices_mm[j], &c = drawn.vertices_mm[k];
    EXPECT_LE(std::max({Length(a, b), Length(b, c), Length(c, a)}), 1 + 1e-5);
    area_mm2[drawn.deviation_of[t]] += Area(a, b, c);
    if (std::isnan(drawn.deviations_um[drawn.deviation_of[t]])) unseen_mm2 += Area(a, b, c);
  }
  EXPECT_NEAR(unseen_mm2, 900, 0.01);
  EXPECT_EQ(area_mm2.count(static_cast<std::uint32_t>(block.means_um.size())), 0u);  // all of it lies in a patch
  double all_mm2 = 0;
  for (std::size_t i = 0; i < block.means_um.size(); ++i) {
    const double of_mm2 = area_mm2[static_cast<std::uint32_t>(i)];
    all_mm2 += of_mm2;
    // Triangles of 1 mm stand across a border of 8 mm: at most a quarter of a millimetre of each side is the neighbour's.
    EXPECT_NEAR(of_mm2, block.patches.patches()[i].area_mm2, 2.0) << i;
  }
  EXPECT_NEAR(all_mm2, 3000, 0.01);
}

TEST(DeviationDrawing, RefusesPatchesOfAnotherSurface) {
  const Block block;
  v1::DeviationMap map;
  map.set_name("deviations/d1");
  map.set_patch_mm(2);
  const auto drawn = DrawMap(*block.surface, map, block.means_um);
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  EXPECT_EQ(drawn->views.size(), 6u);  // its top was seen, which no side shows
  std::vector<double> fewer = block.means_um;
  fewer.pop_back();
  const absl::Status damaged = DrawMap(*block.surface, map, fewer).status();
  EXPECT_EQ(damaged.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(damaged.message()), HasSubstr("deviations/d1"));
}

}  // namespace
}  // namespace sixpoint::inspection

#include "cli/moves.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sixpoint::cli {
namespace {

// A turn of 1 mrad about the origin moves the box's far end, 100 mm off, by 0.1 mm.
TEST(GreatestMove, IsThatOfTheBoxRoundThePart) {
  registration::v1::Registration before;
  for (const double r : {1, 0, 0, 0, 1, 0, 0, 0, 1}) before.mutable_zero_from_part()->add_rotation(r);
  before.mutable_zero_from_part()->mutable_translation_mm();
  auto after = before;
  const double c = std::cos(1e-3), s = std::sin(1e-3);
  const double turned[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
  for (int i = 0; i < 9; ++i) after.mutable_zero_from_part()->set_rotation(i, turned[i]);
  geometry::v1::Point low, high;
  high.set_z_mm(100);
  EXPECT_NEAR(*GreatestMove_um(before, after, low, high), 100, 1e-3);
}

}  // namespace
}  // namespace sixpoint::cli

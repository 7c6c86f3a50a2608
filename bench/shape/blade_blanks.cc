#include "bench/shape/blade_blanks.h"

#include <cmath>
#include <fstream>

#include "metrology/cad/tessellation.h"

namespace sixpoint::bench {

using Eigen::Vector3d;
using metrology::RegionKind;
using metrology::ShapeRegion;
using testing::Ramp;

namespace {

// The vane stands along z, its leading edge looking to -x, its trailing edge down y.
constexpr double kLeadingWidth_mm = 11, kTrailingWidth_mm = 14;  // of the edges' regions, along x and y
constexpr double kFaceBox_mm = 0.6;                              // about the end faces, with the walls' rims
constexpr double kPieceHalf_mm = 8, kPieceBeside_mm = 3;         // of the piece that a peer is asked about
const Vector3d kLeading(-1, 0, 0), kTrailing = Vector3d(0.5, -0.866, 0).normalized();

std::vector<ShapeRegion> RegionsOf(const metrology::Surface& vane, double lower_mm, double upper_mm) {
  const Vector3d low_mm = vane.minimum_mm(), high_mm = vane.maximum_mm();
  std::vector<ShapeRegion> regions(5);
  regions[0].name = "tip";
  regions[0].where.minimum_mm = Vector3d(low_mm.x() - 1, low_mm.y() - 1, high_mm.z() - kFaceBox_mm);
  regions[0].where.facing = Vector3d::UnitZ();
  regions[0].where.facing_within_rad = 0.7;
  regions[1].name = "foot";
  regions[1].where.maximum_mm = Vector3d(high_mm.x() + 1, high_mm.y() + 1, low_mm.z() + kFaceBox_mm);
  regions[1].where.facing = -Vector3d::UnitZ();
  regions[1].where.facing_within_rad = 0.7;
  regions[1].kind = RegionKind::kDatum;
  regions[2].name = "leading edge";
  regions[2].where.minimum_mm = low_mm - Vector3d(1, 1, -kFaceBox_mm);
  regions[2].where.maximum_mm = Vector3d(low_mm.x() + kLeadingWidth_mm, high_mm.y() + 1, high_mm.z() + 1);
  regions[3].name = "trailing edge";
  regions[3].where.minimum_mm = regions[2].where.minimum_mm;
  regions[3].where.maximum_mm = Vector3d(high_mm.x() + 1, low_mm.y() + kTrailingWidth_mm, high_mm.z() + 1);
  // The tip's ends are the edges' too.
  for (std::size_t r : {0, 2, 3}) {
    regions[r].lower_mm = lower_mm;
    regions[r].upper_mm = upper_mm;
    regions[r].allowance_mm = 0.02;
  }
  regions[4].name = "body";
  regions[4].rest = true;
  regions[4].kind = RegionKind::kFixed;
  regions[4].lower_mm = -0.6;
  regions[4].upper_mm = 0.6;
  return regions;
}

}  // namespace

std::shared_ptr<const metrology::Surface> LoadVane(const std::string& step_file) {
  if (!std::ifstream(step_file)) return nullptr;
  const auto mesh = metrology::TessellateCad(metrology::CadFormat::kStep, step_file, {1.0, 1'500'000, 4.0});
  if (!mesh.ok()) return nullptr;
  return *metrology::Surface::Prepare(*mesh);
}

metrology::ReconstructionOptions BladeOptions() {
  metrology::ReconstructionOptions options;
  options.coverage_factor = 3;
  options.patch_mm = 0.4;
  options.coarsest_spacing_mm = 4;
  options.finest_spacing_mm = 2;
  options.reach_mm = 2;
  options.blend_mm = 4;
  return options;
}

BladeCase RandomCase(const metrology::Surface& vane, std::uint64_t seed) {
  std::mt19937_64 random(1000 + seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto between = [&](double least, double most) { return least + (most - least) * unit(random); };
  const Vector3d middle = vane.centroid_mm(), low_mm = vane.minimum_mm(), high_mm = vane.maximum_mm();
  const double height_mm = high_mm.z() - low_mm.z();
  const double twist = between(-0.004, 0.004), bend_x_mm = between(-0.15, 0.15), bend_y_mm = between(-0.15, 0.15);
  const double wave_mm = between(0, 0.04), wave_of_mm = between(30, 45), phase = between(0, 6);
  const double dent_mm = between(-0.06, 0.06), dent_wide_mm = between(5, 7);
  const Vector3d dent_at = middle + Vector3d(between(-6, 6), between(-4, 4), between(-8, 8));
  // Half of the cases lack up to what was published, the others anything below.
  const double leading_mm = unit(random) < 0.5 ? between(0.8, 0.969) : between(0, 0.8);
  const double trailing_mm = unit(random) < 0.5 ? between(0.8, 0.969) : between(0, 0.8);
  const double at_z = middle.z() + between(-5, 5), wide_mm = between(11, 15), edge_stock_mm = between(0.1, 0.3);
  const double tip_stock_mm = between(0.3, 0.8);
  BladeCase made;
  made.lacking_mm = std::max(leading_mm, trailing_mm);
  made.piece_low_mm = Vector3d(low_mm.x() - 1, low_mm.y() - 1, at_z - kPieceHalf_mm);
  made.piece_high_mm = Vector3d(high_mm.x() + 1, high_mm.y() + 1, at_z + kPieceHalf_mm);
  if (leading_mm > trailing_mm)
    made.piece_high_mm.x() = low_mm.x() + kLeadingWidth_mm + kPieceBeside_mm;
  else
    made.piece_high_mm.y() = low_mm.y() + kTrailingWidth_mm + kPieceBeside_mm;
  made.blank = [=](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    const double above_mm = x.z() - low_mm.z() - 2, part = above_mm / height_mm;
    const double above = Ramp(above_mm / 12);
    const Vector3d from = x - middle;
    Vector3d moved = above * part * twist * Vector3d(-from.y(), from.x(), 0) +
                     above * part * part * Vector3d(bend_x_mm, bend_y_mm, 0);
    const double wave = wave_mm * std::sin(6.2832 / wave_of_mm * (from.z() + 0.7 * from.x()) + phase) +
                        dent_mm * std::exp(-(x - dent_at).squaredNorm() / (2 * dent_wide_mm * dent_wide_mm));
    // A wave is of walls; the end faces stand across.
    moved += above * wave * Vector3d(normal.x(), normal.y(), 0);
    const double inside = Ramp(above_mm / 10) * Ramp((high_mm.z() - 1 - x.z()) / 10);  // away from both end faces
    const double lacks = std::exp(-std::pow((x.z() - at_z) / wide_mm, 2));
    const double leading = Ramp((low_mm.x() + kLeadingWidth_mm - x.x()) / kLeadingWidth_mm);
    const double trailing = Ramp((low_mm.y() + kTrailingWidth_mm - x.y()) / kTrailingWidth_mm);
    const Vector3d wall(normal.x(), normal.y(), 0);
    moved += leading * inside * (-leading_mm * lacks * kLeading + edge_stock_mm * (1 - lacks) * wall);
    moved += trailing * inside * (-trailing_mm * lacks * kTrailing + edge_stock_mm * (1 - lacks) * wall);
    if (normal.z() > 0.8) moved.z() += tip_stock_mm;
    return x + moved;
  };
  const double lower_mm = between(-1.5, -0.6);
  made.regions = RegionsOf(vane, lower_mm, between(0.8, 1.5));
  return made;
}

}  // namespace sixpoint::bench

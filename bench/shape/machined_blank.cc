#include "bench/shape/machined_blank.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "metrology/milling/removal.h"
#include "metrology/reconstruction/adapt_path.h"
#include "metrology/reconstruction/machined_pass.h"
#include "metrology/sections/outlines.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;
using metrology::Dexel;
using metrology::PassPatch;
using metrology::RegionKind;
using metrology::ToolPoint;

constexpr double kRadius_mm = 3, kLength_mm = 40;
constexpr double kScallop_mm = 0.003;  // between passes
constexpr double kStep_mm = 0.15;      // of the ball's centre: about an edge it goes farther than its contact
constexpr double kContactStep_mm = 0.01;
constexpr double kTilt_rad = 0.5;       // of the axis from the surface towards the tip
constexpr double kClear_mm = 1;         // of both end faces
constexpr double kStrip_mm = 2;         // over which the path goes back to the template
constexpr double kDepth_mm = 0.3;       // below the shape, looked at
constexpr double kPoseNoise_mm = 1e-3;  // of where the blade stands
constexpr double kChatter_mm = 2e-3;    // of a place of the path, one sigma
constexpr double kReach_mm = 0.6;       // of what is learned about a place of the path

// How a mill gives way.
struct Mill {
  double share_at_foot = 0, share_at_tip = 0, off_mm = 0, chatter_mm = 0;
};

// One row of the path: on the outline at a height, as far as it is machined.
using Row = std::vector<ToolPoint>;

bool IsWall(const std::vector<metrology::ShapeRegion>& regions, const Vector3d& place_mm, const Vector3d& normal) {
  return std::abs(normal.z()) < 0.5 && regions[RegionAt(regions, place_mm, normal)].kind == RegionKind::kMachined;
}

// At a seam of the drawing the surface looks two ways: a ball touches, and cuts neither.
Vector3d Touching(const metrology::Surface& vane, Vector3d centre_mm) {
  for (int turn = 0; turn < 60; ++turn) {
    const metrology::SurfacePoint touched = vane.Closest(centre_mm);
    const double deep_mm = kRadius_mm - touched.signed_distance_mm;
    if (deep_mm < 1e-4) break;
    centre_mm += 0.2 * deep_mm * touched.normal;  // by little: of two walls neither is left far
  }
  return centre_mm;
}

// Where the ball has to go far, about a seam, on a way of its own.
void GoOnTo(const ToolPoint& next, const metrology::Surface& vane, Row* row) {
  if (row->empty()) return row->push_back(next);
  const ToolPoint last = row->back();
  const double far_mm = (next.centre_mm - last.centre_mm).norm();
  if (far_mm < kStep_mm) return;
  const int steps = static_cast<int>(std::ceil(far_mm / kStep_mm));
  for (int k = 1; k < steps; ++k) {
    const double part = static_cast<double>(k) / steps;
    row->push_back({Touching(vane, (1 - part) * last.centre_mm + part * next.centre_mm),
                    ((1 - part) * last.axis + part * next.axis).normalized()});
  }
  row->push_back(next);
}

std::vector<Row> RowsOver(const metrology::Surface& vane, const std::vector<metrology::ShapeRegion>& regions) {
  const double low_mm = vane.minimum_mm().z() + kClear_mm, high_mm = vane.maximum_mm().z() - kClear_mm;
  std::vector<Row> rows;
  for (const double z_mm : metrology::PassHeights(low_mm, high_mm, *metrology::StepOverFor(kScallop_mm, kRadius_mm))) {
    metrology::SectionPlane plane;
    plane.origin_mm = {0, 0, z_mm};
    const auto outline = SurfaceOutline(vane, plane, nullptr);
    if (!outline.ok()) continue;
    Row row;
    const metrology::Outline& around = outline->fitted.outline;
    const auto steps = static_cast<int>(around.length_mm() / kContactStep_mm);
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector2d at = around.PointAt(around.PlaceAt(around.length_mm() * i / steps));
      const metrology::SurfacePoint on = vane.Closest(outline->part_from_section * Vector3d(at.x(), at.y(), 0));
      if (IsWall(regions, on.point_mm, on.normal)) {
        const Vector3d up = (Vector3d::UnitZ() - on.normal.z() * on.normal).normalized();
        GoOnTo({Touching(vane, on.point_mm + kRadius_mm * on.normal),
                std::cos(kTilt_rad) * on.normal + std::sin(kTilt_rad) * up},
               vane, &row);
      } else if (!row.empty()) {
        rows.push_back(std::move(row));
        row.clear();
      }
    }
    if (!row.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

// A pass goes around: one that ends goes back the way it came.
void GoBack(metrology::RecontourPass* pass) {
  for (std::size_t i = pass->places.size() - 1; i-- > 1;) pass->places.push_back(pass->places[i]);
}

class Machining {
 public:
  Machining(const metrology::Surface& vane, const metrology::DesignPlaces& design,
            const metrology::DesignPlaces& judged, const BladeCase& blade, const metrology::Reconstruction& made,
            std::uint64_t seed, int threads)
      : vane_(vane),
        design_(design),
        blade_(blade),
        made_(made),
        seed_(seed),
        threads_(threads),
        shape_(testing::MovedSurface(vane, *made.deformation)) {
    const double low_mm = vane.minimum_mm().z() + kClear_mm, high_mm = vane.maximum_mm().z() - kClear_mm;
    for (const testing::BlankPoint& point : testing::BlankPoints(vane, judged.places, blade.blank)) {
      if (point.place_mm.z() < low_mm || point.place_mm.z() > high_mm) continue;
      if (!IsWall(blade.regions, point.place_mm, point.normal)) continue;
      const metrology::SurfacePoint foot = shape_->Closest(point.place_mm + MovedAt(point.place_mm));
      dexels_.push_back({foot.point_mm, foot.normal, shape_->Closest(point.point_mm).signed_distance_mm});
      places_.push_back(point);
    }
  }

  // With it what the template leaves of the design: ridges between its rows, and what a ball does not reach of a hollow seam.
  absl::Status Adapt() {
    const std::vector<Row> rows = RowsOver(vane_, blade_.regions);
    metrology::RecontourPath as_drawn;
    std::vector<Dexel> dexels;
    for (const testing::BlankPoint& place : places_) dexels.push_back({place.place_mm, place.normal, 1});
    for (const Row& row : rows) {
      metrology::RecontourPass& pass = as_drawn.passes.emplace_back();
      for (const ToolPoint& at : row) pass.places.push_back({at.centre_mm, at.axis, at.centre_mm, at.axis, 0});
      GoBack(&pass);
    }
    left_mm_ = Remove(dexels, as_drawn, {kRadius_mm, kLength_mm}, kDepth_mm, threads_).top_mm;
    for (const Row& row : rows) {
      auto adapted = AdaptPath(design_, blade_.regions, *made_.deformation, row, kStrip_mm);
      if (!adapted.ok()) return adapted.status();
      rows_.push_back(*std::move(adapted));
    }
    return absl::OkStatus();
  }

  const std::vector<double>& left_mm() const { return left_mm_; }

  std::vector<double> StockOf() const {
    std::vector<double> stock_mm;
    for (const Dexel& dexel : dexels_) stock_mm.push_back(dexel.top_mm);
    return stock_mm;
  }

  // What stands on the shape after a pass over what stood there. deeper: commanded below the shape; null: nowhere.
  std::vector<double> Cut(const std::vector<double>& stock_mm, const Mill& mill,
                          const metrology::PassCompensation* deeper) const {
    std::vector<Dexel> dexels = dexels_;
    metrology::PlaceGrid grid(kReach_mm);
    for (std::size_t i = 0; i < dexels.size(); ++i) {
      dexels[i].top_mm = stock_mm[i];
      grid.Add(places_[i].place_mm, places_[i].normal);
    }
    std::mt19937_64 random(40 + seed_);
    std::normal_distribution<double> normal(0, 1);
    const double low_mm = vane_.minimum_mm().z(), height_mm = vane_.maximum_mm().z() - low_mm;
    metrology::RecontourPath path;
    for (const auto& row : rows_) {
      metrology::RecontourPass& pass = path.passes.emplace_back();
      for (const metrology::AdaptedToolPoint& at : row) {
        double here_mm = 0, weight = 0;
        grid.EachNear(at.contact_mm, at.normal, 0.5,
                      [&](std::size_t i, const Vector3d&, double) { here_mm += stock_mm[i], ++weight; });
        here_mm = weight > 0 ? std::max(0.0, here_mm / weight) : 0;
        const double moved_mm = MovedAt(at.contact_mm).dot(at.normal);
        const double deeper_mm = deeper == nullptr ? 0 : deeper->At(at.contact_mm, at.normal, moved_mm);
        const double part = (at.contact_mm.z() - low_mm) / height_mm;
        const double share = (1 - part) * mill.share_at_foot + part * mill.share_at_tip;
        // It gives way by a share of what it removes: stock and command less what it leaves.
        const double gives_mm = share * std::max(0.0, here_mm + deeper_mm) / (1 + share);
        const double off_mm = gives_mm - deeper_mm + mill.off_mm + mill.chatter_mm * normal(random);
        const Vector3d out = (at.tool.centre_mm - shape_->Closest(at.tool.centre_mm).point_mm).normalized();
        metrology::ToolPlace& place = pass.places.emplace_back();
        place.contact_mm = at.contact_mm;
        place.normal = out;
        place.centre_mm = at.tool.centre_mm + off_mm * out;
        place.axis = at.tool.axis;
      }
      GoBack(&pass);
    }
    return Remove(dexels, path, {kRadius_mm, kLength_mm}, kDepth_mm, threads_).top_mm;
  }

  // As a scan sees it: where the blade stands is known to a micrometre, each patch's mean to a part of one.
  std::vector<PassPatch> Scanned(const std::vector<double>& stands_mm, const std::vector<double>* before_mm,
                                 std::uint64_t number) const {
    std::mt19937_64 random(seed_ * 16 + number);
    std::normal_distribution<double> normal(0, 1);
    const Vector3d shift = kPoseNoise_mm * Vector3d(normal(random), normal(random), normal(random));
    std::vector<PassPatch> patches;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      PassPatch& patch = patches.emplace_back();
      patch.place_mm = places_[i].place_mm;
      patch.normal = places_[i].normal;
      patch.region = RegionAt(blade_.regions, patch.place_mm, patch.normal);
      patch.rest_mm = stands_mm[i] + shift.dot(dexels_[i].normal) + kPatchNoise_mm * normal(random);
      patch.moved_mm = MovedAt(patch.place_mm).dot(patch.normal);
      patch.standard_uncertainty_mm = kPatchNoise_mm;
      if (before_mm != nullptr) patch.removed_mm = (*before_mm)[i] - patch.rest_mm;
    }
    return patches;
  }

  metrology::PassCompensation Learned(const std::vector<PassPatch>& patches) const {
    const metrology::JudgedPass judged = JudgePass(design_, blade_.regions, patches, {});
    return {blade_.regions, judged.regions, patches, kReach_mm};
  }

 private:
  Vector3d MovedAt(const Vector3d& place_mm) const { return made_.deformation->DisplacementAt(place_mm).value(); }

  const metrology::Surface& vane_;
  const metrology::DesignPlaces& design_;
  const BladeCase& blade_;
  const metrology::Reconstruction& made_;
  const std::uint64_t seed_;
  const int threads_;
  std::shared_ptr<const metrology::Surface> shape_;
  std::vector<Dexel> dexels_;
  std::vector<testing::BlankPoint> places_;
  std::vector<double> left_mm_;  // by the template, of the design
  std::vector<std::vector<metrology::AdaptedToolPoint>> rows_;
};

MachinedRange RangeOf(const std::vector<PassPatch>& patches, const std::vector<double>& left_mm) {
  MachinedRange range;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const double more_um = 1e3 * (patches[i].rest_mm - std::max(0.0, left_mm[i]));
    range.Add({1e3 * patches[i].rest_mm, more_um});
  }
  return range;
}

}  // namespace

absl::StatusOr<MachinedBlank> MachineBlank(const metrology::Surface& vane, const metrology::DesignPlaces& design,
                                           const metrology::DesignPlaces& judged, const BladeCase& blade,
                                           const metrology::Reconstruction& made, std::uint64_t seed, int threads) {
  Machining machining(vane, design, judged, blade, made, seed, threads);
  if (absl::Status adapted = machining.Adapt(); !adapted.ok()) return adapted;
  std::mt19937_64 random(70 + seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const double share = 0.08 + 0.12 * unit(random);
  const Mill soft{0.7 * share, 1.3 * share, 0.02 * unit(random) - 0.01, kChatter_mm};
  const std::vector<double> stock_mm = machining.StockOf();
  const std::vector<double>& left_mm = machining.left_mm();
  MachinedBlank found;
  found.by_template_um = 1e3 * *std::max_element(left_mm.begin(), left_mm.end());
  found.most_removed_mm = *std::max_element(stock_mm.begin(), stock_mm.end());
  found.stiff = RangeOf(machining.Scanned(machining.Cut(stock_mm, {}, nullptr), nullptr, 0), left_mm);
  const std::vector<double> once_mm = machining.Cut(stock_mm, soft, nullptr);
  const std::vector<PassPatch> seen = machining.Scanned(once_mm, &stock_mm, 1);
  found.first = RangeOf(seen, left_mm);
  const metrology::PassCompensation deeper = machining.Learned(seen);
  found.second = RangeOf(machining.Scanned(machining.Cut(once_mm, soft, &deeper), nullptr, 2), left_mm);
  return found;
}

}  // namespace sixpoint::bench

// A blank after it was machined to a reconstruction's shape: what stands above the shape, whether every region is within its profile tolerance,
// and by how much the next pass has to be commanded deeper (docs/methods/reconstruction.md, passes).
//
// Frame: part. Units: mm. Plain data in and out. The same input gives the same bits.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "metrology/reconstruction/design_places.h"
#include "metrology/reconstruction/place_grid.h"
#include "metrology/reconstruction/shape_regions.h"

namespace sixpoint::metrology {

// A patch of the machined surface that has a foot on the shape.
struct PassPatch {
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();  // of the design, whose moved point is the foot
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // of the design there
  std::size_t region = 0;                              // as RegionAt
  double rest_mm = 0;                                  // above the shape; negative: below it
  double moved_mm = 0;                                 // of the shape from the design, along the normal
  double standard_uncertainty_mm = 0;
  std::optional<double> removed_mm;                           // by the pass; unset: nobody saw what was there before
  double deviation_mm() const { return moved_mm + rest_mm; }  // from the design
};

enum class PassOutcome : std::uint8_t {
  kDone,           // every machined and fixed region is within its profile tolerance, its guard included
  kAnotherPass,    // material of a machined region stands higher than it may, or may do so: and nothing is too low
  kScrap,          // proven: too low somewhere, or too high where nothing is cut
  kNotDetermined,  // too little was seen, or the uncertainty reaches beyond a limit that no pass mends
};

struct PassRegion {
  std::size_t patch_count = 0;
  double seen_part = 0;  // of its area
  // Of a machined one: above the shape.
  std::optional<double> mean_rest_mm, least_rest_mm, greatest_rest_mm;
  // Beyond the guard: of the deviation above the lower limit, and below the upper one or the greatest rest. Negative: not within. Unset: a datum, or not seen.
  std::optional<double> least_lower_spare_mm, least_upper_spare_mm;
  // Of a machined one that was cut: what the tool leaves where it removes nothing, and how much of what it removes it leaves besides, because it
  // gives way. Unset: too little was cut.
  std::optional<double> offset_mm, deflection_share;
};

struct PassOptions {
  double coverage_factor = 3;  // of a patch's standard uncertainty: the guard
  double patch_mm = 0.5;       // so far about each patch of it the surface was seen
  double least_seen_part = 0.9;
  std::optional<double> greatest_rest_mm =
      {};  // above the shape, of a machined region, besides its profile tolerance; unset: any
};

struct JudgedPass {
  PassOutcome outcome = PassOutcome::kNotDetermined;
  std::string remark;  // why it is not kDone
  std::vector<PassRegion> regions;
};

JudgedPass JudgePass(const DesignPlaces& design, const std::vector<ShapeRegion>& regions,
                     const std::vector<PassPatch>& patches, const PassOptions& options);

// How much deeper than the shape the next pass is commanded at a place of the design: with c the mean rest about it, offset + share * c, so that what
// the tool leaves when it removes c is nothing. Never so deep, or so shallow, that the command itself leaves the region's profile tolerance. 0 where
// nothing was learned: beyond machined regions, and where no patch is near.
class PassCompensation {
 public:
  PassCompensation(const std::vector<ShapeRegion>& regions, const std::vector<PassRegion>& found,
                   const std::vector<PassPatch>& patches, double reach_mm);
  // moved_mm: of the shape from the design there, along the normal.
  double At(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal, double moved_mm) const;

 private:
  std::vector<ShapeRegion> regions_;
  std::vector<PassRegion> found_;
  std::vector<double> rest_mm_;
  double reach_mm_;
  PlaceGrid grid_;
};

}  // namespace sixpoint::metrology

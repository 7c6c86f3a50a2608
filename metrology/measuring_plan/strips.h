// What the scanner sees of a part at one pair of rotary angles, strip by strip.
//
// Frames and units as in plan_scene.h. Pure and thread-safe; the same inputs give the same bits.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "metrology/measuring_plan/plan_scene.h"
#include "metrology/measuring_plan/surface_samples.h"

namespace sixpoint::metrology {

// A sweep along machine X of no stated length: what it passes is read at what it reads while V0 is 0, and this more. x is 0.
struct Strip {
  RotaryPose pose;
  Eigen::Vector3d shift_mm;
};

// Of the samples, by index.
struct SeenSample {
  std::uint32_t sample = 0;
  float encoder_mm = 0;  // where the sweep passes it, V0 as the strip's shift has it
};

struct StripSight {
  Strip strip;
  std::vector<SeenSample> seen;
  // In the field and not too steep, whether or not something stands before them; seen ones too.
  std::vector<std::uint32_t> faced;
};

class PoseView {
 public:
  // Samples of the scene's surface; both outlive it.
  PoseView(const PlanScene& scene, const std::vector<SurfaceSample>& samples, const RotaryPose& pose);

  // Side by side, and one below the other where the part is deeper than the field, over all that may face the scanner. No more than that many and one:
  // then they are not all.
  std::vector<Strip> StripsOverAll(std::size_t most) const;
  // The one whose middle passes over that place.
  Strip StripOver(const Eigen::Vector3d& point_in_part_mm) const;
  StripSight Look(const Strip& strip) const;

 private:
  struct Facing {
    std::uint32_t sample;
    Eigen::Vector3d reading_mm;  // at V0 0
  };
  bool IsHidden(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& source_mm) const;
  const PlanScene& scene_;
  const std::vector<SurfaceSample>& samples_;
  const RotaryPose pose_;
  const Eigen::Isometry3d machine_from_part_;
  std::vector<Facing> facing_;
};

}  // namespace sixpoint::metrology

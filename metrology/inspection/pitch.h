// From hole to hole of a row: the pitch, as the drawing and the film's cooling know it (docs/methods/inspection.md, pitch).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "metrology/inspection/hole_diameter.h"
#include "metrology/inspection/hole_displacement.h"
#include "metrology/inspection/stated_value.h"

namespace sixpoint::metrology {

// Of a hole and the next one of its group, in the order given.
struct HolePitch {
  std::size_t hole = 0, next = 0;  // among the holes given
  double nominal_mm = 0;           // between the nominal starts
  struct Values {
    // Between the starts, along the nominal line from start to start, and straight. What moves both alike is in neither.
    StatedLength along_row, distance;
    StatedRatio over_nominal_diameter;                  // P/D: along the row, by the mean of both drawn diameters
    std::optional<StatedRatio> over_measured_diameter;  // by the mean of both measured ones, where both are known
  };
  std::optional<Values> values;  // none where either was not measured
  std::string reason;            // why not
};

// What a hole's pitch is made of.
struct PitchEnd {
  Eigen::Vector3d nominal_start_mm = Eigen::Vector3d::Zero();
  double nominal_diameter_mm = 0;
  const MeasuredHole* measured = nullptr;  // null: it was not
  const HoleDiameter* diameter = nullptr;  // null: not known
};
// start_mm etc. of both in one part frame. Values, nominal_mm and reason are set.
HolePitch PitchOf(const PitchEnd& one, const PitchEnd& next);

}  // namespace sixpoint::metrology

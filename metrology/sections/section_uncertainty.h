// A section's parameters with what makes them uncertain: the points' noise, the outline's waver, and the pose that the points came by.
//
// Part and section frames; mm and radians. Draws have fixed seeds: the same bits on any number of threads.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>

#include "metrology/frames/pose.h"
#include "metrology/sections/form_error.h"
#include "metrology/sections/outlines.h"
#include "metrology/sections/profile.h"
#include "metrology/sections/section_parameters.h"

namespace sixpoint::metrology {

struct UncertaintyOptions {
  const Outline* nominal = nullptr;    // what the waver is told from (form_error.h)
  std::optional<PoseCovariance> pose;  // of what brought the points into the part's frame: of part_from_zero
  LeadingHint leading;
  int thread_count = 1;
  double confidence = 0.95;
};

struct ParameterUncertainty {
  double standard = 0, expanded = 0;  // mm, rad, or the parameter's own
  double by_noise = 0, by_form = 0, by_pose = 0;
  Vector6d pose_columns =
      Vector6d::Zero();  // what one standard deviation along each principal direction of the pose does to it
};

struct MeasuredSection {
  Eigen::Isometry3d part_from_section = NotYet<Eigen::Isometry3d>();
  SectionValues values;
  std::array<ParameterUncertainty, kSectionParameterCount> uncertainties;  // of what is set
  FormError form;
  // Only where a nominal outline is given.
  struct Profile {
    ProfileDeviation deviation;
    // Of the least and greatest deviation; waver is what is measured there, and no part of it.
    double location_least_expanded_mm = 0, location_greatest_expanded_mm = 0;
    double form_least_expanded_mm = 0, form_greatest_expanded_mm = 0;
  };
  std::optional<Profile> profile;

  const ParameterUncertainty& uncertainty(SectionParameter p) const {
    return uncertainties[static_cast<std::size_t>(p)];
  }
};

// INVALID_ARGUMENT: a covariance that is not finite, or has a negative variance; confidence outside (0, 1).
absl::StatusOr<MeasuredSection> MeasureSection(const SectionOutline& outline, const UncertaintyOptions& options);

}  // namespace sixpoint::metrology

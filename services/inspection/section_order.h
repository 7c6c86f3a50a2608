// What a section measurement is asked for, checked and as the kernels take it.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/sections/section_plane.h"
#include "sixpoint/inspection/v1/section.pb.h"

namespace sixpoint::inspection {

struct SectionOrder {
  struct Section {
    std::string name;
    metrology::SectionPlane plane;
    Eigen::Isometry3d part_from_section = metrology::NotYet<Eigen::Isometry3d>();
    std::optional<Eigen::Vector3d> leading_mm, near_mm;  // part frame
  };
  struct Neighbour {
    Eigen::Vector3d offset_mm;  // part frame
    double standard_uncertainty_mm = 0;
  };
  std::vector<Section> sections;
  double half_width_mm = 0.1;
  std::size_t reference = 0;  // of twist: place in `sections`
  std::optional<Neighbour> neighbour;
};

// INVALID_ARGUMENT with all that is wrong with it.
absl::StatusOr<SectionOrder> OrderOf(const v1::MeasureSectionsRequest& request);

}  // namespace sixpoint::inspection

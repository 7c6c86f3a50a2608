// The medial axis of a section: the circles that fit into it, the greatest of them, and its two ends.
//
// The ends are where the axis ends, not where the section is longest: on a vane that turns far the farthest place from the trailing edge is
// on its back. Section frame, mm. Thread-safe.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "metrology/sections/outline.h"

namespace sixpoint::metrology {

// Touches the outline at two places and lies inside it.
struct InscribedCircle {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double radius_mm = 0;
  double at_mm = 0, other_at_mm = 0;     // where it touches, along the outline
  Eigen::Vector2d normal, other_normal;  // of the outline there
  double along_mm = 0;  // half the way from contact to contact about the leading end: its place along the camber line
};

enum class EndKind {
  kRound,
  kSquare,   // between two corners or more: a flat trailing edge, a truncated one
  kSharp,    // in one corner
  kNotSeen,  // the camber line leaves the outline through a gap
};

struct SectionEnd {
  EndKind kind = EndKind::kNotSeen;
  Eigen::Vector2d last_mm = Eigen::Vector2d::Zero();   // of the camber line, by circles
  Eigen::Vector2d outward = Eigen::Vector2d::UnitX();  // its direction there
  std::optional<OutlinePlace>
      place;  // where, continued in a straight line, it leaves the outline; in a sharp end its corner
  Eigen::Vector2d tip_mm = Eigen::Vector2d::Zero();  // of the place
};

// Which end leads. By default the one that comes first along the section's reference direction (its x axis).
struct LeadingHint {
  std::optional<Eigen::Vector2d> near_mm;  // the end that is nearer to it
};

struct Camber {
  std::vector<InscribedCircle>
      circles;  // from the leading to the trailing end; contacts' normals more than 110 deg apart
  InscribedCircle greatest;
  SectionEnd leading, trailing;
  double bow_mm =
      0;  // greatest distance of its circles' centres from the line through both ends, positive to the left of leading to trailing
};

// Absent: no circle touches the outline on two sides: too little of it was seen.
std::optional<Camber> CamberOf(const Outline& outline, const LeadingHint& hint);

// Least squares of a parabola through (x, y) near the greatest y: its place and value. What is farther than the reach from the place
// found is left out, and counts the less the farther it is.
struct Peak {
  double x = 0, y = 0;
};
Peak PeakOf(const std::vector<Peak>& points, double reach);

}  // namespace sixpoint::metrology

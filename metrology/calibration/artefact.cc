#include "metrology/calibration/artefact.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <set>

#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

bool Finite(const Points& points) {
  return std::all_of(points.begin(), points.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
}

// Nothing on a bed lies farther from its origin than this.
constexpr double kGreatestCoordinateMm = 1e5;

}  // namespace

double Artefact::ConeDepth() const {
  return (cone_top_radius_mm - cone_bottom_radius_mm) / std::tan(cone_half_angle_rad);
}

absl::Status Validate(const Artefact& a) {
  const auto positive = [](double v) { return std::isfinite(v) && v > 0 && v < 1e4; };
  if (!positive(a.side_mm)) return Refuse("artefact.side_mm", Rounded(a.side_mm), "> 0");
  if (!positive(a.cone_half_angle_rad) || a.cone_half_angle_rad > 1.4)
    return Refuse("artefact.cone_half_angle_deg", Rounded(a.cone_half_angle_rad * kDegPerRad), "between 0 and 80");
  if (!positive(a.cone_bottom_radius_mm))
    return Refuse("artefact.cone_bottom_radius_mm", Rounded(a.cone_bottom_radius_mm), "> 0");
  if (!positive(a.cone_top_radius_mm) || a.cone_top_radius_mm - a.cone_bottom_radius_mm < 0.3)
    return Refuse("artefact.cone_top_radius_mm", Rounded(a.cone_top_radius_mm),
                  "at least 0.3 mm more than cone_bottom_radius_mm");
  if (a.cones.size() < 3 || a.cones.size() > 16)
    return Refuse("artefact.cones", std::to_string(a.cones.size()) + " of them", "3 to 16");
  if (a.slots.size() > 16) return Refuse("artefact.slots", std::to_string(a.slots.size()) + " of them", "at most 16");
  if (!a.slots.empty() && (!positive(a.slot_width_mm) || a.slot_width_mm < 0.6))
    return Refuse("artefact.slot_width_mm", Rounded(a.slot_width_mm), ">= 0.6");
  if (!a.slots.empty() && (!positive(a.slot_depth_mm) || a.slot_depth_mm < 0.2))
    return Refuse("artefact.slot_depth_mm", Rounded(a.slot_depth_mm), ">= 0.2");

  struct Disc {
    std::string name;
    Eigen::Vector2d centre;
    double radius;
  };
  std::vector<Disc> discs;
  for (const PlaneFeature& c : a.cones) discs.push_back({c.name, c.centre_mm, a.cone_top_radius_mm});
  for (const PlaneFeature& q : a.slots) discs.push_back({q.name, q.centre_mm, a.slot_width_mm / 2});
  std::set<std::string> names;
  for (size_t i = 0; i < discs.size(); ++i) {
    const Disc& d = discs[i];
    const std::string field = "artefact.features[" + d.name + "]";
    if (d.name.empty() || !names.insert(d.name).second) return Refuse(field, "'" + d.name + "'", "a name of its own");
    if (!d.centre.allFinite() || d.centre.cwiseAbs().maxCoeff() + d.radius > a.side_mm / 2)
      return Refuse(field, Rounded(d.centre.x()) + ", " + Rounded(d.centre.y()), "a place on the plate");
    for (size_t j = 0; j < i; ++j)
      if ((d.centre - discs[j].centre).norm() < d.radius + discs[j].radius + 0.2)
        return Refuse(field, "overlaps " + discs[j].name, "0.2 mm of upper face between two features");
  }
  // Twice the area of the best triangle, against the length of its longest side.
  double area = 0, reach = 0;
  for (size_t i = 0; i < a.cones.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const Eigen::Vector2d u = a.cones[i].centre_mm - a.cones[j].centre_mm;
      reach = std::max(reach, u.norm());
      for (size_t k = 0; k < j; ++k) {
        const Eigen::Vector2d v = a.cones[k].centre_mm - a.cones[j].centre_mm;
        area = std::max(area, std::abs(u.x() * v.y() - u.y() * v.x()));
      }
    }
  if (area < 0.05 * reach * reach)
    return Refuse("artefact.cones", "collinear",
                  "three cones that span the plate: collinear ones leave the turn about "
                  "their line undetermined");
  return absl::OkStatus();
}

const Eigen::Vector3d* TouchedCentre(const ArtefactTouch& touch, const std::string& name) {
  for (const TouchedPoint& t : touch.centres)
    if (t.name == name) return &t.point_mm;
  return nullptr;
}

absl::Status CheckTouch(const Artefact& artefact, const ArtefactTouch& touch) {
  if (!(std::isfinite(touch.standard_uncertainty_mm) && touch.standard_uncertainty_mm >= 0 &&
        touch.standard_uncertainty_mm <= 0.1))
    return Refuse("touch.standard_uncertainty_um", Rounded(1e3 * touch.standard_uncertainty_mm),
                  "0 (not stated) to 100");
  std::set<std::string> names;
  for (const TouchedPoint& t : touch.centres) {
    const std::string field = "touch.centres[" + t.name + "]";
    if (!names.insert(t.name).second) return Refuse(field, "given twice", "one centre a feature");
    if (!t.point_mm.allFinite() || t.point_mm.cwiseAbs().maxCoeff() > kGreatestCoordinateMm)
      return Refuse(field, "not finite or off the machine", "machine coordinates in mm");
  }
  for (const auto& [field, points] : {std::pair<const char*, const Points*>{"touch.plane_mm", &touch.plane_mm},
                                      {"touch.side_x_mm", &touch.side_x_mm},
                                      {"touch.side_y_mm", &touch.side_y_mm}})
    if (!Finite(*points)) return Refuse(field, "not finite", "machine coordinates in mm");

  std::vector<double> ratios;
  double worst_mm = 0;
  for (size_t i = 0; i < artefact.cones.size(); ++i) {
    const Eigen::Vector3d* p = TouchedCentre(touch, artefact.cones[i].name);
    if (p == nullptr)
      return Refuse("touch.centres", "no " + artefact.cones[i].name, "the centre of every cone: probe it and send it");
    for (size_t j = 0; j < i; ++j) {
      const double nominal = (artefact.cones[i].centre_mm - artefact.cones[j].centre_mm).norm();
      const double found = (*p - *TouchedCentre(touch, artefact.cones[j].name)).norm();
      ratios.push_back(found / nominal);
      worst_mm = std::max(worst_mm, std::abs(found - nominal));
    }
  }
  constexpr double kWorstDistanceMm = 0.1;
  if (worst_mm <= kWorstDistanceMm) return absl::OkStatus();
  std::sort(ratios.begin(), ratios.end());
  const double ratio = ratios[ratios.size() / 2];
  std::string wanted = "the distances of the artefact's record within " + Rounded(kWorstDistanceMm) + " mm";
  for (const double inch : {25.4, 1 / 25.4})
    if (std::abs(ratio / inch - 1) < 0.05)
      wanted += "; they differ by a factor of " + Rounded(ratio) + ": send millimetres, these look like other units";
  return Refuse("touch.centres", "distances between cones off by up to " + Rounded(worst_mm) + " mm", wanted);
}

Eigen::Isometry3d RigidFit(const Points& from, const Points& onto) {
  Eigen::Vector3d from_mean = Eigen::Vector3d::Zero(), onto_mean = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < from.size(); ++i) {
    from_mean += from[i];
    onto_mean += onto[i];
  }
  from_mean /= static_cast<double>(from.size());
  onto_mean /= static_cast<double>(from.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < from.size(); ++i) spread += (onto[i] - onto_mean) * (from[i] - from_mean).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(spread, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  result.translation() = onto_mean - result.linear() * from_mean;
  return result;
}

Eigen::Isometry3d MachineFromArtefactByCones(const Artefact& artefact, const ArtefactTouch& touch) {
  Points from, onto;
  for (const PlaneFeature& cone : artefact.cones) {
    from.emplace_back(cone.centre_mm.x(), cone.centre_mm.y(), 0);
    onto.push_back(*TouchedCentre(touch, cone.name));
  }
  return RigidFit(from, onto);
}

}  // namespace sixpoint::metrology

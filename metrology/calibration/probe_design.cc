#include "metrology/calibration/probe_design.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "metrology/frames/angles.h"
#include "metrology/linear_algebra/singular_values.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kFarthestMm = 1e5;
constexpr std::size_t kMostProbedFaces = 24;
constexpr std::size_t kMostReadings = 5000;
constexpr std::size_t kFewestReadings = 6;

bool OnMachine(const Eigen::Vector3d& p) { return p.allFinite() && p.cwiseAbs().maxCoeff() < kFarthestMm; }

std::string Vector(const Eigen::Vector3d& v) {
  // The sign of an undetermined direction says nothing: the greatest component is shown positive.
  Eigen::Index greatest;
  v.cwiseAbs().maxCoeff(&greatest);
  Eigen::Vector3d shown = v(greatest) < 0 ? Eigen::Vector3d(-v) : v;
  for (double& x : shown) x = std::round(1e3 * x) / 1e3 + 0.0;
  return "(" + Rounded(shown.x()) + ", " + Rounded(shown.y()) + ", " + Rounded(shown.z()) + ")";
}
std::string Joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

absl::Status CheckOptions(const ProbeOptions& options) {
  constexpr double kLeastMm = 1e-6, kMostMm = 1;
  const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
  const auto um = [](double value_mm) { return Rounded(1e3 * value_mm); };
  if (!within(options.noise_mm, kLeastMm, kMostMm)) return Refuse("noise_um", um(options.noise_mm), "0.001 to 1000");
  if (!within(options.touch_uncertainty_mm, kLeastMm, kMostMm))
    return Refuse("touch_standard_uncertainty_um", um(options.touch_uncertainty_mm), "0.001 to 1000");
  if (!within(options.position_uncertainty_mm, 0, kMostMm))
    return Refuse("position_standard_uncertainty_um", um(options.position_uncertainty_mm), "0 to 1000");
  if (!std::isfinite(options.least_displacement_mm) || std::abs(options.least_displacement_mm) > kFarthestMm)
    return Refuse("least_displacement_mm", Rounded(options.least_displacement_mm), "a finite length");
  if (!(options.greatest_displacement_mm >= options.least_displacement_mm + 0.01) ||
      options.greatest_displacement_mm > kFarthestMm)
    return Refuse("greatest_displacement_mm", Rounded(options.greatest_displacement_mm),
                  "at least 0.01 mm more than least_displacement_mm");
  if (!within(options.greatest_approach_angle_rad, kPi / 180, kPi / 2))
    return Refuse("greatest_approach_angle_deg", Rounded(options.greatest_approach_angle_rad * kDegPerRad), "1 to 90");
  return absl::OkStatus();
}

absl::Status CheckFaces(const std::vector<ProbedFace>& faces, std::map<std::string, int>* index_of) {
  if (faces.empty() || faces.size() > kMostProbedFaces)
    return Refuse("faces", std::to_string(faces.size()) + " of them", "1 to 24");
  for (std::size_t j = 0; j < faces.size(); ++j) {
    const std::string field = "faces[" + std::to_string(j) + "]";
    if (!index_of->emplace(faces[j].face, static_cast<int>(j)).second)
      return Refuse(field + ".face", faces[j].face, "each face once");
    if (!(std::abs(faces[j].nominal_normal.norm() - 1) < 1e-3))
      return Refuse(field + ".nominal_normal", "length " + Rounded(faces[j].nominal_normal.norm()),
                    "a direction of length 1");
    for (std::size_t k = 0; k < faces[j].touched_mm.size(); ++k)
      if (!OnMachine(faces[j].touched_mm[k]))
        return Refuse(field + ".touched_mm[" + std::to_string(k) + "]", "not finite or off the machine",
                      "mm in machine coordinates");
    constexpr std::size_t kFewestTouched = 3;
    constexpr double kLeastSpreadMm = 0.1;
    if (faces[j].touched_mm.size() < kFewestTouched)
      return Refuse(field + ".touched_mm", std::to_string(faces[j].touched_mm.size()) + " points",
                    "at least 3, not on one line");
    if (const double spread = FitFace(faces[j].touched_mm).spread_mm; !(spread > kLeastSpreadMm))
      return Refuse(field + ".touched_mm", "points that spread " + Rounded(spread) + " mm about a line",
                    "more than 0.1 mm: touch the face over its whole area");
  }
  return absl::OkStatus();
}

// The paper's rules in the order in which a person can cure them.
absl::Status CheckSpan(const std::vector<ProbedFace>& faces, const ProbeDesign& design) {
  std::vector<std::string> names;
  std::vector<int> read;
  for (std::size_t j = 0; j < faces.size(); ++j)
    if (std::count(design.face_of.begin(), design.face_of.end(), static_cast<int>(j)) > 0) {
      names.push_back(faces[j].face);
      read.push_back(static_cast<int>(j));
    }
  Eigen::MatrixXd normals(static_cast<Eigen::Index>(read.size()), 3);
  for (std::size_t j = 0; j < read.size(); ++j)
    normals.row(static_cast<Eigen::Index>(j)) = design.faces[read[j]].normal.transpose();
  const SingularValueDecomposition svd = DecomposeSingular(normals);
  constexpr double kLeastLean = 0.05;  // about 3 deg out of the plane of the others
  const bool spans = svd.values.size() == 3 && svd.values(2) > kLeastLean;
  if (!spans) {
    const std::string missing = Vector(svd.right.col(2));
    if (read.size() == 1)
      return absl::FailedPreconditionError("approach and offset across the normal of " + names[0] +
                                           " are not determined: readings on one face only; measure at least three "
                                           "faces whose normals span space");
    return absl::FailedPreconditionError("approach and offset along " + missing +
                                         " are not determined: the normals of " + Joined(names) +
                                         " lie in a plane; measure a face that leans towards " + missing);
  }
  return absl::OkStatus();
}

absl::Status CheckDisplacements(const std::vector<ProbedFace>& faces, const std::vector<ProbeReading>& readings,
                                ProbeDesign* design) {
  const auto [singular, left, right] = DecomposeSingular(design->matrix);
  design->condition_number = singular(0) / singular(5);
  constexpr double kWorstProbeCondition = 200;
  if (design->condition_number < kWorstProbeCondition) return absl::OkStatus();
  const Eigen::Matrix<double, 6, 1> weakest = right.col(5);
  const bool approach = weakest.head<3>().norm() >= weakest.tail<3>().norm();
  const Eigen::Vector3d along = approach ? weakest.head<3>().normalized() : weakest.tail<3>().normalized();
  // The face whose displacements span least carries the direction that is missing.
  std::string flattest;
  double least_span = 1e9;
  for (std::size_t j = 0; j < faces.size(); ++j) {
    double low = 1e9, high = -1e9;
    for (std::size_t i = 0; i < readings.size(); ++i)
      if (design->face_of[i] == static_cast<int>(j)) {
        low = std::min(low, readings[i].displacement_mm);
        high = std::max(high, readings[i].displacement_mm);
      }
    if (high >= low && high - low < least_span) {
      least_span = high - low;
      flattest = faces[j].face;
    }
  }
  return absl::FailedPreconditionError(
      std::string(approach ? "approach" : "offset") + " along " + Vector(along) +
      " is not determined: condition number " +
      (std::isfinite(design->condition_number) ? Rounded(design->condition_number) : "infinite") + ", want below " +
      Rounded(kWorstProbeCondition) + "; face " + flattest + " was measured over " + Rounded(least_span) +
      " mm of displacement, measure it at least twice, " + Rounded(0.2 * design->half_mm) + " mm apart or more");
}

}  // namespace

FittedFace FitFace(const std::vector<Eigen::Vector3d>& points_mm) {
  FittedFace fit;
  const double count = static_cast<double>(points_mm.size());
  for (const Eigen::Vector3d& p : points_mm) fit.centre_mm += p / count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points_mm) scatter += (p - fit.centre_mm) * (p - fit.centre_mm).transpose() / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  fit.normal = eigen.eigenvectors().col(0);
  fit.across = eigen.eigenvectors().rightCols<2>();
  fit.spread_mm = std::sqrt(std::max(0.0, eigen.eigenvalues()(1)));
  return fit;
}

Matrix6d ProbeDesign::ParametersFromDesign() const {
  Matrix6d m = Matrix6d::Identity();
  m.topLeftCorner<3, 3>() /= half_mm;
  m.bottomLeftCorner<3, 3>() = -mid_mm / half_mm * Eigen::Matrix3d::Identity();
  return m;
}

absl::Status CheckProbed(const std::vector<ProbedFace>& faces, const std::vector<ProbeReading>& readings,
                         const ProbeOptions& options, std::vector<int>* face_of) {
  if (absl::Status s = CheckOptions(options); !s.ok()) return s;
  std::map<std::string, int> index_of;
  if (absl::Status s = CheckFaces(faces, &index_of); !s.ok()) return s;
  if (readings.size() > kMostReadings)
    return Refuse("readings", std::to_string(readings.size()) + " of them", "at most 5000");
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const std::string field = "readings[" + std::to_string(i) + "]";
    const auto face = index_of.find(readings[i].face);
    if (face == index_of.end())
      return Refuse(field + ".face", readings[i].face, "a face of the block that was touched");
    face_of->push_back(face->second);
    if (!OnMachine(readings[i].position_mm))
      return Refuse(field + ".position_mm", "not finite or off the machine", "mm in machine coordinates");
    const double displacement = readings[i].displacement_mm;
    if (!(displacement >= options.least_displacement_mm && displacement <= options.greatest_displacement_mm))
      return Refuse(field + ".displacement_mm", Rounded(displacement),
                    Rounded(options.least_displacement_mm) + " to " + Rounded(options.greatest_displacement_mm) +
                        ", the probe's range");
  }
  return absl::OkStatus();
}

absl::StatusOr<ProbeDesign> DesignOf(const std::vector<ProbedFace>& faces, const std::vector<ProbeReading>& readings,
                                     const ProbeOptions& options) {
  ProbeDesign design;
  if (absl::Status s = CheckProbed(faces, readings, options, &design.face_of); !s.ok()) return s;
  if (readings.size() < kFewestReadings)
    return absl::FailedPreconditionError(
        "approach and offset are not determined: " + std::to_string(readings.size()) +
        " readings, want at least 6: two on each of three faces, at displacements that "
        "differ");
  design.mid_mm = (options.greatest_displacement_mm + options.least_displacement_mm) / 2;
  design.half_mm = (options.greatest_displacement_mm - options.least_displacement_mm) / 2;
  for (const ProbedFace& face : faces) design.faces.push_back(FitFace(face.touched_mm));
  const Eigen::Index rows = static_cast<Eigen::Index>(readings.size());
  design.matrix.resize(rows, 6);
  design.right.resize(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const FittedFace& face = design.faces[design.face_of[i]];
    design.matrix.row(i).head<3>() = design.Scaled(readings[i].displacement_mm) * face.normal.transpose();
    design.matrix.row(i).tail<3>() = face.normal.transpose();
    design.right(i) = face.normal.dot(face.centre_mm - readings[i].position_mm);
  }
  if (absl::Status s = CheckSpan(faces, design); !s.ok()) return s;
  if (absl::Status s = CheckDisplacements(faces, readings, &design); !s.ok()) return s;
  return design;
}

}  // namespace sixpoint::metrology

#include "metrology/calibration/probe_calibration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "metrology/calibration/probe_design.h"
#include "metrology/frames/angles.h"
#include "metrology/linear_algebra/least_squares.h"
#include "metrology/linear_algebra/pseudo_inverse.h"
#include "metrology/linear_algebra/singular_values.h"
#include "metrology/linear_algebra/symmetric.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

// The design's parameters: (half a, t + mid a).
struct ScaledProbe {
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();

  // gamma' at which the beam from `position` meets the face.
  double Meets(const FittedFace& face, const Eigen::Vector3d& position_mm) const {
    return face.normal.dot(face.centre_mm - position_mm - middle) / face.normal.dot(along);
  }
};

ScaledProbe SolveLinearly(const ProbeDesign& design) {
  const Eigen::VectorXd h = LeastSquares(design.matrix, design.right);
  return {h.head<3>(), h.tail<3>()};
}

std::string At(const char* list, std::size_t i) { return std::string(list) + "[" + std::to_string(i) + "]"; }

absl::Status CheckScale(const ScaledProbe& probe, const ProbeDesign& design) {
  constexpr double kLeastScale = 0.9, kGreatestScale = 1.1;
  const double scale = probe.along.norm() / design.half_mm;
  if (scale >= kLeastScale && scale <= kGreatestScale) return absl::OkStatus();
  return Refuse("readings.displacement_mm", Rounded(scale) + " mm along the beam for each mm read",
                "0.9 to 1.1: are displacements, positions and touched points in mm, not inch, of this block, and each "
                "of the face named?");
}

// The faces' normals outward, and the angles between them those of the drawing.
absl::Status OrientFaces(const std::vector<ProbedFace>& given, const ScaledProbe& probe, ProbeDesign* design) {
  std::vector<bool> read(given.size(), false);
  for (const int j : design->face_of) read[j] = true;
  for (FittedFace& face : design->faces)
    if (face.normal.dot(probe.along) > 0) face.normal = -face.normal;
  constexpr double kWorstAngle = 0.5 * kRadPerDeg;
  const auto between = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b));
  };
  for (std::size_t j = 0; j < given.size(); ++j)
    for (std::size_t k = 0; k < j; ++k) {
      if (!read[j] || !read[k]) continue;
      const double touched = between(design->faces[j].normal, design->faces[k].normal);
      const double drawn = between(given[j].nominal_normal, given[k].nominal_normal);
      if (std::abs(touched - drawn) > kWorstAngle)
        return absl::FailedPreconditionError("faces " + given[k].face + " and " + given[j].face +
                                             " were touched at normals " + Rounded(touched / kRadPerDeg) +
                                             " deg apart, want " + Rounded(drawn / kRadPerDeg) +
                                             " deg within 0.5 deg: another block, or faces mixed up");
    }
  return absl::OkStatus();
}

// Standard uncertainty of one displacement, in mm of displacement: its own noise and the position's along the beam.
double ReadingSigma(const FittedFace& face, const ScaledProbe& probe, const ProbeDesign& design,
                    const ProbeOptions& options) {
  return std::hypot(options.noise_mm, options.position_uncertainty_mm * design.half_mm / face.normal.dot(probe.along));
}

// The weighted problem at its current state. Parameters: probe (6), then (two tilts by lever, offset) of each face read.
struct WeightedFit {
  const std::vector<ProbedFace>& given;
  const std::vector<ProbeReading>& readings;
  const ProbeOptions& options;
  ProbeDesign* design;
  ScaledProbe probe;
  std::vector<int> column_of{};  // of each face; -1: not read
  Eigen::Index columns = 6, rows = 0;
  Eigen::MatrixXd jacobian{};
  Eigen::VectorXd residual{};

  void Lay() {
    column_of.assign(given.size(), -1);
    rows = static_cast<Eigen::Index>(readings.size());
    for (const int j : design->face_of)
      if (column_of[j] < 0) column_of[j] = 0;
    for (std::size_t j = 0; j < given.size(); ++j)
      if (column_of[j] == 0) {
        column_of[j] = static_cast<int>(columns);
        columns += 3;
        rows += static_cast<Eigen::Index>(given[j].touched_mm.size());
      }
  }

  // Observed minus expected, and its expected's derivative, both over the standard uncertainty.
  void Linearise() {
    jacobian.setZero(rows, columns);
    residual.setZero(rows);
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const FittedFace& face = design->faces[design->face_of[i]];
      const Eigen::Index row = static_cast<Eigen::Index>(i);
      const double expected = probe.Meets(face, readings[i].position_mm);
      const double weight = design->half_mm / ReadingSigma(face, probe, *design, options);
      const double slope = weight / face.normal.dot(probe.along);
      jacobian.row(row).head<3>() = -slope * expected * face.normal.transpose();
      jacobian.row(row).segment<3>(3) = -slope * face.normal.transpose();
      const Eigen::Vector3d lever = face.centre_mm - readings[i].position_mm - probe.middle - expected * probe.along;
      const int column = column_of[design->face_of[i]];
      jacobian.row(row).segment<2>(column) = slope / face.spread_mm * (face.across.transpose() * lever).transpose();
      jacobian(row, column + 2) = slope;
      residual(row) = weight * (design->Scaled(readings[i].displacement_mm) - expected);
    }
    Eigen::Index row = static_cast<Eigen::Index>(readings.size());
    for (std::size_t j = 0; j < given.size(); ++j) {
      if (column_of[j] < 0) continue;
      const FittedFace& face = design->faces[j];
      const double weight = 1 / options.touch_uncertainty_mm;
      for (const Eigen::Vector3d& p : given[j].touched_mm) {
        const Eigen::Vector3d lever = p - face.centre_mm;
        // Observed: 0, the distance of a touched point from its face.
        jacobian.row(row).segment<2>(column_of[j]) =
            weight / face.spread_mm * (face.across.transpose() * lever).transpose();
        jacobian(row, column_of[j] + 2) = -weight;
        residual(row++) = -weight * face.normal.dot(lever);
      }
    }
  }

  void Move(const Eigen::VectorXd& step) {
    probe.along += step.head<3>();
    probe.middle += step.segment<3>(3);
    for (std::size_t j = 0; j < given.size(); ++j) {
      if (column_of[j] < 0) continue;
      FittedFace& face = design->faces[j];
      const Eigen::Vector3d s = step.segment<3>(column_of[j]);
      face.centre_mm += s(2) * face.normal;
      face.normal = (face.normal + face.across * s.head<2>() / face.spread_mm).normalized();
      face.across.col(0) = (face.across.col(0) - face.normal * face.normal.dot(face.across.col(0))).normalized();
      face.across.col(1) = face.normal.cross(face.across.col(0));
    }
  }
};

// What both solutions report, from design parameters and their covariance.
void Describe(const std::vector<ProbedFace>& given, const std::vector<ProbeReading>& readings,
              const ProbeDesign& design, const ScaledProbe& probe, const Matrix6d& design_covariance,
              ProbeCalibration* out) {
  const Matrix6d m = design.ParametersFromDesign();
  out->approach = probe.along / design.half_mm;
  out->offset_mm = probe.middle - design.mid_mm * out->approach;
  out->covariance = m * design_covariance * m.transpose();
  out->covariance = (out->covariance + out->covariance.transpose().eval()) / 2;
  out->scale = out->approach.norm();
  out->direction = out->approach / out->scale;
  const Eigen::Matrix3d of_a = out->covariance.topLeftCorner<3, 3>();
  out->scale_standard_uncertainty = std::sqrt(out->direction.dot(of_a * out->direction));
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - out->direction * out->direction.transpose();
  out->direction_standard_uncertainty_rad =
      std::sqrt(SingularValues(Eigen::Matrix3d(across * of_a * across))(0)) / out->scale;
  out->point_standard_uncertainty_mm = design_covariance.bottomRightCorner<3, 3>().diagonal().cwiseSqrt();
  out->condition_number = design.condition_number;
  Eigen::MatrixXd printed(design.matrix.rows(), 6);
  double squares = 0;
  out->residuals_mm.clear();
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const FittedFace& face = design.faces[design.face_of[i]];
    printed.row(static_cast<Eigen::Index>(i)) << readings[i].displacement_mm * face.normal.transpose(),
        face.normal.transpose();
    out->residuals_mm.push_back(
        design.half_mm * (design.Scaled(readings[i].displacement_mm) - probe.Meets(face, readings[i].position_mm)));
    squares += out->residuals_mm.back() * out->residuals_mm.back();
    out->worst_approach_angle_rad =
        std::max(out->worst_approach_angle_rad, std::acos(std::clamp(-face.normal.dot(out->direction), -1.0, 1.0)));
  }
  out->residual_rms_mm = std::sqrt(squares / static_cast<double>(readings.size()));
  const Eigen::VectorXd singular = SingularValues(printed);
  out->paper_condition_number = std::pow(singular(0) / singular(5), 2);
  double touch_squares = 0, touch_count = 0;
  for (std::size_t j = 0; j < given.size(); ++j)
    for (const Eigen::Vector3d& p : given[j].touched_mm) {
      touch_squares += std::pow(design.faces[j].normal.dot(p - design.faces[j].centre_mm), 2);
      touch_count += 1;
    }
  out->touch_rms_mm = std::sqrt(touch_squares / touch_count);
}

// Everything that a right set of readings never shows.
absl::Status CheckAgreement(const std::vector<ProbedFace>& given, const std::vector<ProbeReading>& readings,
                            const ProbeOptions& options, const ProbeDesign& design, const ScaledProbe& probe,
                            const ProbeCalibration& result) {
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const FittedFace& face = design.faces[design.face_of[i]];
    const double angle = std::acos(std::clamp(-face.normal.dot(result.direction), -1.0, 1.0));
    if (angle > options.greatest_approach_angle_rad)
      return Refuse(At("readings", i) + ".face", readings[i].face + " met at " + Rounded(angle / kRadPerDeg) + " deg",
                    "at most " + Rounded(options.greatest_approach_angle_rad / kRadPerDeg) +
                        " deg between the beam and the face's normal");
  }
  constexpr double kWorstSigmas = 10;
  std::size_t worst = 0;
  for (std::size_t i = 0; i < readings.size(); ++i)
    if (std::abs(result.residuals_mm[i]) > std::abs(result.residuals_mm[worst])) worst = i;
  const double allowed = kWorstSigmas * ReadingSigma(design.faces[design.face_of[worst]], probe, design, options);
  if (std::abs(result.residuals_mm[worst]) > allowed)
    return absl::FailedPreconditionError(
        At("readings", worst) + " on " + readings[worst].face + ": " + Rounded(1e3 * result.residuals_mm[worst]) +
        " um from the fit, want within " + Rounded(1e3 * allowed) +
        " um (10 standard uncertainties): the wrong face or another block, mixed units, "
        "or noise_um understated");
  for (std::size_t j = 0; j < given.size(); ++j)
    for (std::size_t k = 0; k < given[j].touched_mm.size(); ++k) {
      const double off = design.faces[j].normal.dot(given[j].touched_mm[k] - design.faces[j].centre_mm);
      if (std::abs(off) > kWorstSigmas * options.touch_uncertainty_mm)
        return absl::FailedPreconditionError(At("faces", j) + "." + At("touched_mm", k) + " of " + given[j].face +
                                             ": " + Rounded(1e3 * off) + " um from its face, want within " +
                                             Rounded(1e4 * options.touch_uncertainty_mm) +
                                             " um (10 standard uncertainties): another face was touched, or "
                                             "touch_standard_uncertainty_um is understated");
    }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ProbeCalibration> CalibrateProbeLinearly(const std::vector<ProbedFace>& faces,
                                                        const std::vector<ProbeReading>& readings,
                                                        const ProbeOptions& options) {
  absl::StatusOr<ProbeDesign> design = DesignOf(faces, readings, options);
  if (!design.ok()) return design.status();
  const ScaledProbe probe = SolveLinearly(*design);
  if (absl::Status s = CheckScale(probe, *design); !s.ok()) return s;
  if (absl::Status s = OrientFaces(faces, probe, &*design); !s.ok()) return s;

  // Residuals' covariance: their own noise, and each face's tilts and offset as its touched points leave them.
  const Eigen::Index rows = design->matrix.rows();
  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(rows, rows);
  Eigen::MatrixXd by_face(rows, 3);
  for (std::size_t j = 0; j < faces.size(); ++j) {
    const FittedFace& face = design->faces[j];
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : faces[j].touched_mm) {
      const Eigen::Vector2d lever = face.across.transpose() * (p - face.centre_mm);
      const Eigen::Vector3d row(lever.x(), lever.y(), -1);
      information += row * row.transpose() / (options.touch_uncertainty_mm * options.touch_uncertainty_mm);
    }
    by_face.setZero();
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (design->face_of[i] != static_cast<int>(j)) continue;
      const Eigen::Vector3d point =
          readings[i].position_mm + probe.middle + design->Scaled(readings[i].displacement_mm) * probe.along;
      by_face.row(i) << (face.across.transpose() * (point - face.centre_mm)).transpose(), -1.0;
      noise(i, i) += std::pow(options.noise_mm * face.normal.dot(probe.along) / design->half_mm, 2) +
                     std::pow(options.position_uncertainty_mm, 2);
    }
    noise += Propagated(by_face, information.inverse());
  }
  const Eigen::MatrixXd pseudo_inverse = PseudoInverse(design->matrix);
  // The signs of the normals changed after the design was made; both sides of its rows with them.
  ProbeCalibration result;
  result.converged = true;
  result.iterations = 1;
  Eigen::VectorXd sign(rows);
  for (Eigen::Index i = 0; i < rows; ++i)
    sign(i) = design->matrix.row(i).tail<3>().dot(design->faces[design->face_of[i]].normal) < 0 ? -1 : 1;
  const Matrix6d covariance = Propagated(pseudo_inverse * sign.asDiagonal(), noise);
  Describe(faces, readings, *design, probe, covariance, &result);
  if (absl::Status s = CheckAgreement(faces, readings, options, *design, probe, result); !s.ok()) return s;
  return result;
}

absl::StatusOr<ProbeCalibration> CalibrateProbe(const std::vector<ProbedFace>& faces,
                                                const std::vector<ProbeReading>& readings,
                                                const ProbeOptions& options) {
  absl::StatusOr<ProbeDesign> design = DesignOf(faces, readings, options);
  if (!design.ok()) return design.status();
  const ScaledProbe start = SolveLinearly(*design);
  if (absl::Status s = CheckScale(start, *design); !s.ok()) return s;
  if (absl::Status s = OrientFaces(faces, start, &*design); !s.ok()) return s;

  WeightedFit fit{faces, readings, options, &*design, start};
  fit.Lay();
  ProbeCalibration result;
  constexpr int kMostIterations = 30;
  constexpr double kSettledMm = 1e-10;
  for (int iteration = 0; iteration < kMostIterations && !result.converged; ++iteration) {
    fit.Linearise();
    const Eigen::VectorXd step = LeastSquares(fit.jacobian, fit.residual);
    constexpr double kLongestStepMm = 1e3;
    if (!step.allFinite() || step.cwiseAbs().maxCoeff() > kLongestStepMm)
      return absl::FailedPreconditionError(
          "approach and offset are not determined: the solution runs away; measure each face over more of the range");
    fit.Move(step);
    result.iterations = iteration + 1;
    result.converged = step.cwiseAbs().maxCoeff() < kSettledMm;
  }
  fit.Linearise();
  const Eigen::MatrixXd inverse = InverseTriangle(fit.jacobian);
  Matrix6d covariance = inverse.topRows<6>() * inverse.topRows<6>().transpose();
  const double freedom = static_cast<double>(fit.rows - fit.columns);
  const double reduced = freedom > 0 ? fit.residual.squaredNorm() / freedom : 1;
  constexpr double kClearlyWorse = 1.5;
  if (reduced > kClearlyWorse * kClearlyWorse) result.noise_factor = std::sqrt(reduced);
  covariance *= result.noise_factor * result.noise_factor;
  Describe(faces, readings, *design, fit.probe, covariance, &result);
  if (absl::Status s = CheckAgreement(faces, readings, options, *design, fit.probe, result); !s.ok()) return s;
  // Readings in inch as a whole fit as well as those in mm, but 25 times too well.
  constexpr double kTooGood = 0.1, kFewestFreedom = 6;
  if (freedom >= kFewestFreedom && std::sqrt(reduced) < kTooGood)
    return Refuse("noise_um", "residuals are " + Rounded(std::sqrt(reduced)) + " of what is stated",
                  "about 1: are positions, displacements and touched points in mm, not inch?");
  return result;
}

absl::StatusOr<std::vector<ProbeFaceCheck>> CheckProbe(const ProbeCalibration& probe,
                                                       const std::vector<ProbedFace>& moved_faces,
                                                       const std::vector<ProbeReading>& moved_readings,
                                                       const ProbeOptions& options) {
  if (moved_faces.empty() && moved_readings.empty()) return std::vector<ProbeFaceCheck>();
  std::vector<int> face_of;
  if (absl::Status s = CheckProbed(moved_faces, moved_readings, options, &face_of); !s.ok())
    return absl::IsInvalidArgument(s) ? Under("moved_", s)
                                      : absl::Status(s.code(), "moved_" + std::string(s.message()));
  std::vector<ProbeFaceCheck> checks;
  for (std::size_t j = 0; j < moved_faces.size(); ++j) {
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < moved_readings.size(); ++i)
      if (face_of[i] == static_cast<int>(j))
        points.push_back(moved_readings[i].position_mm + probe.offset_mm +
                         moved_readings[i].displacement_mm * probe.approach);
    if (points.empty()) continue;
    constexpr std::size_t kFewestPoints = 3;
    constexpr double kLeastSpreadMm = 0.1;
    if (points.size() < kFewestPoints || !(FitFace(points).spread_mm > kLeastSpreadMm))
      return Refuse("moved_readings of " + moved_faces[j].face, std::to_string(points.size()) + " points",
                    "at least 3 that spread over the face");
    FittedFace touched = FitFace(moved_faces[j].touched_mm);
    FittedFace seen = FitFace(points);
    if (touched.normal.dot(probe.direction) > 0) touched.normal = -touched.normal;
    if (seen.normal.dot(touched.normal) < 0) seen.normal = -seen.normal;
    ProbeFaceCheck check;
    check.face = moved_faces[j].face;
    check.reading_count = static_cast<int>(points.size());
    check.angle_rad = std::asin(std::min(1.0, seen.normal.cross(touched.normal).norm()));
    check.origin_distance_mm =
        std::abs(touched.normal.dot(touched.centre_mm)) - std::abs(seen.normal.dot(seen.centre_mm));
    check.distance_mm = seen.normal.dot(touched.centre_mm - seen.centre_mm);
    double low = 0, high = 0;
    for (const Eigen::Vector3d& p : points) {
      const double off = seen.normal.dot(p - seen.centre_mm);
      low = std::min(low, off);
      high = std::max(high, off);
    }
    check.residual_range_mm = high - low;
    checks.push_back(check);
  }
  return checks;
}

}  // namespace sixpoint::metrology

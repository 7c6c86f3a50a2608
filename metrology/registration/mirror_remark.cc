#include "metrology/registration/mirror_remark.h"

#include <absl/status/status.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdio>
#include <optional>

#include "metrology/registration/best_fit.h"
#include "metrology/registration/coarse_start.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kMirrorPoints = 8'000;  // points of all scans
constexpr int kIterationLimit = 30;           // a start that needs more is none
// Of a fit that is clear. A blade of another size reaches the spread that a casting is allowed, not this part of it.
constexpr double kClearOverlap = 0.6, kClearSpread = 0.6;
constexpr double kCadSpreadByImage = 3;  // the CAD's own spread, by its image's, below which the image says nothing

constexpr double kRests = 0.1;  // of the spread

// Patches of a casting at the rim of the loss may come and go: the pose then never rests to the micrometre, but it does.
bool Rests(const PoseFit& fit) {
  return fit.outcome == Outcome::kConverged ||
         (fit.outcome == Outcome::kNotConverged && fit.evidence.last_step_mm < kRests * fit.evidence.residual_sigma_mm);
}

// Of the part about its centroid: in the planes of its principal axes and of its axes, and in the point.
std::vector<Matrix3d> Reflections(const Surface& surface) {
  const TriangleMesh& mesh = surface.mesh();
  Matrix3d moments = Matrix3d::Zero();
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices_mm[t[0]] - surface.centroid_mm(),
                   b = mesh.vertices_mm[t[1]] - surface.centroid_mm(),
                   c = mesh.vertices_mm[t[2]] - surface.centroid_mm(), middle = (a + b + c) / 3;
    moments += (b - a).cross(c - a).norm() * middle * middle.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(moments);
  std::vector<Matrix3d> reflections;
  for (Eigen::Index k = 0; k < 3; ++k)
    for (const Vector3d& normal : {Vector3d(eigen.eigenvectors().col(k)), Vector3d(Vector3d::Unit(k))})
      reflections.push_back(Matrix3d::Identity() - 2 * normal * normal.transpose());
  reflections.push_back(-Matrix3d::Identity());
  return reflections;
}

std::vector<ScanPortion> Thinned(const std::vector<ScanPortion>& portions) {
  std::size_t total = 0;
  for (const ScanPortion& portion : portions) total += portion.sensor.size();
  const std::size_t stride = std::max<std::size_t>(1, total / kMirrorPoints);
  std::vector<ScanPortion> thinned;
  for (const ScanPortion& portion : portions) {
    ScanPortion few;
    few.id = portion.id;
    few.a_rad = portion.a_rad;
    few.b_rad = portion.b_rad;
    few.zero_from_sensor = portion.zero_from_sensor;
    for (std::size_t i = 0; i < portion.sensor.size(); ++i)
      if (i % (2 * stride) < 2) few.sensor.Add(portion.sensor[i]);  // in pairs: neighbours tell the noise
    few.scan_point_count = static_cast<std::int64_t>(few.sensor.size());
    thinned.push_back(std::move(few));
  }
  return thinned;
}

}  // namespace

absl::StatusOr<std::string> MirrorRemark(const Surface& surface, const std::vector<ScanPortion>& portions,
                                         const Isometry3d& zero_from_part_nominal,
                                         const MachineCalibration& calibration, const FitOptions& options) {
  FitOptions all = options;  // the part may be anywhere, and any of its regions
  all.free.fill(true);
  all.regions_in.clear();
  all.coarse_start = false;
  all.iteration_limit = kIterationLimit;
  all.on_iteration = nullptr;
  const double clear_spread_mm = kClearSpread * options.greatest_spread_mm;
  const std::vector<Matrix3d> reflections = Reflections(surface);
  // From a part turned by any of the reflections and then `after`; none where even the start is not clear.
  const auto fit_turned = [&](const std::vector<ScanPortion>& scans, const Matrix3d& after,
                              bool any_turn) -> absl::StatusOr<std::optional<PoseFit>> {
    std::vector<Matrix3d> turns;
    for (const Matrix3d& reflection : reflections) turns.push_back(after * reflection);
    Isometry3d first = Isometry3d::Identity();
    first.linear() = turns.front();
    const auto start = FindCoarseStart(surface, scans, first, all, any_turn ? std::vector<Matrix3d>() : turns);
    if (!start.ok()) return start.status();
    if (!(start->spread_mm < clear_spread_mm)) return std::nullopt;
    auto fit = FitToSurface(surface, scans, start->zero_from_part, calibration, all);
    if (absl::IsCancelled(fit.status())) return fit.status();
    if (!fit.ok() || !Rests(*fit)) return std::nullopt;
    return *std::move(fit);
  };

  // The CAD's image on the scans is the CAD on the scans' image.
  const std::vector<ScanPortion> scans = Thinned(portions);
  const Matrix3d mirror = Vector3d(-1, 1, 1).asDiagonal();
  std::vector<ScanPortion> image = scans;
  for (ScanPortion& portion : image) portion.zero_from_sensor = mirror * portion.zero_from_sensor;
  const auto mirrored = fit_turned(image, mirror * zero_from_part_nominal.linear(), options.coarse_start);
  if (!mirrored.ok()) return mirrored.status();
  if (!mirrored->has_value()) return "";
  const FitEvidence& evidence = (*mirrored)->evidence;
  if (!(evidence.overlap > kClearOverlap && evidence.residual_sigma_mm < clear_spread_mm)) return "";
  const auto own = fit_turned(scans, mirror * evidence.stopped_at->linear(), false);
  if (!own.ok()) return own.status();
  if (own->has_value() && (*own)->evidence.residual_sigma_mm < kCadSpreadByImage * evidence.residual_sigma_mm)
    return "";
  char text[160];
  std::snprintf(
      text, sizeof text,
      "the scans fit the CAD's mirror image: %.3g %% of the points, within a spread of %.3g um; want the CAD of "
      "the hand that was scanned",
      100 * evidence.overlap, 1e3 * evidence.residual_sigma_mm);
  return text;
}

}  // namespace sixpoint::metrology

#include "metrology/calibration/feature_search.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace sixpoint::metrology {
namespace {

constexpr size_t kSampleCount = 150000;
constexpr double kPlaneBandMm = 0.03;  // consensus band about the upper face
constexpr double kBelowMm = 0.12;      // a point this far below the upper face is in a hole
constexpr double kCellMm = 0.25;
constexpr double kMatchMm = 0.45;  // region's centre against the record's
constexpr size_t kMostRegions = 24;

// splitmix64: an even sample without the aliasing of a fixed stride, and without any state.
std::uint64_t Mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

Points Sample(const Points& points, size_t count) {
  const size_t stride = std::max<size_t>(1, points.size() / count);
  Points sample;
  sample.reserve(points.size() / stride + 1);
  for (size_t i = 0; i + stride <= points.size(); i += stride) sample.push_back(points[i + Mix(i) % stride]);
  return sample;
}

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double HeightOf(const Eigen::Vector3d& p) const { return normal.dot(p - point); }
};

// Least squares through the points within the band, from the plane given.
Plane Refined(const Points& points, const Plane& start, double band) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0;
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(start.HeightOf(p)) > band) continue;
    const Eigen::Vector3d q = p - start.point;
    sum += q;
    squares += q * q.transpose();
    count += 1;
  }
  if (count < 3) return start;
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(squares / count - mean * mean.transpose());
  Plane plane;
  plane.normal = eigen.eigenvectors().col(0);
  if (plane.normal.z() < 0) plane.normal = -plane.normal;
  plane.point = start.point + mean;
  return plane;
}

// The plane with the most points in its band, among those facing the sensor.
bool DominantPlane(const Points& sample, Plane* best) {
  const Points few = Sample(sample, 1500);
  size_t most = 0;
  for (std::uint64_t trial = 0; trial < 400; ++trial) {
    const auto pick = [&](std::uint64_t k) { return few[Mix(3 * trial + k) % few.size()]; };
    const Eigen::Vector3d a = pick(0), normal = (pick(1) - a).cross(pick(2) - a);
    if (normal.norm() < 1.0 || std::abs(normal.z()) < std::cos(M_PI / 6) * normal.norm()) continue;
    const Plane plane{normal.normalized() * (normal.z() < 0 ? -1 : 1), a};
    size_t count = 0;
    for (const Eigen::Vector3d& p : few) count += std::abs(plane.HeightOf(p)) < kPlaneBandMm;
    if (count > most) {
      most = count;
      *best = plane;
    }
  }
  if (most < few.size() / 5) return false;
  *best = Refined(sample, *best, kPlaneBandMm);
  *best = Refined(sample, *best, kPlaneBandMm / 2);
  return true;
}

struct Region {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  size_t count = 0;
  bool slot = false;  // most of its points lie on a floor at the slots' depth
};

// Axes of the plane: x along the scan direction.
struct PlaneFrame {
  Plane plane;
  Eigen::Vector3d u, v;
  explicit PlaneFrame(const Plane& p) : plane(p) {
    u = (Eigen::Vector3d::UnitX() - p.normal.x() * p.normal).normalized();
    v = p.normal.cross(u);
  }
  Eigen::Vector2d InPlane(const Eigen::Vector3d& p) const { return {u.dot(p - plane.point), v.dot(p - plane.point)}; }
};

std::vector<Region> HolesBelow(const Points& sample, const PlaneFrame& frame, const Artefact& artefact) {
  const double deepest = std::max(artefact.ConeDepth(), artefact.slot_depth_mm) + 0.2;
  struct Low {
    Eigen::Vector2d at;
    double depth;
    int cell;
  };
  std::vector<Low> low;
  Eigen::Vector2d minimum = Eigen::Vector2d::Constant(1e9), maximum = -minimum;
  const double reach = 2 * artefact.side_mm;  // no farther from the plate's middle than this
  for (const Eigen::Vector3d& p : sample) {
    const double depth = -frame.plane.HeightOf(p);
    if (depth < kBelowMm || depth > deepest) continue;
    const Eigen::Vector2d at = frame.InPlane(p);
    if (at.norm() > reach) continue;
    low.push_back({at, depth, 0});
    minimum = minimum.cwiseMin(at);
    maximum = maximum.cwiseMax(at);
  }
  if (low.empty()) return {};
  const int columns = static_cast<int>((maximum.x() - minimum.x()) / kCellMm) + 3;
  const int rows = static_cast<int>((maximum.y() - minimum.y()) / kCellMm) + 3;
  std::vector<int> label(static_cast<size_t>(columns) * rows, -1);  // -1 empty, -2 occupied, else its region
  for (Low& l : low) {
    l.cell = (1 + static_cast<int>((l.at.y() - minimum.y()) / kCellMm)) * columns + 1 +
             static_cast<int>((l.at.x() - minimum.x()) / kCellMm);
    label[l.cell] = -2;
  }
  int regions = 0;
  std::vector<int> stack;
  for (int start = 0; start < static_cast<int>(label.size()); ++start) {
    if (label[start] != -2) continue;
    label[start] = regions;
    stack.push_back(start);
    while (!stack.empty()) {
      const int cell = stack.back();
      stack.pop_back();
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int next = cell + dy * columns + dx;
          if (label[next] != -2) continue;
          label[next] = regions;
          stack.push_back(next);
        }
    }
    ++regions;
  }
  struct Sums {
    Eigen::Vector2d minimum = Eigen::Vector2d::Constant(1e9), maximum = Eigen::Vector2d::Constant(-1e9);
    size_t count = 0, floor = 0;
  };
  std::vector<Sums> sums(regions);
  for (const Low& l : low) {
    Sums& s = sums[label[l.cell]];
    s.minimum = s.minimum.cwiseMin(l.at);
    s.maximum = s.maximum.cwiseMax(l.at);
    ++s.count;
    s.floor += std::abs(l.depth - artefact.slot_depth_mm) < 0.05;
  }
  const double widest = 2 * std::max(artefact.cone_top_radius_mm, artefact.slot_width_mm) + 1;
  std::vector<Region> found;
  for (const Sums& s : sums) {
    const Eigen::Vector2d extent = s.maximum - s.minimum;
    if (s.count < 20 || extent.maxCoeff() > widest || extent.minCoeff() < 0.5) continue;
    found.push_back({(s.minimum + s.maximum) / 2, s.count, 2 * s.floor > s.count});
  }
  std::stable_sort(found.begin(), found.end(), [](const Region& a, const Region& b) { return a.count > b.count; });
  if (found.size() > kMostRegions) found.resize(kMostRegions);
  return found;
}

struct Feature {
  std::string name;
  Eigen::Vector2d centre;
  bool slot;
};

struct Match {
  Eigen::Rotation2Dd turn{0};
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  std::vector<int> region;  // of each feature; -1: none
  int count = 0;
  double squares = 0;
};

Match Matched(const std::vector<Feature>& features, const std::vector<Region>& regions, double angle,
              const Eigen::Vector2d& shift) {
  Match match{Eigen::Rotation2Dd(angle), shift, {}, 0, 0};
  for (const Feature& f : features) {
    const Eigen::Vector2d at = match.turn * f.centre + shift;
    int nearest = -1;
    double best = kMatchMm * kMatchMm;
    for (size_t r = 0; r < regions.size(); ++r) {
      const double d = (regions[r].centre - at).squaredNorm();
      if (regions[r].slot == f.slot && d < best) {
        best = d;
        nearest = static_cast<int>(r);
      }
    }
    match.region.push_back(nearest);
    if (nearest < 0) continue;
    ++match.count;
    match.squares += best;
  }
  return match;
}

// The in-plane rigid fit of the matched pairs, and its matches.
Match Settled(const std::vector<Feature>& features, const std::vector<Region>& regions, const Match& start) {
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), onto = from;
  for (size_t i = 0; i < features.size(); ++i)
    if (start.region[i] >= 0) {
      from += features[i].centre / start.count;
      onto += regions[start.region[i]].centre / start.count;
    }
  double dot = 0, cross = 0;
  for (size_t i = 0; i < features.size(); ++i)
    if (start.region[i] >= 0) {
      const Eigen::Vector2d f = features[i].centre - from, o = regions[start.region[i]].centre - onto;
      dot += f.dot(o);
      cross += f.x() * o.y() - f.y() * o.x();
    }
  const double angle = std::atan2(cross, dot);
  return Matched(features, regions, angle, onto - Eigen::Rotation2Dd(angle) * from);
}

}  // namespace

absl::StatusOr<ArtefactSighting> FindArtefact(const LineScan& scan, const Artefact& artefact) {
  const std::string where = "scan " + scan.id + ": ";
  const Points sample = Sample(scan.points_mm, kSampleCount);
  if (sample.size() < 2000)
    return absl::FailedPreconditionError(where + std::to_string(sample.size()) +
                                         " points, want at least 2000 of the artefact");
  Plane plane;
  if (!DominantPlane(sample, &plane))
    return absl::FailedPreconditionError(where +
                                         "no upper face found: no plane within 30 deg of level holds a fifth of "
                                         "the points; scan the artefact's plate");
  const PlaneFrame frame(plane);
  const std::vector<Region> regions = HolesBelow(sample, frame, artefact);
  std::vector<Feature> features;
  for (const PlaneFeature& c : artefact.cones) features.push_back({c.name, c.centre_mm, false});
  for (const PlaneFeature& q : artefact.slots) features.push_back({q.name, q.centre_mm, true});

  // Every pair of regions on every pair of features of the same kinds and distance.
  Match best, rival;
  for (size_t i = 0; i < features.size(); ++i)
    for (size_t j = 0; j < features.size(); ++j)
      for (size_t r = 0; r < regions.size(); ++r)
        for (size_t s = 0; s < regions.size(); ++s) {
          if (i == j || r == s || features[i].slot != regions[r].slot || features[j].slot != regions[s].slot) continue;
          const Eigen::Vector2d f = features[j].centre - features[i].centre, g = regions[s].centre - regions[r].centre;
          if (std::abs(f.norm() - g.norm()) > kMatchMm) continue;
          const double angle = std::atan2(f.x() * g.y() - f.y() * g.x(), f.dot(g));
          const Eigen::Vector2d middle = (features[i].centre + features[j].centre) / 2;
          const Match match =
              Settled(features, regions,
                      Matched(features, regions, angle,
                              (regions[r].centre + regions[s].centre) / 2 - Eigen::Rotation2Dd(angle) * middle));
          if (match.count < 2) continue;
          const bool same = best.count > 0 && std::abs((match.turn.inverse() * best.turn).smallestAngle()) < 0.1 &&
                            (match.shift - best.shift).norm() < 1;
          const bool better = match.count > best.count || (match.count == best.count && match.squares < best.squares);
          if (better) {
            if (!same) rival = best;
            best = match;
          } else if (!same && match.count > rival.count) {
            rival = match;
          }
        }
  int cones = 0;
  for (const Region& r : regions) cones += !r.slot;
  const std::string seen = std::to_string(cones) + " round and " + std::to_string(regions.size() - cones) +
                           " square holes seen below the upper face";
  if (best.count < 3)
    return absl::FailedPreconditionError(where + "the artefact's pattern of cones and slots was not found (" + seen +
                                         "); scan this artefact, with all its cones in view");
  std::string missing;
  for (size_t i = 0; i < features.size(); ++i)
    if (!features[i].slot && best.region[i] < 0) missing += (missing.empty() ? "" : ", ") + features[i].name;
  if (!missing.empty())
    return absl::FailedPreconditionError(where + "cone " + missing + " not found (" + seen +
                                         "); uncover it and scan again with all cones in view");
  if (rival.count == best.count)
    return absl::FailedPreconditionError(where + "two poses of the artefact fit equally well (" + seen +
                                         "); scan its slots too");
  ArtefactSighting sighting;
  sighting.matched_features = best.count;
  const Eigen::Vector2d ax = best.turn * Eigen::Vector2d::UnitX(), ay = best.turn * Eigen::Vector2d::UnitY();
  sighting.sensor_from_artefact.linear() << frame.u * ax.x() + frame.v * ax.y(), frame.u * ay.x() + frame.v * ay.y(),
      plane.normal;
  sighting.sensor_from_artefact.translation() = plane.point + frame.u * best.shift.x() + frame.v * best.shift.y();
  size_t upper = 0;
  for (const Eigen::Vector3d& p : sample) upper += std::abs(plane.HeightOf(p)) < kPlaneBandMm;
  sighting.upper_face_fraction = static_cast<double>(upper) / static_cast<double>(sample.size());
  return sighting;
}

}  // namespace sixpoint::metrology

#include "metrology/registration/coarse_start.h"

#include <absl/status/status.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nanoflann.hpp>
#include <random>

#include "metrology/frames/angles.h"
#include "metrology/linear_algebra/inverse.h"
#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"
#include "metrology/registration/surface_residuals.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kScanCount = 500;
constexpr std::size_t kSurfaceCount = 3000;
constexpr int kTurnCount = 576;  // about 27 degrees apart
constexpr int kRoughSteps = 14;
constexpr int kFineSteps = 12;
constexpr std::size_t kFineCount = 32;
constexpr double kSeen = 0.25;             // cosine between the normal and the way to the scanner
constexpr double kRivalLoss = 1.25;        // a second pose with a loss below this times the best's
constexpr double kOtherTurnRad = 0.2;      // two poses farther apart than this are two
constexpr double kOtherPlaceOfSize = 0.1;  // by the radius of gyration

// Points on the surface by area, with normals.
struct Samples {
  Points points, normals;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t k) const { return points[i][static_cast<Eigen::Index>(k)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Samples>, Samples, 3, std::size_t>;

Samples SampleSurface(const Surface& surface) {
  const TriangleMesh& mesh = surface.mesh();
  std::vector<double> areas;
  areas.reserve(mesh.triangles.size());
  double sum = 0;
  const auto corner = [&](std::size_t t, int i) -> Vector3d {
    return mesh.vertices_mm[mesh.triangles[t][static_cast<std::size_t>(i)]] - surface.centroid_mm();
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    areas.push_back(sum += 0.5 * (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm());
  Samples samples;
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (std::size_t i = 0; i < kSurfaceCount; ++i) {
    const double at = (static_cast<double>(i) + unit()) / kSurfaceCount * sum;
    const auto t = std::min(mesh.triangles.size() - 1,
                            static_cast<std::size_t>(std::lower_bound(areas.begin(), areas.end(), at) - areas.begin()));
    const double r = std::sqrt(unit()), s = unit();
    const Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    const Vector3d normal = (b - a).cross(c - a);
    if (!(normal.norm() > 0)) continue;
    samples.points.push_back((1 - r) * a + r * (1 - s) * b + r * s * c);
    samples.normals.push_back(normal.normalized());
  }
  return samples;
}

struct ScanSample {
  Vector3d point;       // at zero
  Vector3d to_scanner;  // unit, at zero; zero where nobody knows
};

std::vector<ScanSample> SampleScans(const std::vector<ScanPortion>& portions) {
  std::size_t total = 0;
  for (const ScanPortion& portion : portions) total += portion.sensor.size();
  std::vector<ScanSample> samples;
  const double stride = std::max(1.0, static_cast<double>(total) / kScanCount);
  double next = 0, before = 0;
  for (const ScanPortion& portion : portions) {
    // The scanner looks down its z.
    Vector3d to_scanner = Vector3d::Zero();
    if (portion.is_seen_from_sensor) to_scanner = portion.zero_from_sensor.linear().col(2).normalized();
    for (; next < before + static_cast<double>(portion.sensor.size()); next += stride)
      samples.push_back({portion.zero_mm(static_cast<std::size_t>(next - before)), to_scanner});
    before += static_cast<double>(portion.sensor.size());
  }
  return samples;
}

// Turn number i of n, evenly over all.
Eigen::Matrix3d Turn(int i, int n) {
  const double s = i + 0.5, r = std::sqrt(s / n), rest = std::sqrt(1 - s / n);
  const double alpha = 2 * kPi * s / std::sqrt(2.0), beta = 2 * kPi * s / 1.533751168755204288118041;
  return Eigen::Quaterniond(rest * std::cos(beta), r * std::sin(alpha), r * std::cos(alpha), rest * std::sin(beta))
      .toRotationMatrix();
}

struct Candidate {
  Isometry3d zero_from_centred;  // of the part about its centroid
  double loss = 0;
};

class Search {
 public:
  Search(const Surface& surface, const std::vector<ScanPortion>& portions)
      : surface_(surface),
        scan_(SampleScans(portions)),
        samples_(SampleSurface(surface)),
        tree_(3, samples_, nanoflann::KDTreeSingleIndexAdaptorParams(10)),
        size_mm_(surface.radius_of_gyration_mm()) {
    tree_.buildIndex();
    for (const ScanSample& sample : scan_) middle_ += sample.point / static_cast<double>(scan_.size());
  }

  // The part turned so, placed where what is seen of it has the scan's centre; then a few steps towards the scan.
  // keep_going is asked before each: a step on a large surface takes milliseconds.
  Candidate Rough(const Eigen::Matrix3d& turn, KeepGoing* keep_going) const {
    Candidate candidate;
    candidate.zero_from_centred.setIdentity();
    candidate.zero_from_centred.linear() = turn;
    Vector3d seen = Vector3d::Zero();
    double count = 0;
    const std::size_t step = std::max<std::size_t>(1, scan_.size() / 16);
    for (std::size_t k = 0; k < scan_.size(); k += step) {
      const Vector3d to_scanner = turn.transpose() * scan_[k].to_scanner;
      for (std::size_t i = 0; i < samples_.points.size(); i += 4)
        if (to_scanner.isZero(0) || samples_.normals[i].dot(to_scanner) > kSeen) {
          seen += samples_.points[i];
          count += 1;
        }
    }
    if (count > 0) seen /= count;
    candidate.zero_from_centred.translation() = middle_ - turn * seen;
    for (int iteration = 0; iteration < kRoughSteps && (*keep_going)(); ++iteration) {
      const double width = size_mm_ * (1.0 - 0.85 * iteration / (kRoughSteps - 1));
      candidate.loss = Step(width, &candidate.zero_from_centred, [&](const Vector3d& q, Vector3d* normal) {
        std::size_t nearest = 0;
        double squared = 0;
        tree_.knnSearch(q.data(), 1, &nearest, &squared);
        *normal = samples_.normals[nearest];
        return normal->dot(q - samples_.points[nearest]);
      });
    }
    return candidate;
  }

  void Fine(Candidate* candidate, KeepGoing* keep_going) const {
    for (int iteration = 0; iteration < kFineSteps && (*keep_going)(); ++iteration) {
      const double width = size_mm_ * (0.15 - 0.1 * iteration / (kFineSteps - 1));
      std::uint32_t hint = Surface::kNoTriangle;
      candidate->loss = Step(width, &candidate->zero_from_centred, [&](const Vector3d& q, Vector3d* normal) {
        const SurfacePoint found = surface_.Closest(q + surface_.centroid_mm(), hint);
        hint = found.triangle;
        *normal = found.normal;
        return found.signed_distance_mm;
      });
    }
  }

  double size_mm() const { return size_mm_; }
  double SpreadMm(const Isometry3d& zero_from_centred) const {
    std::vector<double> squares;
    for (const ScanSample& sample : scan_) {
      const double d =
          surface_.Closest(zero_from_centred.inverse(Eigen::Isometry) * sample.point + surface_.centroid_mm())
              .signed_distance_mm;
      squares.push_back(d * d);
    }
    std::sort(squares.begin(), squares.end());
    double sum = 0;
    for (std::size_t k = 0; k < squares.size() / 2; ++k) sum += squares[k];
    return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, squares.size() / 2)));
  }

 private:
  // One robust step; returns the loss before it. Surface that looks away from the scanner cannot be what it saw.
  template <class Distance>
  double Step(double width, Isometry3d* pose, const Distance& distance) const {
    const Isometry3d inverse = pose->inverse(Eigen::Isometry);
    Matrix6d matrix = 1e-3 * Matrix6d::Identity();
    Vector6d right = Vector6d::Zero();
    double loss = 0;
    for (const ScanSample& sample : scan_) {
      const Vector3d q = inverse * sample.point;
      Vector3d normal;
      const double r = distance(q, &normal), u = r / width, inside = 1 - u * u;
      const bool may_be_seen = sample.to_scanner.isZero(0) || normal.dot(inverse.linear() * sample.to_scanner) > 0;
      if (!(inside > 0) || !may_be_seen) {
        loss += 1;
        continue;
      }
      loss += 1 - inside * inside * inside;
      Vector6d row;
      row << q.cross(normal) / size_mm_, normal;
      matrix += inside * inside * row * row.transpose();
      right += inside * inside * r * row;
    }
    Vector6d change = SolvePositiveDefinite(matrix, right);
    change.head<3>() /= size_mm_;
    *pose = *pose * Perturbed(Isometry3d::Identity(), change, Vector3d::Zero());
    pose->linear() = Eigen::Quaterniond(pose->linear()).normalized().toRotationMatrix();
    return loss / static_cast<double>(scan_.size());
  }

  const Surface& surface_;
  std::vector<ScanSample> scan_;
  Samples samples_;
  Tree tree_;
  double size_mm_;
  Vector3d middle_ = Vector3d::Zero();
};

}  // namespace

absl::StatusOr<CoarseStart> FindCoarseStart(const Surface& surface, const std::vector<ScanPortion>& portions,
                                            const Isometry3d& zero_from_part_nominal, const FitOptions& options,
                                            const std::vector<Eigen::Matrix3d>& other_turns) {
  const Search search(surface, portions);
  const bool any_turn = other_turns.empty();
  std::vector<Candidate> candidates(1 + (any_turn ? kTurnCount : other_turns.size()));
  KeepGoing keep_going(options.keep_going);
  // The nominal's turn comes first: of equals it wins.
  ForEach(candidates.size(), options.thread_count, [&](std::size_t i) {
    const Eigen::Matrix3d turn = i == 0     ? zero_from_part_nominal.linear()
                                 : any_turn ? Turn(static_cast<int>(i) - 1, kTurnCount)
                                            : other_turns[i - 1];
    candidates[i] = search.Rough(turn, &keep_going);
  });
  if (keep_going.stopped()) return absl::CancelledError("registration: stopped by its caller");
  const auto better = [](const Candidate& a, const Candidate& b) { return a.loss < b.loss; };
  std::stable_sort(candidates.begin(), candidates.end(), better);
  candidates.resize(std::min(kFineCount, candidates.size()));
  ForEach(candidates.size(), options.thread_count, [&](std::size_t i) { search.Fine(&candidates[i], &keep_going); });
  if (keep_going.stopped()) return absl::CancelledError("registration: stopped by its caller");
  std::stable_sort(candidates.begin(), candidates.end(), better);

  CoarseStart start;
  const Isometry3d& best = candidates[0].zero_from_centred;
  start.zero_from_part = best;
  start.zero_from_part.translation() -= best.linear() * surface.centroid_mm();
  start.spread_mm = search.SpreadMm(best);
  for (const Candidate& other : candidates) {
    const Isometry3d between = best.inverse(Eigen::Isometry) * other.zero_from_centred;
    const double turn = VectorFromRotation(between.linear()).norm();
    if (turn < kOtherTurnRad && between.translation().norm() < kOtherPlaceOfSize * search.size_mm()) continue;
    if (!(other.loss < kRivalLoss * candidates[0].loss)) break;
    char text[160];
    std::snprintf(
        text, sizeof text,
        "two poses fit as well, %.0f deg and %.1f mm apart: the scans do not tell them apart, want a scan that does",
        turn * kDegPerRad, between.translation().norm());
    start.remark = text;
    break;
  }
  return start;
}

}  // namespace sixpoint::metrology

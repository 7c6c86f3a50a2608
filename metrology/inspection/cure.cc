#include "metrology/inspection/cure.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "metrology/linear_algebra/least_distance.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// So far a constraint may be missed by rounding, mm.
constexpr double kRounding_mm = 1e-9;

absl::Status Check(const std::vector<LimitedPatch>& patches) {
  Refusals refusals;
  if (patches.empty()) refusals.Add(Refuse("patches", "none", "one at least"));
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const LimitedPatch& patch = patches[i];
    const bool finite = patch.centre_mm.allFinite() && patch.normal.allFinite() && std::isfinite(patch.deviation_mm) &&
                        std::isfinite(patch.inside_guard_mm) && std::isfinite(patch.outside_guard_mm) &&
                        std::isfinite(patch.lower_mm) && std::isfinite(patch.upper_mm);
    if (!finite || patch.inside_guard_mm < 0 || patch.outside_guard_mm < 0)
      refusals.Add(Refuse("patches[" + std::to_string(i) + "]", "not finite, or a guard below 0", "finite numbers"));
  }
  return refusals.status();
}

// Motions as the solver has them: turns times the patches' radius about their middle, shifts. Each patch gives two rows of g m >= h: its
// upper limit, then its lower one.
class Motions {
 public:
  explicit Motions(const std::vector<LimitedPatch>& patches) : patches_(patches) {
    for (const LimitedPatch& patch : patches) middle_mm_ += patch.centre_mm / static_cast<double>(patches.size());
    double squares = 0;
    for (const LimitedPatch& patch : patches) squares += (patch.centre_mm - middle_mm_).squaredNorm();
    // One patch holds no turn: about it any radius would do.
    radius_mm_ = std::max(1e-3, std::sqrt(squares / static_cast<double>(patches.size())));
    g_.resize(static_cast<Index>(2 * patches.size()), 6);
    for (Index i = 0; i < g_.rows(); i += 2) {
      const LimitedPatch& patch = patches[static_cast<std::size_t>(i / 2)];
      g_.row(i) << (patch.centre_mm - middle_mm_).cross(patch.normal).transpose() / radius_mm_,
          patch.normal.transpose();
      g_.row(i + 1) = -g_.row(i);
    }
  }
  const MatrixXd& g() const { return g_; }
  VectorXd inside() const {
    return H([](const LimitedPatch& patch) { return patch.inside_guard_mm; });
  }
  VectorXd not_outside() const {
    return H([](const LimitedPatch& patch) { return -patch.outside_guard_mm; });
  }
  // Of any motion that is looked at.
  double greatest_mm() const { return std::hypot(kGreatestCureTurn_rad * radius_mm_, kGreatestCureShift_mm); }
  bool IsSmall(const VectorXd& m) const {
    return m.head(3).norm() <= kGreatestCureTurn_rad * radius_mm_ && m.tail(3).norm() <= kGreatestCureShift_mm;
  }
  Vector6d Unscaled(const VectorXd& m) const {
    Vector6d motion = m;
    motion.head<3>() /= radius_mm_;
    return motion;
  }

 private:
  template <typename Guard>
  VectorXd H(const Guard& guard_mm) const {
    VectorXd h(g_.rows());
    for (Index i = 0; i < g_.rows(); i += 2) {
      const LimitedPatch& patch = patches_[static_cast<std::size_t>(i / 2)];
      h[i] = patch.deviation_mm + guard_mm(patch) - patch.upper_mm;
      h[i + 1] = patch.lower_mm + guard_mm(patch) - patch.deviation_mm;
    }
    return h;
  }

  const std::vector<LimitedPatch>& patches_;
  Vector3d middle_mm_ = Vector3d::Zero();
  double radius_mm_ = 1;
  MatrixXd g_;
};

// The shortest motion, or the multipliers that prove that there is none; lengths scaled so that what lacks most is 1.
absl::StatusOr<LeastDistance> Solve(const Motions& motions, const VectorXd& h,
                                    const std::function<bool()>& keep_going) {
  const double scale = std::max(kRounding_mm, h.cwiseAbs().maxCoeff());
  absl::StatusOr<LeastDistance> solved = SolveLeastDistance(motions.g(), h / scale, keep_going);
  if (solved.ok()) solved->x *= scale;
  return solved;
}

// Pushes that balance while together they lack: whatever the solver's rounding was, no motion that is looked at satisfies them all.
bool Proves(const Motions& motions, const VectorXd& h, const VectorXd& pushes) {
  if (!(pushes.sum() > 0) || (pushes.array() < 0).any()) return false;
  const VectorXd shares = pushes / pushes.sum();
  return h.dot(shares) > (motions.g().transpose() * shares).norm() * motions.greatest_mm() + kRounding_mm;
}

std::vector<CureFinding::Conflict> ConflictsOf(const VectorXd& pushes) {
  std::vector<CureFinding::Conflict> conflicts;
  for (Index i = 0; i < pushes.size(); ++i)
    if (pushes[i] > 0) conflicts.push_back({static_cast<std::size_t>(i / 2), i % 2 == 0, pushes[i] / pushes.sum()});
  std::stable_sort(conflicts.begin(), conflicts.end(),
                   [](const auto& one, const auto& other) { return one.share > other.share; });
  return conflicts;
}

}  // namespace

absl::StatusOr<CureFinding> FindCure(const std::vector<LimitedPatch>& patches,
                                     const std::function<bool()>& keep_going) {
  if (absl::Status good = Check(patches); !good.ok()) return good;
  const Motions motions(patches);
  CureFinding finding;
  const VectorXd widest = motions.not_outside();
  const absl::StatusOr<LeastDistance> at_most = Solve(motions, widest, keep_going);
  if (!at_most.ok()) return at_most.status();
  if (!at_most->feasible) {
    if (!Proves(motions, widest, at_most->multipliers)) return finding;
    finding.cure = Cure::kNone;
    finding.conflicts = ConflictsOf(at_most->multipliers);
    return finding;
  }
  const VectorXd narrow = motions.inside();
  const absl::StatusOr<LeastDistance> surely = Solve(motions, narrow, keep_going);
  if (!surely.ok()) return surely.status();
  const bool held = surely->feasible && motions.IsSmall(surely->x) &&
                    ((motions.g() * surely->x - narrow).array() >= -kRounding_mm).all();
  if (!held) return finding;
  finding.cure = Cure::kPossible;
  finding.motion = motions.Unscaled(surely->x);
  return finding;
}

}  // namespace sixpoint::metrology

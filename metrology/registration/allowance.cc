#include "metrology/registration/allowance.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "metrology/linear_algebra/inverse.h"
#include "metrology/linear_algebra/least_distance.h"
#include "metrology/linear_algebra/pose_directions.h"
#include "metrology/linear_algebra/pseudo_inverse.h"
#include "metrology/registration/gap_pull.h"
#include "metrology/registration/patch_sums.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kMostAllowanceSteps = 40;
constexpr double kGreatestStepMm = 1;
constexpr double kRestedMm = 1e-5;
// Steps below this that no longer shrink come from points that pass over edges.
constexpr double kUnsteadyMm = 1e-3;
// After a step below this part of a patch's width points stay in their patches: where they pass from one to another what is
// asked of the pose changes, and it would go round for ever.
constexpr double kPatchesStay = 0.1;
constexpr double kFeasibleMm = 1e-4;   // lacking less than this is rounding
constexpr double kMotionPrice = 1e-4;  // of the motion beside the lack of stock, so that the least motion is chosen
constexpr std::size_t kMostHolding = 7;
constexpr double kCellMm = 1;             // of what was seen, at most
constexpr double kLeastSideMm2 = 4;       // below which a side is none to ask about
constexpr double kHeldPart = 1e-12;       // of the greatest variance, below which a direction is held from outside
constexpr double kMostPatches = 200'000;  // over the whole surface: some hundred bytes each, all looked at in each step

// +x, -z: of a side's direction.
std::string DirectionName(const Vector3d& direction) {
  const int side = SideOf(direction);
  return std::string(side % 2 == 0 ? "+" : "-") + "xyz"[side / 2];
}

absl::Status Check(const AllowanceOptions& options) {
  if (!(std::abs(options.least_stock_mm) <= 10))
    return Refuse("allowance.least_stock_mm", options.least_stock_mm, "-10 to 10");
  if (!(options.greatest_stock_mm > std::max(0.0, options.least_stock_mm) && options.greatest_stock_mm <= 50))
    return Refuse("allowance.greatest_stock_mm", options.greatest_stock_mm, "more than the least stock, at most 50");
  if (!(options.patch_mm >= 0.05 && options.patch_mm <= 50))
    return Refuse("allowance.patch_mm", options.patch_mm, "0.05 to 50");
  if (!(options.least_side_part >= 0 && options.least_side_part <= 1))
    return Refuse("allowance.least_side_part", options.least_side_part, "0 to 1");
  return absl::OkStatus();
}

// The patches at one pose: stock m_k, changing by -row_k . change.
struct Stock {
  std::vector<Eigen::Index> counted;  // patches with points enough to ask stock of
  MatrixXd rows;
  VectorXd stock, variance, weight;
  MatrixXd normal;
  VectorXd right;
};

class Allowance {
 public:
  Allowance(const Surface& surface, const std::vector<ScanPortion>& portions, const Isometry3d& pose,
            const AllowanceOptions& allowance, const MachineCalibration& calibration, const FitOptions& options)
      : surface_(surface),
        portions_(portions),
        allowance_(allowance),
        calibration_(calibration),
        options_(options),
        radius_mm_(surface.radius_of_gyration_mm()),
        pose_(pose) {
    free_.resize(6, std::count(options.free.begin(), options.free.end(), true));
    for (int k = 0, column = 0; k < 6; ++k)
      if (options.free[static_cast<std::size_t>(k)]) free_.col(column++) = Vector6d::Unit(k);
  }

  absl::StatusOr<AllowanceFit> Run() {
    bool rested = false;
    int step = 0;
    double last_size = std::numeric_limits<double>::infinity();
    for (; step < kMostAllowanceSteps; ++step) {
      if (const absl::Status status = See(); !status.ok()) return status;
      absl::StatusOr<VectorXd> best = Best();
      if (!best.ok()) return best.status();
      VectorXd change = *std::move(best);
      const double size = change.norm();
      rested = size < kRestedMm || (size < kUnsteadyMm && size > 0.5 * last_size);
      if (rested) break;
      if (size < kPatchesStay * allowance_.patch_mm && !part_from_zero_of_cells_)
        part_from_zero_of_cells_ = pose_.inverse(Eigen::Isometry);
      last_size = size;
      if (size > kGreatestStepMm) change *= kGreatestStepMm / size;
      Vector6d moved = free_ * change;
      moved.head<3>() /= radius_mm_;
      pose_ = pose_ * Perturbed(Isometry3d::Identity(), moved, surface_.centroid_mm());
      pose_.linear() = Eigen::Quaterniond(pose_.linear()).normalized().toRotationMatrix();
    }
    return Report(rested, step);
  }

 private:
  absl::Status See() {
    PatchSumOptions sum{allowance_.greatest_stock_mm, allowance_.patch_mm, false};
    if (part_from_zero_of_cells_) sum.cells_from_part = *part_from_zero_of_cells_ * pose_;
    auto sums = SumPatches(surface_, portions_, pose_, sum, options_);
    if (!sums.ok()) return sums.status();
    sums_ = *std::move(sums);
    see_.counted.clear();
    double squares = 0, weight = 0;
    for (std::size_t k = 0; k < sums_.patches.size(); ++k) {
      const Patch& patch = sums_.patches[k];
      if (patch.count >= allowance_.least_points) see_.counted.push_back(static_cast<Eigen::Index>(k));
      squares += std::max(0.0, patch.squares - patch.pull * patch.pull / patch.weight);
      weight += patch.weight * (1 - 1 / static_cast<double>(patch.count));
    }
    if (static_cast<Eigen::Index>(see_.counted.size()) < free_.cols() + 1)
      return Refuse("scans",
                    std::to_string(see_.counted.size()) + " patches with points within " +
                        Rounded(allowance_.greatest_stock_mm) + " mm of the design",
                    "at least " + std::to_string(free_.cols() + 1));
    const double noise = weight > 0 ? squares / weight : 0;
    const auto count = static_cast<Eigen::Index>(sums_.patches.size());
    see_.rows.resize(count, free_.cols());
    see_.stock.resize(count);
    see_.variance.resize(count);
    see_.weight.resize(count);
    Matrix6d normal = Matrix6d::Zero();
    Vector6d right = Vector6d::Zero();
    for (Eigen::Index i = 0; i < count; ++i) {
      const Patch& patch = sums_.patches[static_cast<std::size_t>(i)];
      see_.rows.row(i) = (free_.transpose() * patch.row / patch.weight).transpose();
      see_.stock[i] = patch.pull / patch.weight;
      see_.variance[i] = noise / static_cast<double>(patch.count);
      see_.weight[i] = patch.weight;
      normal += patch.Matrix();
      right += patch.right;
    }
    see_.normal = Restricted(normal, free_);
    see_.normal.diagonal().array() += 1e-9 * see_.normal.trace();
    see_.right = free_.transpose() * right;
    return absl::OkStatus();
  }

  // The best change within reach; sets who holds it, and what is lacking.
  absl::StatusOr<VectorXd> Best() {
    const Eigen::Index size = free_.cols(), count = static_cast<Eigen::Index>(see_.counted.size());
    MatrixXd rows(count, size);
    VectorXd lack(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index k = see_.counted[static_cast<std::size_t>(i)];
      rows.row(i) = see_.rows.row(k);
      lack[i] = allowance_.least_stock_mm - see_.stock[k];
    }
    const auto keep = [&](const VectorXd& multipliers) {
      multipliers_ = VectorXd::Zero(see_.stock.size());
      for (Eigen::Index i = 0; i < count; ++i) multipliers_[see_.counted[static_cast<std::size_t>(i)]] = multipliers[i];
    };
    least_stock_mm_ = allowance_.least_stock_mm - lack.maxCoeff();
    // What is lacking at the best: (price * change, lack).
    MatrixXd g(count, size + 1);
    g << -rows / kMotionPrice, VectorXd::Ones(count);
    const absl::StatusOr<LeastDistance> nearest = SolveLeastDistance(g, lack, options_.keep_going);
    if (!nearest.ok()) return nearest.status();
    const VectorXd nearest_change = nearest->x.head(size) / kMotionPrice;
    lacking_mm_ = nearest->feasible ? std::max(0.0, nearest->x[size]) : lack.maxCoeff();
    if (lacking_mm_ > kFeasibleMm) {
      keep(nearest->multipliers);
      return nearest_change;
    }
    lacking_mm_ = 0;
    // Nearest, in the normal matrix, to the unconstrained best.
    const CholeskyFactor factor(see_.normal);
    const VectorXd unconstrained = factor.Solve(see_.right);
    const absl::StatusOr<LeastDistance> best =
        SolveLeastDistance(factor.RowsByInverse(-rows), lack + rows * unconstrained, options_.keep_going);
    if (!best.ok()) return best.status();
    keep(best->multipliers);
    // What the first problem allowed by rounding the second may not: stay with the first's change.
    if (!best->feasible) return nearest_change;
    const VectorXd constrained = unconstrained + factor.InverseTimes(best->x);
    return constrained;
  }

  absl::StatusOr<AllowanceFit> Report(bool rested, int steps) {
    AllowanceFit result;
    auto sides = LookedAt();
    if (!sides.ok()) return sides.status();
    result.stock.sides = *std::move(sides);
    result.fit.evidence.stopped_at = pose_;
    result.stock.least_stock_mm = least_stock_mm_;
    result.stock.lacking_mm = lacking_mm_;
    FitEvidence& evidence = result.fit.evidence;
    evidence.iteration_count = steps;
    evidence.residual_sigma_mm = sums_.residual_sigma_mm;
    evidence.patch_mm = allowance_.patch_mm;
    for (const PortionCounts& portion : sums_.portions) evidence.point_count += portion.points;
    for (const Patch& patch : sums_.patches) evidence.points_used += patch.count;
    evidence.overlap = static_cast<double>(evidence.points_used) /
                       static_cast<double>(std::max<std::int64_t>(1, evidence.point_count));

    std::vector<Eigen::Index> holding;
    double forces = 0;
    for (Eigen::Index i = 0; i < multipliers_.size(); ++i)
      if (multipliers_[i] > 0) {
        holding.push_back(i);
        forces += multipliers_[i];
      }
    std::stable_sort(holding.begin(), holding.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return multipliers_[a] > multipliers_[b]; });
    if (holding.size() > kMostHolding) holding.resize(kMostHolding);
    for (const Eigen::Index i : holding) {
      const Patch& patch = sums_.patches[static_cast<std::size_t>(i)];
      AllowancePatch held;
      held.point_mm = surface_.Closest(surface_.centroid_mm() + PatchCentre(patch.key, allowance_.patch_mm)).point_mm;
      held.normal = patch.row.tail<3>().normalized();
      held.stock_mm = see_.stock[i];
      held.standard_uncertainty_mm = std::hypot(std::sqrt(see_.variance[i]), GapUncertainty(patch.Gap()));
      held.share = multipliers_[i] / forces;
      result.stock.holding.push_back(held);
    }
    if (lacking_mm_ > 0) {
      result.fit.outcome = Outcome::kInfeasible;
      evidence.remark = "no pose near leaves " + Rounded(allowance_.least_stock_mm) + " mm everywhere: at the best " +
                        Rounded(lacking_mm_) + " mm are lacking, held by " + std::to_string(holding.size()) +
                        " patches that pull against each other";
    } else {
      const PlacedPose placed = Placed(holding);
      Describe(placed, &evidence);
      if (rested) {
        result.fit.outcome = Outcome::kConverged;
        result.fit.placed = placed;
      } else {
        evidence.remark = "the pose still moves after " + std::to_string(steps) + " steps";
      }
    }
    JudgeSides(&result);
    return result;
  }

  // By cells of their own, fine enough for what a patch's mean does not show; wider than kCellMm where there would be too many.
  absl::StatusOr<std::vector<SeenSide>> LookedAt() const {
    const double cell_mm =
        std::max(std::min(allowance_.patch_mm, kCellMm), std::sqrt(surface_.area_mm2() / kMostPatches));
    const auto cells = SumPatches(surface_, portions_, pose_, {allowance_.greatest_stock_mm, cell_mm, false}, options_);
    if (!cells.ok()) return cells.status();
    std::vector<PatchKey> seen;
    for (const Patch& cell : cells->patches) seen.push_back(cell.key);
    return SeenSides(surface_, seen, cell_mm, options_);
  }

  void JudgeSides(AllowanceFit* result) const {
    FitEvidence& evidence = result->fit.evidence;
    double area = 0, seen = 0;
    for (const SeenSide& side : result->stock.sides) {
      area += side.area_mm2;
      seen += side.seen_mm2;
    }
    evidence.surface_part = area > 0 ? seen / area : 0;
    if (!result->fit.placed) return;
    std::string unseen;
    for (const SeenSide& side : result->stock.sides) {
      if (side.area_mm2 < kLeastSideMm2 || side.seen_part() >= allowance_.least_side_part) continue;
      unseen +=
          (unseen.empty() ? "" : "; ") + DirectionName(side.direction) + " " + Percent(side.seen_part()) + " seen";
    }
    if (!unseen.empty())
      result->fit.Withdraw(Outcome::kNotDetermined,
                           "nothing is known of stock that was not seen: of the side that looks to the part's " +
                               unseen + ", want at least " + Percent(allowance_.least_side_part) +
                               " of each, or regions that leave it out");
  }

  // The pose is linear in the patches' stock: those that hold it act through the equalities, the others through the fit.
  PlacedPose Placed(const std::vector<Eigen::Index>& holding) const {
    const Eigen::Index size = free_.cols();
    const auto held_count = static_cast<Eigen::Index>(holding.size());
    MatrixXd projection = Inverse(see_.normal), held_part = MatrixXd::Zero(size, held_count);
    if (held_count > 0) {
      MatrixXd held(held_count, size);
      for (Eigen::Index i = 0; i < held_count; ++i) held.row(i) = see_.rows.row(holding[static_cast<std::size_t>(i)]);
      const MatrixXd open = NullSpace(held);
      projection.setZero();
      if (open.cols() > 0) projection = Propagated(open, Inverse(Propagated(open.transpose(), see_.normal)));
      held_part = (MatrixXd::Identity(size, size) - projection * see_.normal) * PseudoInverse(held);
    }
    MatrixXd scaled = MatrixXd::Zero(size, size);
    MappingSensitivity moved = MappingSensitivity::Zero(size, MappingParameterCount(portions_.size()));
    GapPull gap;
    MatrixXd pulled = MatrixXd::Zero(size, 6);  // by each direction, where the part stands elsewhere along it
    for (Eigen::Index i = 0; i < see_.rows.rows(); ++i) {
      VectorXd acts = projection * (see_.weight[i] * see_.rows.row(i).transpose());
      for (Eigen::Index h = 0; h < held_count; ++h)
        if (holding[static_cast<std::size_t>(h)] == i) acts += held_part.col(h);
      scaled += see_.variance[i] * acts * acts.transpose();
      const Patch& patch = sums_.patches[static_cast<std::size_t>(i)];
      pulled += acts * patch.row.transpose() / patch.weight;
      const Vector3d from_centroid = PatchCentre(patch.key, allowance_.patch_mm);
      const Vector3d in_part = patch.row.tail<3>().normalized();
      gap.Add(patch.Gap(), 1, free_ * acts, from_centroid, in_part);
      const Vector3d zero = pose_ * (surface_.centroid_mm() + from_centroid);
      const Vector3d normal = pose_.linear() * in_part;
      const Vector3d sensor = portions_[patch.portion].zero_from_sensor.inverse() * zero;
      AddSensitivity(acts, normal, {patch.portion, sensor, zero}, portions_, calibration_, &moved);
    }
    Matrix6d to_zero = Matrix6d::Zero();
    to_zero.topLeftCorner<3, 3>() = pose_.linear() / radius_mm_;
    to_zero.bottomRightCorner<3, 3>() = pose_.linear();
    const MatrixXd turned = to_zero * free_;
    PlacedPose placed(pose_, pose_ * surface_.centroid_mm(), Propagated(turned, scaled), turned * moved, calibration_);
    const Matrix6d held = HeldUncertainty(options_, radius_mm_).asDiagonal();
    placed.AddSource(kHeldDirections, to_zero * (held - free_ * pulled * held));
    placed.AddSource(kCadGap, to_zero * gap.Root(Matrix6d::Identity()));
    return placed;
  }

  // Weakest direction and condition: the noise's covariance says all there is, but for gaps.
  void Describe(const PlacedPose& placed, FitEvidence* evidence) const {
    const Matrix6d& noise = placed.noise_covariance.values;
    Vector6d scale = Vector6d::Ones();
    scale.head<3>().setConstant(radius_mm_);
    const EigenSystem6 eigen = EigenSystemOf(Matrix6d(scale.asDiagonal() * noise * scale.asDiagonal()));
    const double greatest = eigen.values[5];
    if (!(greatest > 0)) return;
    int least = 0;
    while (least < 5 && eigen.values[least] < kHeldPart * greatest) ++least;
    evidence->weakest_direction = eigen.vectors.col(5);
    evidence->weakest_standard_uncertainty_mm =
        WithFormAndGaps(placed, evidence->weakest_direction, radius_mm_, std::sqrt(greatest));
    evidence->condition_number = std::sqrt(greatest / eigen.values[least]);
  }

  const Surface& surface_;
  const std::vector<ScanPortion>& portions_;
  const AllowanceOptions& allowance_;
  const MachineCalibration& calibration_;
  const FitOptions& options_;
  const double radius_mm_;
  Isometry3d pose_;
  std::optional<Isometry3d> part_from_zero_of_cells_;  // of the pose whose patches stay
  PoseDirections free_;
  PatchSums sums_;
  Stock see_;
  VectorXd multipliers_;
  double lacking_mm_ = 0, least_stock_mm_ = 0;
};

}  // namespace

absl::StatusOr<AllowanceFit> FitWithAllowance(const Surface& surface, const std::vector<ScanPortion>& portions,
                                              const Isometry3d& zero_from_part, const AllowanceOptions& allowance,
                                              const MachineCalibration& calibration, const FitOptions& options) {
  if (absl::Status status = Check(allowance); !status.ok()) return status;
  if (absl::Status status = CheckInputs(portions, zero_from_part, options); !status.ok()) return status;
  if (absl::Status status = CheckCovariances(calibration); !status.ok()) return status;
  const double least_patch_mm = std::sqrt(surface.area_mm2() / kMostPatches);
  if (!(allowance.patch_mm >= least_patch_mm))
    return Refuse("allowance.patch_mm", allowance.patch_mm,
                  "at least " + Rounded(least_patch_mm) + " on a surface of " + Rounded(surface.area_mm2()) + " mm2");
  return Allowance(surface, portions, zero_from_part, allowance, calibration, options).Run();
}

}  // namespace sixpoint::metrology

#include "metrology/correction/start_draws.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "metrology/correction/start_uncertainty.h"
#include "metrology/frames/angles.h"
#include "metrology/kinematics/linear_axes.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/parallel/loops.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kChunk = 250;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What a source changes, a column a standard deviation.
struct Cause {
  std::string source;
  double degrees_of_freedom = kInfinity;
  Eigen::Matrix<double, kChainParameterCount, Eigen::Dynamic> chain;  // pose and axes
  Eigen::Matrix<double, 6, Eigen::Dynamic> linear;                    // what the linear axes read
  Eigen::Matrix<double, 2, Eigen::Dynamic> turn_rad;                  // of a and b as they are reached
  Eigen::Matrix<double, 3, Eigen::Dynamic> tip_mm;                    // of the tool's tip

  explicit Cause(const std::string& name, Eigen::Index count) : source(name) {
    chain.setZero(kChainParameterCount, count);
    linear.setZero(6, count);
    turn_rad.setZero(2, count);
    tip_mm.setZero(3, count);
  }
};

std::vector<Cause> CausesOf(const RegisteredPose& pose, const CorrectedHoleGroup& corrected, const Drilling& drilling) {
  std::vector<Cause> causes;
  causes.emplace_back("noise of the scans", kPoseParameterCount).chain.topRows<kPoseParameterCount>() =
      FactorOf(pose.noise.values);
  if (!pose.angles.empty())
    causes.emplace_back("angles of the scans", kPoseParameterCount).chain.topRows<kPoseParameterCount>() =
        FactorOf(PoseCovarianceOf(pose.angles));
  for (const ErrorSource& source : pose.sources) {
    Cause& cause = causes.emplace_back(source.name, source.pose_per_sigma.cols());
    cause.degrees_of_freedom = source.degrees_of_freedom;
    cause.chain.topRows<kPoseParameterCount>() = source.pose_per_sigma;
    cause.chain.bottomRows<kAxisParameterCount>() =
        source.parameters_per_sigma.middleRows<kAxisParameterCount>(kFirstAxisParameter);
    cause.linear = source.parameters_per_sigma.middleRows<kLinearParameterCount>(kFirstLinearParameter);
  }
  if (drilling.tool_offset_mm > 0)
    causes.emplace_back(drilling.tool_offset_name, 3).tip_mm.diagonal().setConstant(drilling.tool_offset_mm);
  if (pose.positioning.Uncertain())
    causes.emplace_back("angles of the drilling", 2).turn_rad.diagonal() =
        Eigen::Vector2d(pose.positioning.a.StandardUncertaintyAt(corrected.corrected.a_rad),
                        pose.positioning.b.StandardUncertaintyAt(corrected.corrected.b_rad));
  return causes;
}

// All that one draw changes.
struct Change {
  ChainParameters chain = ChainParameters::Zero();
  Eigen::Matrix<double, 6, 1> linear = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Vector2d turn_rad = Eigen::Vector2d::Zero();
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();

  void Add(const Cause& cause, const Eigen::VectorXd& sigmas) {
    chain += cause.chain * sigmas;
    linear += cause.linear * sigmas;
    turn_rad += cause.turn_rad * sigmas;
    tip_mm += cause.tip_mm * sigmas;
  }
};

class DrawnChain {
 public:
  DrawnChain(const NominalHoleGroup& group, const CorrectedHoleGroup& corrected, const RegisteredPose& pose,
             const RotaryAxes& axes, const Drilling& drilling, const DrawnAngles& angles)
      : group_(group),
        corrected_(corrected),
        pose_(pose),
        axes_(axes),
        growth_(axes.Growth(drilling.stretch)),
        angles_(angles) {}

  // Squares of the distances from the estimate, hole by hole, in mm^2.
  absl::Status Distances(const Change& change, std::vector<double>* squares) const {
    const auto [zero_from_part, axes] = Moved(pose_, axes_, change.chain);
    const auto angles = angles_ ? angles_(zero_from_part, axes) : Oriented(zero_from_part, axes);
    if (!angles.ok()) return angles.status();
    const Eigen::Isometry3d commanded = axes.MachineFromZero(angles->a_rad, angles->b_rad);
    const Eigen::Isometry3d reached =
        axes.MachineFromZero(angles->a_rad + change.turn_rad[0], angles->b_rad + change.turn_rad[1]);
    for (std::size_t i = 0; i < group_.holes.size(); ++i) {
      const Eigen::Vector3d in_zero_mm = growth_ * (zero_from_part * group_.holes[i].start_in_part_mm);
      const Eigen::Vector3d start_mm = commanded * in_zero_mm;
      const Eigen::Vector3d off_mm = start_mm - corrected_.holes[i].start_mm -
                                     LinearAxesJacobian(start_mm) * change.linear + (reached * in_zero_mm - start_mm) +
                                     change.tip_mm;
      (*squares)[i] = off_mm.squaredNorm();
    }
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<RotaryAngles> Oriented(const Eigen::Isometry3d& zero_from_part, const RotaryAxes& axes) const {
    constexpr double kFree = 4 * kPi;
    return Orient(axes, zero_from_part.linear() * group_.axis_in_part, corrected_.reached,
                  {-kFree, kFree, -kFree, kFree}, AllowedTiltOf(group_.inclination_tolerance_rad));
  }

  const NominalHoleGroup& group_;
  const CorrectedHoleGroup& corrected_;
  const RegisteredPose& pose_;
  const RotaryAxes& axes_;
  const Eigen::Affine3d growth_;
  const DrawnAngles& angles_;
};

// Of some draws: all sources together, draw by draw, and sums of squares of each alone, [source][hole].
struct Drawn {
  absl::Status status;
  std::vector<std::vector<double>> squares_mm2;
  std::vector<std::vector<double>> sums_mm2;
};

Drawn DrawSome(const DrawnChain& chain, const std::vector<Cause>& causes, std::size_t holes, std::size_t begin,
               std::size_t end, std::uint64_t seed) {
  std::seed_seq seeds{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                      static_cast<std::uint32_t>(begin)};
  std::mt19937_64 random(seeds);
  std::normal_distribution<double> normal;
  Drawn drawn;
  drawn.sums_mm2.assign(causes.size(), std::vector<double>(holes));
  std::vector<double> squares(holes);
  for (std::size_t draw = begin; draw < end && drawn.status.ok(); ++draw) {
    Change all;
    for (std::size_t c = 0; c < causes.size() && drawn.status.ok(); ++c) {
      const Cause& cause = causes[c];
      Eigen::VectorXd sigmas(cause.chain.cols());
      for (double& sigma : sigmas) sigma = normal(random);
      Change alone;
      alone.Add(cause, sigmas);
      drawn.status = chain.Distances(alone, &squares);
      for (std::size_t i = 0; i < holes; ++i) drawn.sums_mm2[c][i] += squares[i];
      // Student's t: as wide as what is known of the standard uncertainty.
      if (std::isfinite(cause.degrees_of_freedom))
        sigmas *= std::sqrt(cause.degrees_of_freedom /
                            std::chi_squared_distribution<double>(cause.degrees_of_freedom)(random));
      all.Add(cause, sigmas);
    }
    if (!drawn.status.ok()) break;
    drawn.status = chain.Distances(all, &squares);
    drawn.squares_mm2.push_back(squares);
  }
  return drawn;
}

DrawnStart Summed(const CorrectedHole& hole, const std::vector<Cause>& causes, std::size_t at,
                  const std::vector<Drawn>& drawn) {
  DrawnStart start;
  start.name = hole.name;
  std::vector<double> squares_mm2;
  for (const Drawn& some : drawn)
    for (const std::vector<double>& of_draw : some.squares_mm2) squares_mm2.push_back(of_draw[at]);
  std::sort(squares_mm2.begin(), squares_mm2.end());
  const double count = static_cast<double>(squares_mm2.size());
  // How many draws lie below the value is binomial: two standard deviations of that are 95 %.
  const double spread = 1.96 * std::sqrt(count * kStartProbability * (1 - kStartProbability));
  const auto at_rank = [&](double rank) {
    const double within = std::clamp(std::round(rank), 0.0, count - 1);
    return 1e3 * std::sqrt(squares_mm2[static_cast<std::size_t>(within)]);
  };
  start.expanded_uncertainty_um = at_rank(kStartProbability * count);
  start.low_um = at_rank(kStartProbability * count - spread);
  start.high_um = at_rank(kStartProbability * count + spread);
  for (std::size_t c = 0; c < causes.size(); ++c) {
    double sum_mm2 = 0;
    for (const Drawn& some : drawn) sum_mm2 += some.sums_mm2[c][at];
    start.components.push_back({causes[c].source, 1e3 * std::sqrt(sum_mm2 / count)});
  }
  return start;
}

}  // namespace

absl::StatusOr<std::vector<DrawnStart>> DrawStarts(const NominalHoleGroup& group, const CorrectedHoleGroup& corrected,
                                                   const RegisteredPose& pose, const RotaryAxes& axes,
                                                   const Drilling& drilling, const DrawOptions& options,
                                                   const DrawnAngles& angles) {
  if (options.count < kLeastDraws)
    return Refuse("draws", std::to_string(options.count), std::to_string(kLeastDraws) + " or more");
  if (corrected.name != group.name || corrected.holes.size() != group.holes.size())
    return Refuse("corrected", corrected.name, "the correction of group " + group.name);
  if (absl::Status finite = CheckFinite(pose); !finite.ok()) return finite;
  const DrawnChain chain(group, corrected, pose, axes, drilling, angles);
  const std::vector<Cause> causes = CausesOf(pose, corrected, drilling);
  const auto drawn = OfEachChunk<Drawn>(
      static_cast<std::size_t>(options.count), kChunk, options.threads, [&](std::size_t begin, std::size_t end) {
        if (!options.keep_going || options.keep_going())
          return DrawSome(chain, causes, group.holes.size(), begin, end, options.seed);
        Drawn stopped;
        stopped.status = absl::CancelledError("draws: the caller went away");
        return stopped;
      });
  for (const Drawn& some : drawn)
    if (!some.status.ok()) return some.status;
  std::vector<DrawnStart> starts;
  for (std::size_t i = 0; i < group.holes.size(); ++i) starts.push_back(Summed(corrected.holes[i], causes, i, drawn));
  return starts;
}

}  // namespace sixpoint::metrology

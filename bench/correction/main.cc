// `bench/run correction`: the solver of any joint chain. The last line is one JSON object.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

#include "bench/correction/closed_forms.h"
#include "bench/goals.h"
#include "metrology/kinematics/chain_solver.h"
#include "metrology/kinematics/chain_trajectory.h"
#include "tests/metrology/kinematics/machine_chains.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace metrology;

constexpr int kPoses = 1000000;

std::vector<Goal> Goals() {
  constexpr auto kAlways = Goal::Counts::kAlways, kInFull = Goal::Counts::kInFull;
  constexpr auto kNone = std::nullopt;
  return {
      {"closed", "closed_form_difference", "every command of both branches, mm or rad, AB and BC", kNone, 1e-9,
       kAlways},
      {"closed", "closed_form_poses", "poses that were compared", kPoses, kNone, kInFull},
      {"chains", "chains_worst_mm", "random chains: worst by forward kinematics, mm", kNone, 1e-9, kAlways},
      {"chains", "chains_worst_rad", "random chains: worst by forward kinematics, rad", kNone, 1e-9, kAlways},
      {"chains", "chains_own_pose_percent", "random chains: the pose that made the target is a branch, %", 99.9, kNone,
       kAlways},
      {"along_c", "along_c_solved_percent", "holes along C: solved, C nominal, within 1e-9, %", 100, kNone, kAlways},
      {"times", "time_over_closed_form", "1,000 holes on a tilted chain: time over the closed form's", kNone, 5,
       Goal::Counts::kWhereQuiet},
  };
}

struct Poses {
  std::mt19937_64 random{2027};
  std::uniform_real_distribution<double> place{-250, 250}, turn{-M_PI, M_PI};
  ToolTarget Next() {
    const double x = place(random), y = place(random), z = place(random);
    return {{x, y, z}, RandomDirection(random)};
  }
};

// Of the branch that is nearest to what the closed form has.
double Difference(const std::vector<ChainSolution>& solutions, const Commands& wanted, int first_rotary) {
  double least = INFINITY;
  for (const ChainSolution& solution : solutions) {
    Commands off = solution.commanded - wanted;
    for (int i = first_rotary; i < first_rotary + 2; ++i) off(i) = std::remainder(off(i), 2 * M_PI);
    least = std::fmin(least, off.cwiseAbs().maxCoeff());
  }
  return least;
}

void CompareClosedForms(int poses, nlohmann::json* figures) {
  constexpr double kZ12_mm = 123.4;
  const ChainSolver ab = Solver(Sarix()), bc = Solver(TiltRotaryTable(kZ12_mm));
  const VectorXd nominal = VectorXd::Zero(5);
  Poses drawn;
  double worst_ab = 0, worst_bc = 0;
  for (int i = 0; i < poses; ++i) {
    const ToolTarget target = drawn.Next();
    const auto of_ab = BothBranches(ab, target, nominal), of_bc = BothBranches(bc, target, nominal);
    for (const Commands& wanted : OfAbTable(kPointC, target.tip_in_zero_mm, target.axis_in_zero))
      worst_ab = std::fmax(worst_ab, Difference(of_ab, wanted, 0));
    for (const Commands& wanted : OfTiltRotaryTable(kZ12_mm, target.tip_in_zero_mm, target.axis_in_zero))
      worst_bc = std::fmax(worst_bc, Difference(of_bc, wanted, 2));
  }
  std::printf("closed forms, %d poses, both branches: worst command off, mm or rad: AB %.2g, BC %.2g\n", poses,
              worst_ab, worst_bc);
  (*figures)["closed_form_difference"] = std::fmax(worst_ab, worst_bc);
  (*figures)["closed_form_difference_ab"] = worst_ab;
  (*figures)["closed_form_difference_bc"] = worst_bc;
  (*figures)["closed_form_poses"] = poses;
}

void SolveRandomChains(int poses, nlohmann::json* figures) {
  Poses drawn;
  double worst_mm = 0, worst_rad = 0;
  int solved = 0, own = 0;
  std::printf("\n%-12s %10s %10s %14s %12s %12s\n", "random", "targets", "solved", "both branches", "worst mm", "rad");
  const char* names[] = {"head-head", "head-table", "table-table"};
  for (const int on_part : {2, 1, 0}) {
    double class_mm = 0, class_rad = 0;
    int targets = 0, of_class = 0, twice = 0;
    while (targets < poses / 3) {
      const JointChain chain = RandomChain(on_part, drawn.random);
      ChainSolverOptions options;
      options.tool = {RandomDirection(drawn.random), drawn.Next().tip_in_zero_mm, 80};
      const auto solver = ChainSolver::Make(chain, options);
      if (!solver.ok()) continue;  // the tool along the joint that carries it
      for (int i = 0; i < 10; ++i) {
        VectorXd at(5);
        for (int k = 0; k < 5; ++k)
          at(k) = chain.motion(k).kind == JointKind::kRotary ? drawn.turn(drawn.random) : drawn.place(drawn.random);
        const ToolTarget target = TargetAt(chain, options.tool, at);
        ++targets;
        const auto branches = BothBranches(*solver, target, at);
        if (branches.empty()) continue;  // linear joints nearly dependent there: more than 10 m to go
        ++of_class;
        twice += branches.size() == 2;
        bool is_own = false;
        for (const ChainSolution& solution : branches) {
          const Arrival arrival = ArrivalOf(chain, options.tool, target, solution.reached);
          class_mm = std::fmax(class_mm, arrival.off_mm);
          class_rad = std::fmax(class_rad, arrival.off_rad);
          // Rounding of the target is magnified where both branches meet.
          is_own = is_own || (solution.commanded - at).cwiseAbs().maxCoeff() < 1e-6;
        }
        own += is_own;
      }
    }
    std::printf("%-12s %10d %10d %14d %12.2g %12.2g\n", names[on_part], targets, of_class, twice, class_mm, class_rad);
    worst_mm = std::fmax(worst_mm, class_mm);
    worst_rad = std::fmax(worst_rad, class_rad);
    solved += of_class;
  }
  (*figures)["chains_worst_mm"] = worst_mm;
  (*figures)["chains_worst_rad"] = worst_rad;
  (*figures)["chains_own_pose_percent"] = 100.0 * own / std::max(1, solved);
}

void SolveAlongC(nlohmann::json* figures) {
  constexpr int kHoles = 10000;
  const ChainSolver solver = Solver(TiltRotaryTable(123.4));
  Poses drawn;
  int right = 0;
  for (int i = 0; i < kHoles; ++i) {
    // Along C, up to what rotations leave of it by rounding.
    const double off_rad = i % 2 == 0 ? 0 : 1e-15, azimuth = drawn.turn(drawn.random);
    const Vector3d axis(off_rad * std::cos(azimuth), off_rad * std::sin(azimuth), 1);
    const ToolTarget target{drawn.Next().tip_in_zero_mm, axis};
    VectorXd nominal = VectorXd::Zero(5);
    nominal(2) = drawn.turn(drawn.random) / 10;
    nominal(3) = 3 * drawn.turn(drawn.random);
    const auto solved = solver.Solve(target, nominal);
    if (!solved.ok() || solved->commanded(3) != nominal(3) || solved->loose_joint != 3) continue;
    const Arrival arrival = ArrivalOf(solver.chain(), {}, target, solved->reached);
    right += arrival.off_mm <= 1e-9 && arrival.off_rad <= 1e-9;
  }
  std::printf("\nholes along C: %d of %d solved with C where it was\n", right, kHoles);
  (*figures)["along_c_solved_percent"] = 100.0 * right / kHoles;
}

template <typename Function>
double MicrosecondsOf(const Function& function) {
  const auto start = std::chrono::steady_clock::now();
  function();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

void Time(nlohmann::json* figures) {
  constexpr int kHoles = 1000, kRepeats = 201;
  Poses drawn;
  std::vector<ToolTarget> targets(kHoles);
  for (ToolTarget& target : targets) target = drawn.Next();
  // A tenth of a degree out of true, the lines some hundredths of a millimetre from each other.
  const ChainSolver solver =
      Solver(Chain({Rotary("A", Vector3d(2e-3, 1, -1e-3).normalized(), kPointC),
                    Rotary("B", Vector3d(1, -1e-3, 2e-3).normalized(), kPointC + Vector3d(0.02, -0.03, 0.05))},
                   {Linear("X", Vector3d(1, 1e-4, 0).normalized()), Linear("Y", Vector3d(0, 1, 2e-4).normalized()),
                    Linear("Z", Vector3d::UnitZ())}));
  const VectorXd nominal = VectorXd::Zero(5);
  volatile double sum = 0;  // so that nothing is left out
  std::vector<double> closed_us, general_us;
  // In turns, so that what else the machine does meets both.
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    closed_us.push_back(MicrosecondsOf([&] {
      for (const ToolTarget& target : targets)
        sum = sum + NearestOfAbTable(kPointC, target.tip_in_zero_mm, target.axis_in_zero, 0, 0).sum();
    }));
    general_us.push_back(MicrosecondsOf([&] {
      for (const ToolTarget& target : targets) sum = sum + solver.Solve(target, nominal).value().commanded.sum();
    }));
  }
  const auto middle = [](std::vector<double> times) {
    std::nth_element(times.begin(), times.begin() + kRepeats / 2, times.end());
    return times[kRepeats / 2];
  };
  const double ratio = middle(general_us) / middle(closed_us);
  // A helix of a thousand targets about C, which winds eight times.
  std::vector<ToolTarget> helix(kHoles);
  for (int i = 0; i < kHoles; ++i) {
    const double azimuth = i * 0.05;
    helix[static_cast<size_t>(i)] = {{40 * std::cos(azimuth), 40 * std::sin(azimuth), 0.05 * i},
                                     Vector3d(0.5 * std::cos(azimuth), 0.5 * std::sin(azimuth), 1).normalized()};
  }
  const ChainSolver table = Solver(TiltRotaryTable(123.4));
  Continuity continuity;
  continuity.rotary_rad.always = 0.1;
  continuity.linear_mm.always = 50;
  const double trajectory_us = MicrosecondsOf([&] {
    sum = sum + static_cast<double>(SolveTrajectory(table, helix, VectorXd::Zero(5), continuity).value().size());
  });
  std::printf(
      "\n1,000 holes: closed form %.0f us, any chain %.0f us, %.2f times; a trajectory of 1,000 targets %.0f us\n",
      middle(closed_us), middle(general_us), ratio, trajectory_us);
  (*figures)["time_over_closed_form"] = ratio;
  (*figures)["thousand_holes_us"] = middle(general_us);
  (*figures)["thousand_targets_of_a_trajectory_us"] = trajectory_us;
}

int Run(int poses, bool quiet) {
  nlohmann::json figures = nlohmann::json::object();
  CompareClosedForms(poses, &figures);
  SolveRandomChains(poses / 5, &figures);
  SolveAlongC(&figures);
  Time(&figures);
  const int missed = PrintGoals(Goals(), {{"closed", "chains", "along_c", "times"}, poses >= kPoses, quiet}, figures);
  figures["missed"] = missed;
  std::printf("%s\n", nlohmann::json({{"bench", "correction"}, {"figures", figures}}).dump().c_str());
  return missed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) {
  int poses = sixpoint::bench::kPoses;
  bool quiet = true, sound = true;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--no-times") == 0)
      quiet = false;
    else if (std::strcmp(argv[i], "--poses") == 0 && i + 1 < argc)
      poses = std::atoi(argv[++i]);
    else
      sound = false;
  }
  if (!sound || poses < 100) {
    std::fprintf(stderr, "usage: bench/run correction [--poses N] [--no-times]      N at least 100; %d without it\n",
                 sixpoint::bench::kPoses);
    return 2;
  }
  return sixpoint::bench::Run(poses, quiet);
}

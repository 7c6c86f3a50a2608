// Which two turns, one after the other, bring a direction onto another (docs/methods/correction.md, angles; Paden 1986, the
// second subproblem, with its degenerate cases).
//
// Angles in radians, by the right hand. Directions are unit vectors in one frame; how the two axes lie to each other is free, but
// for parallel ones. Pure and thread-safe; the same inputs give the same bits.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {

// A direction nearer than this to an axis is singular for it: the angle is then free, or as good as free (an error of the direction is
// multiplied by more than a thousand in it). Axes nearer to each other are taken as parallel.
inline constexpr double kSingularAngle_rad = 1e-3;
// Nearer than this to an axis, and where its angle would have to go farther than that from `near`, the angles may leave a tilt instead.
inline constexpr double kNearSingular_rad = 5 * kPi / 180;
inline constexpr double kLongSwing_rad = 3 * kPi / 180;
// A direction this near to an axis is along it: whatever the angle is, it leaves no more tilt.
inline constexpr double kAlongAxis_rad = 1e-10;
// Rounding of a direction: what misses by no more is reached.
inline constexpr double kReached_rad = 1e-12;

// R(first) R(second) from = onto: `from` meets the second turn first.
struct TwoTurns {
  Eigen::Vector3d first = Eigen::Vector3d::UnitY();
  Eigen::Vector3d second = Eigen::Vector3d::UnitX();
  bool Parallel() const;
};

struct TurnAngles {
  double first_rad = 0;
  double second_rad = 0;
};

struct TurnLimits {
  double first_minimum_rad = -std::numeric_limits<double>::infinity();
  double first_maximum_rad = std::numeric_limits<double>::infinity();
  double second_minimum_rad = -std::numeric_limits<double>::infinity();
  double second_maximum_rad = std::numeric_limits<double>::infinity();
};

enum class WhichTurn { kNone, kFirst, kSecond };

// What brings `from` onto `onto`, or nearest to it. Angles within half a turn.
struct TurnBranches {
  std::array<TurnAngles, 2> angles;
  int count = 0;  // 2; 1 where no angles reach it or an axis is free, whose angle is then what was given as `near`
  double miss_rad = 0;                // between `onto` and the nearest direction that is reached; 0 where it is reached
  WhichTurn free = WhichTurn::kNone;  // the axis that the direction lies along
  WhichTurn narrow = WhichTurn::kSecond;  // the axis that its direction is nearer to: the one that swings
  double narrow_sine = 1;                 // of the angle between them
};

// One that may be taken.
struct TurnChoice {
  TurnAngles angles;
  double tilt_rad = 0;  // left between the turned direction and `onto`
  WhichTurn loose =
      WhichTurn::kNone;  // the axis that is free, or stops short of its exact angle for a tilt that is allowed
};

// The nearest first.
struct TurnChoices {
  std::array<TurnChoice, 2> choices;
  int count = 0;
  TurnBranches branches;  // whatever the limits
};

// Angle about the unit axis that turns `from` onto `to`, both seen along the axis.
double AngleAbout(const Eigen::Vector3d& axis, const Eigen::Vector3d& from, const Eigen::Vector3d& to);
// The whole turn of the angle that lies within the limits, nearest to `near`; a limit that is met within 1e-12 is met.
std::optional<double> WithinLimits(double angle_rad, double near_rad, double minimum_rad, double maximum_rad);

Eigen::Vector3d Turned(const TwoTurns& turns, const TurnAngles& angles, const Eigen::Vector3d& from);
// Between `onto` and what `from` is turned to.
double TiltOf(const TwoTurns& turns, const Eigen::Vector3d& from, const Eigen::Vector3d& onto,
              const TurnAngles& angles);

// near: of the axis that is free.
TurnBranches BranchesOf(const TwoTurns& turns, const Eigen::Vector3d& from, const Eigen::Vector3d& onto,
                        const TurnAngles& near = {});

// One axis at its angle, the other at what leaves the least tilt, within half a turn.
TurnAngles WithHeld(const TwoTurns& turns, const Eigen::Vector3d& from, const Eigen::Vector3d& onto, WhichTurn held,
                    double held_rad);

// Of each branch the whole turn within the limits that is nearest to `near`, by the root of the sum of both angles' squares. What misses
// by no more than the allowed tilt counts as reached. Near an axis its angle goes no farther from `near` than it must for the tilt to be as
// allowed; along it it stays. None: the direction cannot be reached (branches.miss_rad), or not within the limits.
TurnChoices NearestTurns(const TwoTurns& turns, const Eigen::Vector3d& from, const Eigen::Vector3d& onto,
                         const TurnAngles& near, const TurnLimits& limits, double allowed_tilt_rad = 0);

}  // namespace sixpoint::metrology

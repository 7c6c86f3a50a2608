#include "metrology/surface/foot_lanes.h"

#include <algorithm>
#include <cmath>

#include "metrology/parallel/vectors.h"

namespace sixpoint::metrology {
namespace {

// A whole step goes too far by the distance over the surface's radius, which the step before tells (secant); bounded.
constexpr double kLeastTurn = 0.1, kLeastStride = 0.05, kGreatestStride = 2;

template <typename Doubles>
SIXPOINT_INLINE Doubles SquareRoots(Doubles of) {
  for (std::size_t k = 0; k < sizeof(Doubles) / sizeof(double); ++k) of[k] = std::sqrt(of[k]);
  return of;
}

template <typename Width>
SIXPOINT_INLINE void Look(std::size_t count, FootLanes* lanes) {
  using Doubles = typename Width::Doubles;
  for (std::size_t i = 0; i < count; i += Width::kDoubles) {
    PatchNumbers<Doubles> patch;
    Load(lanes->patch.corner_mm, i, patch.corner_mm);
    Load(lanes->patch.unit_normal, i, patch.unit_normal);
    Load(lanes->patch.dual_1, i, patch.dual_1);
    Load(lanes->patch.dual_2, i, patch.dual_2);
    Load(lanes->patch.edge_1_mm, i, patch.edge_1_mm);
    Load(lanes->patch.edge_2_mm, i, patch.edge_2_mm);
    Load(lanes->patch.height_mm, i, patch.height_mm);
    Doubles barycentric[3], query[3], off[3], aside[3];
    Load(lanes->barycentric, i, barycentric);
    Load(lanes->query, i, query);
    PatchPoint<Doubles> at = PointOf(patch, barycentric);
    const Doubles length = SquareRoots(Product(at.normal, at.normal));
    for (int k = 0; k < 3; ++k) {
      at.normal[k] = at.normal[k] / length;
      off[k] = query[k] - at.point_mm[k];
    }
    const Doubles along = Product(off, at.normal);
    for (int k = 0; k < 3; ++k) aside[k] = off[k] - along * at.normal[k];
    Store(at.point_mm, i, lanes->point_mm);
    Store(at.normal, i, lanes->normal);
    Store(aside, i, lanes->aside_mm);
    Store(along, i, lanes->along_mm);
    Store(Product(aside, aside), i, lanes->aside_squared);
  }
}

template <typename Width>
SIXPOINT_INLINE void Step(std::size_t count, FootLanes* lanes) {
  using Doubles = typename Width::Doubles;
  const Doubles zero{};
  for (std::size_t i = 0; i < count; i += Width::kDoubles) {
    Doubles aside[3], last[3], barycentric[3], least[3], by[3];
    Load(lanes->aside_mm, i, aside);
    Load(lanes->last_aside, i, last);
    Load(lanes->barycentric, i, barycentric);
    Load(lanes->least_barycentric, i, least);
    Doubles aside_squared, last_squared, stride, is_near;
    Load(lanes->aside_squared, i, aside_squared);
    Load(lanes->last_aside_squared, i, last_squared);
    Load(lanes->stride, i, stride);
    Load(lanes->is_near, i, is_near);
    Doubles turn = 1. - Product(aside, last) / last_squared;
    turn = turn > kLeastTurn ? turn : zero + kLeastTurn;
    Doubles learnt = stride / turn;
    learnt = learnt < kLeastStride ? zero + kLeastStride : learnt;
    learnt = learnt > kGreatestStride ? zero + kGreatestStride : learnt;
    stride = is_near * last_squared > 0. ? learnt : stride;
    PatchNumbers<Doubles> patch;
    Load(lanes->patch.dual_1, i, patch.dual_1);
    Load(lanes->patch.dual_2, i, patch.dual_2);
    StepOf(patch, aside, by);
    for (int k = 0; k < 3; ++k) barycentric[k] = barycentric[k] + stride * by[k];
    Store(barycentric, i, lanes->next);
    for (int k = 0; k < 3; ++k) barycentric[k] = barycentric[k] < least[k] ? least[k] : barycentric[k];
    const Doubles sum = (barycentric[0] + barycentric[1]) + barycentric[2];
    for (int k = 0; k < 3; ++k) barycentric[k] = barycentric[k] / sum;
    Store(barycentric, i, lanes->barycentric);
    Store(aside, i, lanes->last_aside);
    Store(aside_squared, i, lanes->last_aside_squared);
    Store(stride, i, lanes->stride);
  }
}

void LookFour(std::size_t count, FootLanes* lanes) { Look<Four>(count, lanes); }
void StepFour(std::size_t count, FootLanes* lanes) { Step<Four>(count, lanes); }
SIXPOINT_EIGHT void LookEight(std::size_t count, FootLanes* lanes) { Look<Eight>(count, lanes); }
SIXPOINT_EIGHT void StepEight(std::size_t count, FootLanes* lanes) { Step<Eight>(count, lanes); }
SIXPOINT_SIXTEEN void LookSixteen(std::size_t count, FootLanes* lanes) { Look<Sixteen>(count, lanes); }
SIXPOINT_SIXTEEN void StepSixteen(std::size_t count, FootLanes* lanes) { Step<Sixteen>(count, lanes); }

template <std::size_t count>
void Put(const double (&numbers)[count], std::size_t lane, LaneRow (&rows)[count]) {
  for (std::size_t k = 0; k < count; ++k) rows[k].at[lane] = numbers[k];
}

}  // namespace

void FootLanes::SetPatch(std::size_t lane, const PatchNumbers<double>& numbers) {
  Put(numbers.corner_mm, lane, patch.corner_mm);
  Put(numbers.unit_normal, lane, patch.unit_normal);
  Put(numbers.dual_1, lane, patch.dual_1);
  Put(numbers.dual_2, lane, patch.dual_2);
  Put(numbers.edge_1_mm, lane, patch.edge_1_mm);
  Put(numbers.edge_2_mm, lane, patch.edge_2_mm);
  Put(numbers.height_mm, lane, patch.height_mm);
}

void FootLanes::SetQuery(std::size_t lane, const Eigen::Vector3d& query_mm) {
  for (int k = 0; k < 3; ++k) query[k].at[lane] = query_mm[k];
}

void FootLanes::SetBarycentric(std::size_t lane, const Eigen::Vector3d& coordinates) {
  for (int k = 0; k < 3; ++k) barycentric[k].at[lane] = coordinates[k];
}

FootSteps FootStepsOf(LaneWidth width) {
  return OfWidth<FootSteps>(width, {LookFour, StepFour}, {LookEight, StepEight}, {LookSixteen, StepSixteen});
}

}  // namespace sixpoint::metrology

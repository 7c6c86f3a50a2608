#include "metrology/surface/curved_foot.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "metrology/mesh/cubic_patch.h"
#include "metrology/surface/foot_lanes.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Steps of a foot along the patch: where the surface's radius is near the distance (a trailing edge) they shrink slowly. The
// distance is off by the square of what is left, over the radius.
constexpr int kLeastSteps = 2, kMostSteps = 12;
constexpr double kSettledMm = 2e-5;
// Nearer than this a foot is followed over its triangle's edge: it may leave the triangle by so much (barycentric) before
// it is the next one's. Farther off it stays by its triangle.
constexpr double kCurvedMm = 0.1, kOvershoot = 0.05, kFarOvershoot = 0.25, kFarthestOvershoot = 4;
constexpr int kMostCrossings = 16;
constexpr std::size_t kKeptPatches = 64;

Vector3d VectorOf(const LaneRow (&rows)[3], std::size_t lane) {
  return {rows[0].at[lane], rows[1].at[lane], rows[2].at[lane]};
}

}  // namespace

std::optional<CubicPatch> CurvedSurface::PatchOver(std::uint32_t triangle) const {
  const TriangleCorners& c = mesh_.triangles[triangle];
  const auto& n = mesh_.corner_normals[triangle];
  return CubicPatch::Over({vertices_mm_[c[0]], vertices_mm_[c[1]], vertices_mm_[c[2]]},
                          {n[0].cast<double>(), n[1].cast<double>(), n[2].cast<double>()});
}

// Those of the triangles that feet stood over last: neighbours share them.
class CurvedSurface::Patches {
 public:
  Patches(const CurvedSurface& surface, std::size_t kept) : surface_(surface), kept_(kept) {}
  const std::optional<CubicPatch>& Over(std::uint32_t triangle) {
    Kept& kept = kept_[triangle % kept_.size()];
    if (kept.triangle != triangle) kept = {triangle, surface_.PatchOver(triangle)};
    return kept.patch;
  }

 private:
  struct Kept {
    std::uint32_t triangle = NearestTriangle::kNone;
    std::optional<CubicPatch> patch;
  };
  const CurvedSurface& surface_;
  std::vector<Kept> kept_;
};

// Each lane slides a foot along the curved surface until its query stands on its normal: into the next triangle where the edge is
// smooth (facets near to each other as slivers are may each be nearest to a point over another), not over a crease. A lane whose
// foot is found takes the next query.
class CurvedSurface::Slide {
 public:
  Slide(const CurvedSurface& surface, std::size_t kept) : surface_(surface), patches_(surface, kept) {}

  void Find(const Vector3d* queries, const NearestTriangle* nearest, const std::uint32_t* indices, std::size_t count,
            std::optional<CurvedFoot>* feet) {
    queries_ = queries;
    nearest_ = nearest;
    feet_ = feet;
    const FootSteps steps = FootStepsOf(UsedLaneWidth());
    std::size_t begun = 0, in_use = 0;
    for (std::size_t lane = 0; lane < LaneRow::kLanes; ++lane)
      if (Begin(lane, indices, count, &begun)) in_use = lane + 1;
    while (in_use > 0) {
      steps.look(in_use, &lanes_);
      for (std::size_t lane = 0; lane < in_use; ++lane) Judge(&states_[lane], lane);
      steps.step(in_use, &lanes_);
      const std::size_t were_in_use = std::exchange(in_use, 0);
      for (std::size_t lane = 0; lane < were_in_use; ++lane) {
        if (states_[lane].slides)
          GoOn(&states_[lane], lane);
        else
          Begin(lane, indices, count, &begun);
        if (states_[lane].slides) in_use = lane + 1;
      }
    }
  }

 private:
  struct State {
    bool slides = false;
    std::uint32_t index, triangle;
    bool is_near;
    int step, crossings;
    double least_aside;
    double overshoot() const { return is_near ? kOvershoot : kFarOvershoot; }
  };

  // The next query that has a patch under it; false where none is left.
  bool Begin(std::size_t lane, const std::uint32_t* indices, std::size_t count, std::size_t* begun) {
    State& state = states_[lane];
    state.slides = false;
    while (*begun < count) {
      const std::uint32_t index = indices[(*begun)++];
      const NearestTriangle& nearest = nearest_[index];
      const std::optional<CubicPatch>& patch = patches_.Over(nearest.triangle);
      if (!patch) continue;
      state = {true, index, nearest.triangle, nearest.distance_squared < kCurvedMm * kCurvedMm, 0, 0, kInfinity};
      lanes_.SetQuery(lane, queries_[index]);
      lanes_.SetBarycentric(lane, nearest.barycentric);
      lanes_.is_near.at[lane] = state.is_near;
      lanes_.last_aside_squared.at[lane] = 0;
      lanes_.stride.at[lane] = 1;
      Stand(*patch, state, lane);
      return true;
    }
    return false;
  }

  void Stand(const CubicPatch& patch, const State& state, std::size_t lane) {
    lanes_.SetPatch(lane, patch.numbers());
    for (int edge = 0; edge < 3; ++edge)
      lanes_.least_barycentric[edge].at[lane] =
          surface_.seams_.seam(state.triangle, edge) == kSmooth ? -state.overshoot() : 0.0;
  }

  // Keeps what was found and ends the lane where it is the foot.
  void Judge(State* state, std::size_t lane) {
    if (!state->slides) return;
    // Deeper than the surface's radius the steps grow: the foot that was nearest to settling stays.
    const double aside = lanes_.aside_squared.at[lane];
    const bool grows = !(aside < (state->step > kLeastSteps ? state->least_aside : kInfinity));
    if (!grows) {
      feet_[state->index] = {VectorOf(lanes_.point_mm, lane), VectorOf(lanes_.normal, lane), lanes_.along_mm.at[lane]};
      state->least_aside = aside;
    }
    state->slides = !(grows || state->step >= (state->is_near ? kMostSteps : kLeastSteps) ||
                      (state->step >= kLeastSteps && aside < kSettledMm * kSettledMm));
  }

  // Over the edge that the step went beyond, if it may.
  void GoOn(State* state, std::size_t lane) {
    ++state->step;
    const double low = -state->overshoot();
    const LaneRow(&next)[3] = lanes_.next;
    if (!(next[0].at[lane] < low || next[1].at[lane] < low || next[2].at[lane] < low)) return;
    int edge;
    VectorOf(next, lane).minCoeff(&edge);
    if (!state->is_near || state->crossings >= kMostCrossings || surface_.seams_.seam(state->triangle, edge) != kSmooth)
      return;
    const std::uint32_t beyond = surface_.seams_.beyond(state->triangle, edge);
    const std::optional<CubicPatch>& patch = patches_.Over(beyond);
    if (!patch) return;
    // No farther than some of the triangle's widths beyond it: a cubic is not to be followed into the distance.
    const Vector3d to_mm = VectorOf(lanes_.point_mm, lane) + lanes_.stride.at[lane] * VectorOf(lanes_.aside_mm, lane);
    const Vector3d barycentric = patch->Barycentric(to_mm).cwiseMax(-kFarthestOvershoot);
    lanes_.SetBarycentric(lane, barycentric / barycentric.sum());
    state->triangle = beyond;
    ++state->crossings;
    state->step = 0;
    Stand(*patch, *state, lane);
  }

  const CurvedSurface& surface_;
  const Vector3d* queries_ = nullptr;
  const NearestTriangle* nearest_ = nullptr;
  std::optional<CurvedFoot>* feet_ = nullptr;
  Patches patches_;
  std::array<State, LaneRow::kLanes> states_;
  FootLanes lanes_{};
};

std::optional<CurvedFoot> CurvedSurface::FootOf(const Vector3d& query, const NearestTriangle& nearest) const {
  std::optional<CurvedFoot> foot;
  constexpr std::uint32_t kOnly = 0;
  Slide(*this, 1).Find(&query, &nearest, &kOnly, 1, &foot);
  return foot;
}

FootFinder::FootFinder(const CurvedSurface& surface)
    : slide_(std::make_unique<CurvedSurface::Slide>(surface, kKeptPatches)) {}
FootFinder::~FootFinder() = default;

void FootFinder::Find(const Vector3d* queries, const NearestTriangle* nearest, const std::uint32_t* indices,
                      std::size_t count, std::optional<CurvedFoot>* feet) {
  slide_->Find(queries, nearest, indices, count, feet);
}

}  // namespace sixpoint::metrology

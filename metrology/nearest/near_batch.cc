#include "metrology/nearest/near_batch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace sixpoint::metrology {
namespace {

// Points of no cell are measured together where they are several, and in cell widths near to each other and to the surface:
// else too many triangles may be the nearest.
constexpr std::size_t kWorthTogether = 4;
constexpr std::uint32_t kItemsAhead = 8, kShapesAhead = 4;  // fetched early
constexpr double kWidestTogether = 1, kFarthestTogether = 4;

// Queries with those triangles that may be their nearest, several at a time: TakeNearer of each.
class PairTaker {
 public:
  PairTaker(const TriangleTree& tree, const Eigen::Vector3d* queries, PairLanes* lanes, NearestTriangle* nearest)
      : tree_(tree), queries_(queries), lanes_(lanes), nearest_(nearest), measure_(MeasurePairsOf(UsedLaneWidth())) {}

  void Take(std::uint32_t query, std::uint32_t item) {
    lanes_->Set(count_, queries_[query], tree_.vertices(), tree_.items()[item]);
    pairs_[count_] = {query, item};
    if (++count_ == LaneRow::kLanes) Flush();
  }
  void Flush() {
    measure_(count_, lanes_);
    for (std::size_t lane = 0; lane < count_; ++lane) {
      const auto [query, item] = pairs_[lane];
      const NearestTriangle found = lanes_->Found(lane, tree_.items()[item]);
      if (IsNearer(found, nearest_[query])) nearest_[query] = found;
    }
    count_ = 0;
  }

 private:
  const TriangleTree& tree_;
  const Eigen::Vector3d* queries_;
  PairLanes* lanes_;
  NearestTriangle* nearest_;
  MeasurePairs measure_;
  std::array<std::pair<std::uint32_t, std::uint32_t>, LaneRow::kLanes> pairs_;
  std::size_t count_ = 0;
};

}  // namespace

NearBatch::NearBatch(const TriangleTree& tree, const NearCells& cells)
    : tree_(tree), cells_(cells), lanes_(std::make_unique<NearLanes>()), pairs_(std::make_unique<PairLanes>()) {}

void NearBatch::Find(std::uint32_t cell, const Eigen::Vector3d* queries, std::size_t count, double limit_squared,
                     NearestTriangle* nearest) {
  FindAmong(cells_.CandidatesOf(cell), queries, count, limit_squared, nearest);
}

void NearBatch::FindAround(const Eigen::Vector3d* queries, std::size_t count, double limit_squared, std::uint32_t hint,
                           NearestTriangle* nearest) {
  const auto one_by_one = [&] { tree_.FindEach(queries, count, limit_squared, hint, nearest); };
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < count; ++i) box.extend(queries[i]);
  const Eigen::Vector3d centre = box.center();
  const double radius_mm = 0.5 * box.diagonal().norm();
  if (count < kWorthTogether || !(radius_mm < kWidestTogether * cells_.cell_width_mm())) return one_by_one();
  // Whoever is nearest to a query is no farther from the centre than this.
  const double farthest_mm = (std::sqrt(limit_squared) + radius_mm) * (1 + 1e-12);
  const NearestTriangle of_centre = tree_.Find(centre, farthest_mm * farthest_mm, hint);
  const double distance_mm = std::sqrt(of_centre.distance_squared);
  if (!(distance_mm < kFarthestTogether * cells_.cell_width_mm())) return one_by_one();
  tree_.FindAbout(box, std::min(std::sqrt(limit_squared), distance_mm + radius_mm) * (1 + 1e-12), &items_);
  if (items_.empty()) {
    std::fill(nearest, nearest + count, NearestTriangle{});
    return;
  }
  while (items_.size() % kCandidateGroup != 0) items_.push_back(items_.front());
  group_distances_mm_.assign(items_.size() / kCandidateGroup, 0);  // all are looked up
  about_.Clear();
  about_.Add(items_, group_distances_mm_);
  FindAmong({centre, static_cast<float>(radius_mm), about_[0]}, queries, count, limit_squared, nearest);
}

float NearBatch::LayOut(const Candidates& candidates, const Eigen::Vector3d* queries, std::size_t count) {
  NearLanes& lanes = *lanes_;
  width_ = (count + NearLanes::kMultiple - 1) / NearLanes::kMultiple * NearLanes::kMultiple;
  float from_centre = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f q = (queries[i] - candidates.centre).cast<float>();
    lanes.Set(i, q.x(), q.y(), q.z());
    from_centre = std::max(from_centre, q.squaredNorm());
  }
  for (std::size_t i = count; i < width_; ++i) lanes.Set(i, 0, 0, 0);
  return std::sqrt(from_centre) * (1 + 1e-5f);
}

NearBatch::Measured NearBatch::Measure(const Candidates& candidates, float from_centre, std::size_t count) {
  const MeasureTriangle measure = MeasureOf(UsedLaneWidth());
  NearLanes& lanes = *lanes_;
  const CandidateList& list = candidates.list;
  const std::uint32_t item_count = list.item_count();
  const std::size_t blocks = width_ / NearLanes::kMultiple;
  if (squared_.size() < item_count * blocks) squared_.resize(item_count * blocks);
  if (tolerances_.size() < item_count) tolerances_.resize(item_count);
  const auto fetch = [&](std::uint32_t item) {
    __builtin_prefetch(&cells_.shape(item));
    __builtin_prefetch(&tree_.corner(tree_.items()[item], 0));
  };
  for (std::uint32_t k = 0; k < std::min(kItemsAhead, item_count); ++k)
    __builtin_prefetch(&tree_.items()[list.item(k)]);
  for (std::uint32_t k = 0; k < std::min(kShapesAhead, item_count); ++k) fetch(list.item(k));
  Measured measured;
  for (std::uint32_t group = 0; group < list.group_count; ++group) {
    const float at_least = list.group_distance_mm(group) - from_centre - 2 * measured.tolerance;
    if (at_least > 0) {
      const float farthest = *std::max_element(lanes.least, lanes.least + count);
      if (at_least * at_least * (1 - 1e-6f) > farthest) break;
    }
    for (std::uint32_t k = 0; k < kCandidateGroup; ++k) {
      const std::uint32_t used = measured.used++;
      const std::uint32_t item = list.item(used);
      const TriangleShape& shape = cells_.shape(item);
      if (used + kItemsAhead < item_count) __builtin_prefetch(&tree_.items()[list.item(used + kItemsAhead)]);
      if (used + kShapesAhead < item_count) fetch(list.item(used + kShapesAhead));
      const Eigen::Vector3f a = (tree_.corner(tree_.items()[item], 0) - candidates.centre).cast<float>();
      tolerances_[used] = ToleranceOf(shape, a, candidates.width_mm);
      measured.tolerance = std::max(measured.tolerance, tolerances_[used]);
      measure(shape, a.x(), a.y(), a.z(), used, count, &lanes, &squared_[used * blocks]);
    }
  }
  return measured;
}

void NearBatch::FindAmong(const Candidates& candidates, const Eigen::Vector3d* queries, std::size_t count,
                          double limit_squared, NearestTriangle* nearest) {
  const float from_centre = LayOut(candidates, queries, count);
  const auto [used, tolerance] = Measure(candidates, from_centre, count);
  PairTaker taker(tree_, queries, pairs_.get(), nearest);
  const std::size_t blocks = width_ / NearLanes::kMultiple;
  for (std::uint32_t i = 0; i < count; ++i) {
    nearest[i] = {};
    nearest[i].distance_squared = limit_squared;
    if (used == 0) continue;
    // The nearest is no farther than this, and each no nearer than its own tolerance leaves open: a sliver's is no other's.
    const float most = std::sqrt(lanes_->least[i]) + tolerances_[lanes_->nearest[i]];
    const auto may_be_within = [most](float squared, float its_tolerance) {
      const float within = most + its_tolerance;
      return squared <= within * within * (1 + 1e-6f);
    };
    if (!may_be_within(lanes_->second[i], tolerance)) {
      taker.Take(i, candidates.list.item(lanes_->nearest[i]));
      continue;
    }
    for (std::uint32_t k = 0; k < used; ++k) {
      const float squared = squared_[k * blocks + i / NearLanes::kMultiple].at[i % NearLanes::kMultiple];
      if (may_be_within(squared, tolerances_[k])) taker.Take(i, candidates.list.item(k));
    }
  }
  taker.Flush();
}

}  // namespace sixpoint::metrology

#include "metrology/nearest/nearest_search.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "metrology/nearest/near_batch.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kNearMm = 0.1;  // what the near cells cover: more than a converged fit reaches

}  // namespace

NearestSearch::NearestSearch(const Points& vertices_mm, const std::vector<TriangleCorners>& triangles)
    : tree_(vertices_mm, triangles) {}

NearestTriangle NearestSearch::Find(const Vector3d& point_mm, double limit_mm, std::uint32_t hint) const {
  if (!IsSomewhere(point_mm) || !(limit_mm >= 0)) return {};
  return tree_.Find(point_mm, limit_mm * limit_mm, hint);
}

void NearestSearch::PrepareNear(int thread_count) const {
  std::call_once(near_once_, [&] {
    near_ = std::make_unique<const NearCells>(tree_, kNearMm, thread_count);
    near_ready_ = near_.get();
  });
}

std::size_t NearestSearch::memory_bytes() const {
  const NearCells* near = near_ready_.load();
  return tree_.memory_bytes() + (near == nullptr ? 0 : near->memory_bytes());
}

NearestSearch::Many::Many(const NearestSearch& search, std::uint32_t count, PointsAt points_at, double limit_mm,
                          int thread_count)
    : tree_(search.tree_),
      near_(search.near_ready_.load()),
      points_at_(std::move(points_at)),
      limit_mm_(limit_mm),
      order_(OrderOf(near_, points_at_, count, FarMatter(), thread_count)) {}

class NearestSearch::Many::Visitor {
 public:
  Visitor(const Many& many, std::size_t from) : many_(many) {
    if (many.near_ == nullptr) return;
    batch_.emplace(many.tree_, *many.near_);
    run_ = std::upper_bound(many.order_.runs.begin(), many.order_.runs.end(), from,
                            [](std::size_t at, const PointOrder::Run& run) { return at < run.first; }) -
           1;
  }

  // How many of the points that follow at `at` are looked up together: they lie in one cell, or in one place.
  std::size_t CountTogether(std::size_t at, const Vector3d* points, std::size_t most) {
    static_assert(kMostFound == NearBatch::kMostPoints);
    most = std::min(most, kMostFound);
    if (at < many_.order_.in_cells_count) {
      if (run_[1].first <= at) ++run_;
      return std::min<std::size_t>(most, run_[1].first - at);
    }
    if (!many_.FarMatter()) return most;
    const std::uint64_t place = PlaceOf(points[0]);
    const auto* end = std::find_if(points + 1, points + most, [&](const Vector3d& p) { return PlaceOf(p) != place; });
    return static_cast<std::size_t>(end - points);
  }

  void Find(std::size_t at, const Vector3d* points, std::size_t count, NearestTriangle* nearest) {
    std::fill_n(nearest, count, NearestTriangle{});
    if (many_.limit_mm_ >= 0) {
      const double limit_squared = many_.limit_mm_ * many_.limit_mm_;
      if (at < many_.order_.in_cells_count)
        batch_->Find(run_->cell, points, count, limit_squared, nearest);
      else if (many_.FarMatter() && IsSomewhere(points[0]))
        FindFar(points, count, limit_squared, nearest);
    }
    if (nearest[count - 1].triangle != NearestTriangle::kNone) hint_ = nearest[count - 1].triangle;
  }

 private:
  void FindFar(const Vector3d* points, std::size_t count, double limit_squared, NearestTriangle* nearest) {
    if (batch_) return batch_->FindAround(points, count, limit_squared, hint_, nearest);
    many_.tree_.FindEach(points, count, limit_squared, hint_, nearest);
  }

  const Many& many_;
  std::optional<NearBatch> batch_;
  std::vector<PointOrder::Run>::const_iterator run_;  // of the point at hand, while it lies in a cell
  std::uint32_t hint_ = NearestTriangle::kNone;
};

void NearestSearch::Many::Visit(std::size_t from, std::size_t to, const std::function<void(const Found&)>& take) const {
  Visitor visitor(*this, from);
  std::array<Vector3d, kFetchedAtOnce> points;
  std::array<NearestTriangle, kMostFound> nearest;
  for (std::size_t fetched = from; fetched < to; fetched += kFetchedAtOnce) {
    const std::size_t end = std::min(to, fetched + kFetchedAtOnce);
    points_at_(&order_.order[fetched], end - fetched, points.data());
    // Where few points share a cell, those of several cells are handed on together: whoever takes them works in lanes too.
    std::size_t taken = fetched;
    const auto hand_on = [&](std::size_t until) {
      if (until > taken) take({&order_.order[taken], &points[taken - fetched], nearest.data(), until - taken});
      taken = until;
    };
    for (std::size_t at = fetched, count; at < end; at += count) {
      count = visitor.CountTogether(at, &points[at - fetched], end - at);
      if (at + count - taken > kMostFound) hand_on(at);
      visitor.Find(at, &points[at - fetched], count, &nearest[at - taken]);
    }
    hand_on(end);
  }
}

}  // namespace sixpoint::metrology

#include "metrology/surface/near_batch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kLanes = 16;  // the points of a cell are padded to a multiple
// Points of no cell are measured together where they are several, and in cell widths near to each other and to the surface:
// else too many triangles may be the nearest.
constexpr std::size_t kWorthTogether = 4;
constexpr std::uint32_t kShapesAhead = 4;  // fetched early
constexpr double kWidestTogether = 1, kFarthestTogether = 4;

}  // namespace

struct NearBatch::Lanes {
  alignas(64) float x[kMostPoints], y[kMostPoints], z[kMostPoints];  // about the cell's centre
  alignas(64) float least[kMostPoints], second[kMostPoints];         // squared distances
  alignas(64) std::uint32_t nearest[kMostPoints];                    // candidate
};

namespace {

using Shape = NearCells::Shape;
using Lanes = NearBatch::Lanes;

// Squared distances of the points to a triangle with its corner at a: to the plane where the foot is inside, else to the
// nearest edge.
inline __attribute__((always_inline)) void MeasureLanes(const Shape& t, float ax, float ay, float az,
                                                        std::uint32_t candidate, std::size_t count,
                                                        Lanes* __restrict lanes, float* __restrict squared) {
  const auto clamped = [](float at) {
    at = at > 0.f ? at : 0.f;
    return at < 1.f ? at : 1.f;
  };
  const float ex = t.cx - t.bx, ey = t.cy - t.by, ez = t.cz - t.bz;
  const float per_bb = 1 / (t.bx * t.bx + t.by * t.by + t.bz * t.bz), per_ee = 1 / (ex * ex + ey * ey + ez * ez);
  const float per_cc = 1 / (t.cx * t.cx + t.cy * t.cy + t.cz * t.cz);
  for (std::size_t i = 0; i < count; ++i) {
    const float px = lanes->x[i] - ax, py = lanes->y[i] - ay, pz = lanes->z[i] - az;
    const float b = clamped((px * t.bx + py * t.by + pz * t.bz) * per_bb);
    const float c = clamped((px * t.cx + py * t.cy + pz * t.cz) * per_cc);
    const float qx = px - t.bx, qy = py - t.by, qz = pz - t.bz;
    const float e = clamped((qx * ex + qy * ey + qz * ez) * per_ee);
    const float b1 = px - b * t.bx, b2 = py - b * t.by, b3 = pz - b * t.bz;
    const float c1 = px - c * t.cx, c2 = py - c * t.cy, c3 = pz - c * t.cz;
    const float e1 = qx - e * ex, e2 = qy - e * ey, e3 = qz - e * ez;
    const float to_b = b1 * b1 + b2 * b2 + b3 * b3, to_c = c1 * c1 + c2 * c2 + c3 * c3;
    const float to_e = e1 * e1 + e2 * e2 + e3 * e3;
    float to_edge = to_b < to_c ? to_b : to_c;
    to_edge = to_e < to_edge ? to_e : to_edge;
    const float v = px * t.vx + py * t.vy + pz * t.vz, w = px * t.wx + py * t.wy + pz * t.wz;
    const float height = px * t.nx + py * t.ny + pz * t.nz;
    const float lower = v < w ? v : w, third = 1.f - v - w;
    const float inside = lower < third ? lower : third;
    const float d = inside >= 0.f ? height * height : to_edge;
    squared[i] = d;
    const float least = lanes->least[i], second = lanes->second[i];
    const float greater = d > least ? d : least;
    lanes->second[i] = greater < second ? greater : second;
    lanes->nearest[i] = d < least ? candidate : lanes->nearest[i];
    lanes->least[i] = d < least ? d : least;
  }
}

using MeasureTriangle = void (*)(const Shape&, float, float, float, std::uint32_t, std::size_t, Lanes*, float*);

void MeasurePlain(const Shape& t, float ax, float ay, float az, std::uint32_t candidate, std::size_t count,
                  Lanes* lanes, float* squared) {
  MeasureLanes(t, ax, ay, az, candidate, count, lanes, squared);
}
#ifdef __x86_64__
__attribute__((target("avx2,fma"))) void MeasureEight(const Shape& t, float ax, float ay, float az,
                                                      std::uint32_t candidate, std::size_t count, Lanes* lanes,
                                                      float* squared) {
  MeasureLanes(t, ax, ay, az, candidate, count, lanes, squared);
}
__attribute__((target("avx512f,avx512vl,avx512dq,fma,prefer-vector-width=512"))) void MeasureSixteen(
    const Shape& t, float ax, float ay, float az, std::uint32_t candidate, std::size_t count, Lanes* lanes,
    float* squared) {
  MeasureLanes(t, ax, ay, az, candidate, count, lanes, squared);
}
#endif

MeasureTriangle Widest() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) return MeasureSixteen;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return MeasureEight;
#endif
  return MeasurePlain;
}

}  // namespace

CellOrder PutInCells(const NearCells& cells, const QueriesAt& queries_at, std::size_t count, int thread_count) {
  const auto cell_count = static_cast<std::uint32_t>(cells.cell_count());
  std::vector<std::uint32_t> cell_of(count);
  std::vector<std::vector<std::uint32_t>> counts(PartCount(thread_count));
  InParts(count, thread_count, [&](std::size_t begin, std::size_t end, std::size_t part) {
    std::vector<std::uint32_t>& here = counts[part];
    here.assign(cell_count + 1, 0);
    std::array<Eigen::Vector3d, NearCells::kTogether> queries;
    for (std::size_t at = begin; at < end; at += queries.size()) {
      const std::size_t together = std::min(queries.size(), end - at);
      queries_at(static_cast<std::uint32_t>(at), together, queries.data());
      cells.CellsAt(queries.data(), together, &cell_of[at]);
      for (std::size_t i = at; i < at + together; ++i) ++here[cell_of[i] = std::min(cell_of[i], cell_count)];
    }
  });
  CellOrder cell_order;
  cell_order.first.resize(cell_count + 2);
  std::uint32_t sum = 0;
  for (std::uint32_t cell = 0; cell <= cell_count; ++cell) {
    cell_order.first[cell] = sum;
    for (std::vector<std::uint32_t>& of_part : counts) {
      const std::uint32_t here = of_part[cell];
      of_part[cell] = sum;
      sum += here;
    }
  }
  cell_order.first[cell_count + 1] = sum;
  cell_order.order.resize(count);
  InParts(count, thread_count, [&](std::size_t begin, std::size_t end, std::size_t part) {
    for (std::size_t i = begin; i < end; ++i)
      cell_order.order[counts[part][cell_of[i]]++] = static_cast<std::uint32_t>(i);
  });
  return cell_order;
}

NearBatch::NearBatch(const TriangleTree& tree, const NearCells& cells)
    : tree_(tree), cells_(cells), lanes_(std::make_unique<Lanes>()) {}
NearBatch::~NearBatch() = default;

void NearBatch::Find(std::uint32_t cell, const Eigen::Vector3d* queries, std::size_t count, double limit_squared,
                     TriangleTree::Nearest* nearest) {
  const double covered_mm = cells_.covered_mm(), covered_squared = covered_mm * covered_mm;
  const std::uint32_t first = cells_.first_[cell];
  const std::uint32_t* items = &cells_.items_[std::size_t{NearCells::kGroup} * first];
  const Candidates candidates{cells_.centre_mm(cell), cells_.cell_width_mm(), items, &cells_.group_distance_[first],
                              cells_.first_[cell + 1] - first};
  if (limit_squared <= covered_squared) return Measure(candidates, queries, count, limit_squared, nearest);
  // Beyond what is covered the cell does not know all candidates.
  std::array<Eigen::Vector3d, kMostPoints> far;
  std::array<std::uint32_t, kMostPoints> far_at;
  std::size_t far_count = 0;
  const auto is_far = [&](const Eigen::Vector3d& query) {
    const double nearer_mm = candidates.group_distance[0] - covered_mm;
    return nearer_mm > 0 && (query - candidates.centre).squaredNorm() < nearer_mm * nearer_mm;
  };
  if (!std::all_of(queries, queries + count, is_far)) {
    Measure(candidates, queries, count, covered_squared, nearest);
  } else {
    std::fill(nearest, nearest + count, TriangleTree::Nearest{});
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    if (nearest[i].triangle != TriangleTree::kNone) continue;
    far[far_count] = queries[i];
    far_at[far_count++] = i;
  }
  if (far_count == 0) return;
  std::array<TriangleTree::Nearest, kMostPoints> found;
  FindAround(far.data(), far_count, limit_squared, tree_.items()[items[0]].triangle, found.data());
  for (std::size_t i = 0; i < far_count; ++i) nearest[far_at[i]] = found[i];
}

void NearBatch::FindAround(const Eigen::Vector3d* queries, std::size_t count, double limit_squared, std::uint32_t hint,
                           TriangleTree::Nearest* nearest) {
  const auto one_by_one = [&] { tree_.FindEach(queries, count, limit_squared, hint, nearest); };
  Eigen::Vector3d low = queries[0], high = queries[0];
  for (std::size_t i = 1; i < count; ++i) {
    low = low.cwiseMin(queries[i]);
    high = high.cwiseMax(queries[i]);
  }
  const Eigen::Vector3d centre = 0.5 * (low + high);
  const double radius_mm = 0.5 * (high - low).norm();
  if (count < kWorthTogether || !(radius_mm < kWidestTogether * cells_.cell_width_mm())) return one_by_one();
  // Whoever is nearest to a query is no farther from the centre than this.
  const double farthest_mm = (std::sqrt(limit_squared) + radius_mm) * (1 + 1e-12);
  const TriangleTree::Nearest of_centre = tree_.Find(centre, farthest_mm * farthest_mm, hint);
  const double distance_mm = std::sqrt(of_centre.distance_squared);
  if (!(distance_mm < kFarthestTogether * cells_.cell_width_mm())) return one_by_one();
  tree_.FindWithin(centre, std::min(farthest_mm, (distance_mm + 2 * radius_mm) * (1 + 1e-12)), &within_);
  items_.clear();
  group_distance_.clear();
  const std::uint32_t group_count = NearCells::List(&within_, &items_, &group_distance_);
  Measure({centre, static_cast<float>(radius_mm), items_.data(), group_distance_.data(), group_count}, queries, count,
          limit_squared, nearest);
}

void NearBatch::Measure(const Candidates& candidates, const Eigen::Vector3d* queries, std::size_t count,
                        double limit_squared, TriangleTree::Nearest* nearest) {
  static const MeasureTriangle kMeasure = Widest();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Lanes& lanes = *lanes_;
  const std::size_t width = (count + kLanes - 1) / kLanes * kLanes;
  float from_centre = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f q = (queries[i] - candidates.centre).cast<float>();
    lanes.x[i] = q.x();
    lanes.y[i] = q.y();
    lanes.z[i] = q.z();
    from_centre = std::max(from_centre, q.squaredNorm());
  }
  for (std::size_t i = count; i < width; ++i) lanes.x[i] = lanes.y[i] = lanes.z[i] = 0;
  for (std::size_t i = 0; i < width; ++i) {
    lanes.least[i] = lanes.second[i] = kInfinity;
    lanes.nearest[i] = 0;
  }
  from_centre = std::sqrt(from_centre) * (1 + 1e-5f);

  const std::uint32_t *items = candidates.items, item_count = NearCells::kGroup * candidates.group_count;
  if (squared_.size() < item_count * width) squared_.resize(item_count * width);
  float tolerance = 0;
  std::uint32_t used = 0;
  for (std::uint32_t group = 0; group < candidates.group_count; ++group) {
    const float at_least = candidates.group_distance[group] - from_centre - 2 * tolerance;
    if (at_least > 0) {
      float farthest = 0;
      for (std::size_t i = 0; i < count; ++i) farthest = farthest > lanes.least[i] ? farthest : lanes.least[i];
      if (at_least * at_least * (1 - 1e-6f) > farthest) break;
    }
    for (std::uint32_t k = 0; k < NearCells::kGroup; ++k, ++used) {
      const Shape& shape = cells_.shapes_[items[used]];
      if (used + kShapesAhead < item_count) __builtin_prefetch(&cells_.shapes_[items[used + kShapesAhead]]);
      const Eigen::Vector3f a = (tree_.corner(tree_.items()[items[used]], 0) - candidates.centre).cast<float>();
      const float reach = std::abs(a.x()) + std::abs(a.y()) + std::abs(a.z()) + candidates.width_mm;
      const float size = std::max(std::abs(shape.bx) + std::abs(shape.by) + std::abs(shape.bz),
                                  std::abs(shape.cx) + std::abs(shape.cy) + std::abs(shape.cz));
      tolerance = std::max(tolerance, shape.rounding * (reach + size));
      kMeasure(shape, a.x(), a.y(), a.z(), used, width, &lanes, &squared_[used * width]);
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    nearest[i] = {};
    nearest[i].distance_squared = limit_squared;
    const float within = std::sqrt(lanes.least[i]) + 2 * tolerance, within_squared = within * within * (1 + 1e-6f);
    if (used > 0 && lanes.second[i] > within_squared) {
      tree_.Test(tree_.items()[items[lanes.nearest[i]]], queries[i], &nearest[i]);
    } else {
      for (std::uint32_t k = 0; k < used; ++k)
        if (squared_[k * width + i] <= within_squared) tree_.Test(tree_.items()[items[k]], queries[i], &nearest[i]);
    }
  }
}

}  // namespace sixpoint::metrology

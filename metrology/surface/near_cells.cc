#include "metrology/surface/near_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "metrology/surface/in_parts.h"

namespace sixpoint::metrology {
namespace {

constexpr int kKeyBits = 21;                         // of each coordinate
constexpr std::uint64_t kNoKey = ~std::uint64_t{1};  // of no cell
constexpr double kGreatestCellsAcross = (1 << kKeyBits) - 2;
// Cells of about the mean triangle's edge hold some tens of candidates.
constexpr double kEdgesPerCell = 1.4;
constexpr double kLeastCellMm = 0.02;
// Distances are compared in single precision first; what is nearer than the best by less than its rounding is measured
// exactly. Longer and thinner triangles round worse.
constexpr float kRounding = 4e-7f;

std::uint64_t KeyOf(const Eigen::Array3i& cell) {
  return static_cast<std::uint64_t>(cell[0]) << (2 * kKeyBits) | static_cast<std::uint64_t>(cell[1]) << kKeyBits |
         static_cast<std::uint64_t>(cell[2]);
}

Eigen::Array3i CellOf(std::uint64_t key) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kKeyBits) - 1;
  return {static_cast<int>(key >> (2 * kKeyBits)), static_cast<int>(key >> kKeyBits & kMask),
          static_cast<int>(key & kMask)};
}

std::size_t HashOf(std::uint64_t key) { return static_cast<std::size_t>((key * 0x9e3779b97f4a7c15ULL) >> 20); }

}  // namespace

Eigen::Vector3d NearCells::CentreOf(const Eigen::Array3i& cell) const {
  return low_mm_ + cell_mm_ * (cell.cast<double>() + 0.5).matrix();
}

namespace {

// Whether a triangle may touch the cube about the centre: its box does, and so does its plane.
bool Touches(const TriangleTree& tree, const TriangleTree::Item& item, const Eigen::Vector3d& centre, double half_mm) {
  const double half = half_mm * (1 + 1e-9);
  const Eigen::Vector3d a = tree.corner(item, 0) - centre, b = tree.corner(item, 1) - centre,
                        c = tree.corner(item, 2) - centre, ab = b - a, ac = c - a;
  if ((a.cwiseMin(b).cwiseMin(c).array() > half).any() || (a.cwiseMax(b).cwiseMax(c).array() < -half).any())
    return false;
  const Eigen::Vector3d normal = ab.cross(ac);
  // A sliver's plane is not known well enough to rule anything out.
  if (!(normal.squaredNorm() > 1e-6 * ab.squaredNorm() * ac.squaredNorm())) return true;
  return std::abs(normal.dot(a)) <= half * normal.lpNorm<1>() * (1 + 1e-6);
}

}  // namespace

NearCells::NearCells(const TriangleTree& tree, double covered_mm, int thread_count)
    : tree_(tree), covered_mm_(covered_mm) {
  const std::vector<TriangleTree::Item>& items = tree.items();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  double area = 0;
  shapes_.reserve(items.size());
  for (const TriangleTree::Item& item : items) {
    const Eigen::Vector3d &a = tree.corner(item, 0), &b = tree.corner(item, 1), &c = tree.corner(item, 2);
    area += 0.5 * (b - a).cross(c - a).norm();
    low = low.cwiseMin(a).cwiseMin(b).cwiseMin(c);
    high = high.cwiseMax(a).cwiseMax(b).cwiseMax(c);
    shapes_.push_back(ShapeOf(b - a, c - a));
  }
  const double edge_mm = std::sqrt(4 / std::sqrt(3.0) * area / static_cast<double>(items.size()));
  const double extent_mm = (high - low).maxCoeff() + 4 * covered_mm;
  cell_mm_ = std::max({kEdgesPerCell * edge_mm, kLeastCellMm, extent_mm / kGreatestCellsAcross * 1.01});
  per_cell_ = 1 / cell_mm_;
  const double radius_mm = 0.5 * std::sqrt(3.0) * cell_mm_;
  const double band_mm = covered_mm + radius_mm;  // of the centre of a cell that holds a covered point
  low_mm_ = low - Eigen::Vector3d::Constant(covered_mm + 2 * cell_mm_);

  // Cells that the boxes of triangles, widened, touch; then those whose centre is near indeed.
  std::vector<std::uint64_t> touched;
  for (const TriangleTree::Item& item : items) {
    const Eigen::Vector3d &a = tree.corner(item, 0), &b = tree.corner(item, 1), &c = tree.corner(item, 2);
    const Eigen::Array3d from = (a.cwiseMin(b).cwiseMin(c) - low_mm_).array() - covered_mm;
    const Eigen::Array3d to = (a.cwiseMax(b).cwiseMax(c) - low_mm_).array() + covered_mm;
    const Eigen::Array3i first = (from / cell_mm_).floor().cast<int>(), last = (to / cell_mm_).floor().cast<int>();
    for (int i = first[0]; i <= last[0]; ++i) {
      for (int j = first[1]; j <= last[1]; ++j) {
        for (int k = first[2]; k <= last[2]; ++k) touched.push_back(KeyOf({i, j, k}));
      }
    }
    if (touched.size() > (std::size_t{1} << 24)) {
      std::sort(touched.begin(), touched.end());
      touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    }
  }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());

  struct Part {
    std::vector<std::uint64_t> keys;
    std::vector<std::uint32_t> group_counts, items;
    std::vector<float> group_distance;
  };
  const auto part_count = static_cast<std::size_t>(std::max(1, thread_count));
  std::vector<Part> parts(part_count);
  InParts(touched.size(), part_count, [&](std::size_t begin, std::size_t end, std::size_t index) {
    Part& part = parts[index];
    std::vector<TriangleTree::Within> within;
    std::uint32_t hint = TriangleTree::kNone;
    for (std::size_t t = begin; t < end; ++t) {
      const Eigen::Vector3d centre = CentreOf(CellOf(touched[t]));
      const TriangleTree::Nearest nearest = tree_.Find(centre, band_mm * band_mm, hint);
      if (nearest.triangle == TriangleTree::kNone) continue;
      hint = nearest.triangle;
      // Whoever is nearest to a covered point of the cell is no farther from its centre than this, and touches the cell
      // grown by what is covered.
      const double reach_mm = std::min(std::sqrt(nearest.distance_squared) + 2 * radius_mm, band_mm) * (1 + 1e-12);
      tree_.FindWithin(centre, reach_mm, &within);
      within.erase(std::remove_if(within.begin(), within.end(),
                                  [&](const TriangleTree::Within& candidate) {
                                    return !Touches(tree_, items[candidate.item], centre, 0.5 * cell_mm_ + covered_mm);
                                  }),
                   within.end());
      if (within.empty()) continue;
      std::sort(within.begin(), within.end(), [](const TriangleTree::Within& x, const TriangleTree::Within& y) {
        return x.distance != y.distance ? x.distance < y.distance : x.item < y.item;
      });
      part.keys.push_back(touched[t]);
      const std::size_t groups = (within.size() + kGroup - 1) / kGroup;
      part.group_counts.push_back(static_cast<std::uint32_t>(groups));
      for (std::size_t g = 0; g < groups; ++g) {
        part.group_distance.push_back(static_cast<float>(within[g * kGroup].distance * (1 - 1e-6)));
        for (std::size_t i = g * kGroup; i < (g + 1) * kGroup; ++i) {
          part.items.push_back(within[std::min(i, within.size() - 1)].item);
        }
      }
    }
  });
  touched = {};
  std::vector<std::uint64_t> keys;
  std::size_t cell_count = 0, group_count = 0;
  for (const Part& part : parts) {
    cell_count += part.keys.size();
    group_count += part.group_distance.size();
  }
  keys.reserve(cell_count);
  first_.reserve(cell_count + 1);
  items_.reserve(kGroup * group_count);
  group_distance_.reserve(group_count);
  first_.push_back(0);
  for (Part& part : parts) {
    keys.insert(keys.end(), part.keys.begin(), part.keys.end());
    for (const std::uint32_t groups : part.group_counts) first_.push_back(first_.back() + groups);
    items_.insert(items_.end(), part.items.begin(), part.items.end());
    group_distance_.insert(group_distance_.end(), part.group_distance.begin(), part.group_distance.end());
    part = {};
  }
  std::size_t slots = 16;
  while (slots < 2 * keys.size()) slots *= 2;
  keys_.assign(slots, 0);
  cells_.assign(slots, kNoCell);
  for (std::uint32_t cell = 0; cell < keys.size(); ++cell) {
    std::size_t slot = HashOf(keys[cell]) & (slots - 1);
    while (keys_[slot] != 0) slot = (slot + 1) & (slots - 1);
    keys_[slot] = keys[cell] + 1;
    cells_[slot] = cell;
  }
  centres_mm_.reserve(keys.size());
  for (const std::uint64_t key : keys) centres_mm_.push_back(CentreOf(CellOf(key)));
}

void NearCells::CellsAt(const Eigen::Vector3d* points_mm, const Eigen::Vector3d& origin_mm, std::size_t count,
                        std::uint32_t* cells) const {
  // Some at a time: the table's lines are on their way before they are read.
  constexpr std::size_t kTogether = 32;
  std::array<std::uint64_t, kTogether> keys;
  for (std::size_t begin = 0; begin < count; begin += kTogether) {
    const std::size_t together = std::min(kTogether, count - begin);
    for (std::size_t i = 0; i < together; ++i) {
      const Eigen::Array3d at = ((points_mm[begin + i] - origin_mm - low_mm_) * per_cell_).array();
      const bool inside = (at >= 0).all() && (at < kGreatestCellsAcross).all();
      keys[i] = inside ? KeyOf(at.cast<int>()) : kNoKey;
      __builtin_prefetch(&keys_[HashOf(keys[i]) & (keys_.size() - 1)]);
    }
    for (std::size_t i = 0; i < together; ++i) cells[begin + i] = Find(keys[i]);
  }
}

std::uint32_t NearCells::Find(std::uint64_t key) const {
  for (std::size_t slot = HashOf(key) & (keys_.size() - 1); keys_[slot] != 0; slot = (slot + 1) & (keys_.size() - 1)) {
    if (keys_[slot] == key + 1) return cells_[slot];
  }
  return kNoCell;
}

std::size_t NearCells::memory_bytes() const {
  return shapes_.capacity() * sizeof(Shape) + keys_.capacity() * sizeof(std::uint64_t) +
         sizeof(std::uint32_t) *
             (cells_.capacity() + first_.capacity() + items_.capacity() + group_distance_.capacity()) +
         centres_mm_.capacity() * sizeof(Eigen::Vector3d);
}

NearCursor::Visit& NearCursor::Enter(std::uint64_t key, const Eigen::Array3i& cell) {
  Visit& visit = visits_[HashOf(key) & (kVisits - 1)];
  if (visit.key == key) return visit;
  visit.key = key;
  visit.cell = cells_->Find(key);
  visit.centre = cells_->CentreOf(cell);
  visit.groups.clear();
  return visit;
}

NearCells::Shape NearCells::ShapeOf(const Eigen::Vector3d& ab, const Eigen::Vector3d& ac) {
  const Eigen::Vector3d normal = ab.cross(ac);
  const double abab = ab.squaredNorm(), acac = ac.squaredNorm();
  const double twice_area = normal.norm();
  const Eigen::Vector3f b = ab.cast<float>(), c = ac.cast<float>(), n = (normal / twice_area).cast<float>();
  Shape shape{};
  shape.bx = b.x(), shape.by = b.y(), shape.bz = b.z();
  shape.cx = c.x(), shape.cy = c.y(), shape.cz = c.z();
  shape.nx = n.x(), shape.ny = n.y(), shape.nz = n.z();
  const Eigen::Vector3f v = (ac.cross(normal) / (twice_area * twice_area)).cast<float>();
  const Eigen::Vector3f w = (normal.cross(ab) / (twice_area * twice_area)).cast<float>();
  shape.vx = v.x(), shape.vy = v.y(), shape.vz = v.z();
  shape.wx = w.x(), shape.wy = w.y(), shape.wz = w.z();
  shape.per_bb = static_cast<float>(1 / abab);
  shape.per_cc = static_cast<float>(1 / acac);
  shape.per_ee = static_cast<float>(1 / (abab - 2 * ab.dot(ac) + acac));
  shape.per_area = static_cast<float>(1 / twice_area);
  const double thinness = std::sqrt(abab * acac) / twice_area;  // about 1 for a good triangle
  shape.rounding = static_cast<float>(kRounding * (1 + thinness));
  shape.size = static_cast<float>(std::sqrt(std::max(abab, acac)));
  return shape;
}

void NearCursor::Fill(std::uint32_t group, Visit* visit) const {
  Group& g = visit->groups.emplace_back();
  g.tolerance = 0;
  for (int i = 0; i < 4; ++i) {
    const std::uint32_t index = cells_->items_[NearCells::kGroup * group + static_cast<std::uint32_t>(i)];
    const NearCells::Shape& shape = cells_->shapes_[index];
    const Eigen::Vector3f a = (tree_.corner(tree_.items()[index], 0) - visit->centre).cast<float>();
    g.ax[i] = a.x();
    g.ay[i] = a.y();
    g.az[i] = a.z();
    g.bx[i] = shape.bx;
    g.by[i] = shape.by;
    g.bz[i] = shape.bz;
    g.cx[i] = shape.cx;
    g.cy[i] = shape.cy;
    g.cz[i] = shape.cz;
    g.nx[i] = shape.nx;
    g.ny[i] = shape.ny;
    g.nz[i] = shape.nz;
    g.per_bb[i] = shape.per_bb;
    g.per_cc[i] = shape.per_cc;
    g.per_ee[i] = shape.per_ee;
    g.per_area[i] = shape.per_area;
    const float reach = std::abs(a.x()) + std::abs(a.y()) + std::abs(a.z()) + static_cast<float>(cells_->cell_mm_);
    g.tolerance = std::max(g.tolerance, shape.rounding * (reach + shape.size));
  }
}

// Squared distances to the four triangles: to the plane where the foot is inside, else to the nearest edge.
void NearCursor::Measure(const Group& g, const Eigen::Vector3f& query, float* distances_squared) const {
  using Eigen::Array4f;
  const Array4f px = query.x() - g.ax, py = query.y() - g.ay, pz = query.z() - g.az;
  const auto segment = [](const Array4f& qx, const Array4f& qy, const Array4f& qz, const Array4f& ex, const Array4f& ey,
                          const Array4f& ez, const Array4f& per) -> Array4f {
    const Array4f t = ((qx * ex + qy * ey + qz * ez) * per).max(0.f).min(1.f);
    const Array4f dx = qx - t * ex, dy = qy - t * ey, dz = qz - t * ez;
    return dx * dx + dy * dy + dz * dz;
  };
  Array4f squared = segment(px, py, pz, g.bx, g.by, g.bz, g.per_bb);
  squared = squared.min(segment(px, py, pz, g.cx, g.cy, g.cz, g.per_cc));
  squared = squared.min(segment(px - g.bx, py - g.by, pz - g.bz, g.cx - g.bx, g.cy - g.by, g.cz - g.bz, g.per_ee));
  const Array4f v =
      ((py * g.cz - pz * g.cy) * g.nx + (pz * g.cx - px * g.cz) * g.ny + (px * g.cy - py * g.cx) * g.nz) * g.per_area;
  const Array4f w =
      ((g.by * pz - g.bz * py) * g.nx + (g.bz * px - g.bx * pz) * g.ny + (g.bx * py - g.by * px) * g.nz) * g.per_area;
  const Array4f height = px * g.nx + py * g.ny + pz * g.nz;
  squared = ((v >= 0.f) && (w >= 0.f) && (v + w <= 1.f)).select(height * height, squared);
  Eigen::Map<Array4f, Eigen::Aligned16> out(distances_squared);
  out = squared;
}

TriangleTree::Nearest NearCursor::Find(const Eigen::Vector3d& query, double limit_squared, std::uint32_t hint) {
  if (cells_ == nullptr) return tree_.Find(query, limit_squared, hint);
  const Eigen::Array3d at = ((query - cells_->low_mm_) * cells_->per_cell_).array();
  const bool inside = (at >= 0).all() && (at < kGreatestCellsAcross).all();
  Visit* visit = nullptr;
  if (inside) {
    const Eigen::Array3i cell = at.cast<int>();
    visit = &Enter(KeyOf(cell), cell);
  }
  if (visit == nullptr || visit->cell == NearCells::kNoCell) {
    TriangleTree::Nearest none;
    none.distance_squared = limit_squared;
    if (limit_squared <= cells_->covered_mm_ * cells_->covered_mm_) return none;
    return tree_.Find(query, limit_squared, hint);
  }
  const std::uint32_t first = cells_->first_[visit->cell], count = cells_->first_[visit->cell + 1] - first;
  const Eigen::Vector3f q = (query - visit->centre).cast<float>();
  const float from_centre = q.norm() * (1 + 1e-5f);
  if (distances_squared_.size() < NearCells::kGroup * count) distances_squared_.resize(NearCells::kGroup * count);
  float best = std::numeric_limits<float>::infinity();  // distance, with its tolerance
  std::uint32_t used = 0;
  for (; used < count; ++used) {
    if (cells_->group_distance_[first + used] - from_centre > best) break;
    if (used == visit->groups.size()) Fill(first + used, visit);
    float* squared = &distances_squared_[NearCells::kGroup * used];
    Measure(visit->groups[used], q, squared);
    const float least = std::min(std::min(squared[0], squared[1]), std::min(squared[2], squared[3]));
    best = std::min(best, std::sqrt(least) + visit->groups[used].tolerance);
  }
  TriangleTree::Nearest nearest;
  nearest.distance_squared = limit_squared;
  for (std::uint32_t g = 0; g < used; ++g) {
    const float reach = best + visit->groups[g].tolerance;
    for (std::uint32_t i = NearCells::kGroup * g; i < NearCells::kGroup * (g + 1); ++i) {
      if (distances_squared_[i] > reach * reach) continue;
      tree_.Test(tree_.items()[cells_->items_[NearCells::kGroup * first + i]], query, &nearest);
    }
  }
  // Beyond what is covered the cell does not know all candidates.
  const double covered_squared = cells_->covered_mm_ * cells_->covered_mm_;
  if (!(nearest.distance_squared <= covered_squared) || nearest.triangle == TriangleTree::kNone) {
    if (limit_squared > covered_squared) return tree_.Find(query, limit_squared, hint);
    nearest = {};
    nearest.distance_squared = limit_squared;
  }
  return nearest;
}

}  // namespace sixpoint::metrology

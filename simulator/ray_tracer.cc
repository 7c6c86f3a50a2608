#include "simulator/ray_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sixpoint::simulator {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A ray along an edge must hit one of its two triangles: corners are widened by a part in 1e9, far below a nanometre.
constexpr double kEdge = 1e-9;
constexpr int kLeafTriangles = 4;
constexpr int kBins = 16;

double Area(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  const Eigen::Vector3d size = high - low;
  return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
}

}  // namespace

std::optional<Hit> Sphere::Intersect(const Ray& ray, double limit_mm) const {
  const Eigen::Vector3d from_centre = ray.origin_mm - centre_mm_;
  const double half_b = from_centre.dot(ray.direction);
  const double c = from_centre.squaredNorm() - radius_mm_ * radius_mm_;
  const double discriminant = half_b * half_b - c;
  if (discriminant < 0) return std::nullopt;
  const double t = -half_b - std::sqrt(discriminant);
  if (t <= 0 || t >= limit_mm) return std::nullopt;
  return Hit{t, (from_centre + t * ray.direction) / radius_mm_};
}

Pin::Pin(const Eigen::Vector3d& top_mm, const Eigen::Vector3d& axis, double radius_mm, double length_mm)
    : top_mm_(top_mm),
      axis_(axis.normalized()),
      middle_mm_(top_mm - 0.5 * length_mm * axis_),
      radius_mm_(radius_mm),
      length_mm_(length_mm),
      bound_mm_(std::hypot(radius_mm, 0.5 * length_mm)) {}

std::optional<Hit> Pin::Intersect(const Ray& ray, double limit_mm) const {
  const Eigen::Vector3d to_middle = middle_mm_ - ray.origin_mm;
  const double along = to_middle.dot(ray.direction);
  if (to_middle.squaredNorm() - along * along > bound_mm_ * bound_mm_) return std::nullopt;

  std::optional<Hit> best;
  const Eigen::Vector3d offset = ray.origin_mm - top_mm_;
  const double direction_up = ray.direction.dot(axis_), offset_up = offset.dot(axis_);
  if (direction_up < 0) {
    const double t = -offset_up / direction_up;
    const Eigen::Vector3d at = offset + t * ray.direction;
    if (t > 0 && t < limit_mm && at.squaredNorm() <= radius_mm_ * radius_mm_) best = Hit{t, axis_};
  }
  const Eigen::Vector3d across = ray.direction - direction_up * axis_;
  const Eigen::Vector3d offset_across = offset - offset_up * axis_;
  const double a = across.squaredNorm();
  if (a > 0) {
    const double half_b = across.dot(offset_across);
    const double discriminant = half_b * half_b - a * (offset_across.squaredNorm() - radius_mm_ * radius_mm_);
    if (discriminant >= 0) {
      const double t = (-half_b - std::sqrt(discriminant)) / a;
      const double height = offset_up + t * direction_up;
      if (t > 0 && t < (best ? best->distance_mm : limit_mm) && height <= 0 && height >= -length_mm_)
        best = Hit{t, (offset_across + t * across) / radius_mm_};
    }
  }
  return best;
}

struct TriangleShape::Item {
  std::uint32_t triangle;
  Eigen::Vector3d low, high, centre;
};

TriangleShape::TriangleShape(const metrology::TriangleMesh& mesh) {
  std::vector<Item> items;
  items.reserve(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const Eigen::Vector3d &p = mesh.vertices_mm[a], &q = mesh.vertices_mm[b], &r = mesh.vertices_mm[c];
    const Eigen::Vector3d low = p.cwiseMin(q).cwiseMin(r), high = p.cwiseMax(q).cwiseMax(r);
    items.push_back({i, low, high, 0.5 * (low + high)});
  }
  nodes_.reserve(items.size());
  if (!items.empty()) Build(items, 0, static_cast<std::uint32_t>(items.size()));
  triangles_.reserve(items.size());
  for (const Item& item : items) {
    const auto& [a, b, c] = mesh.triangles[item.triangle];
    const Eigen::Vector3d& p = mesh.vertices_mm[a];
    triangles_.push_back({p, mesh.vertices_mm[b] - p, mesh.vertices_mm[c] - p});
  }
}

void TriangleShape::Build(std::vector<Item>& items, std::uint32_t begin, std::uint32_t end) {
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(kInfinity), high = -low, centre_low = low, centre_high = high;
  for (std::uint32_t i = begin; i < end; ++i) {
    low = low.cwiseMin(items[i].low);
    high = high.cwiseMax(items[i].high);
    centre_low = centre_low.cwiseMin(items[i].centre);
    centre_high = centre_high.cwiseMax(items[i].centre);
  }
  nodes_[self].low = low;
  nodes_[self].high = high;
  int axis = 0;
  const double extent = (centre_high - centre_low).maxCoeff(&axis);
  if (end - begin <= kLeafTriangles || extent <= 0) {
    nodes_[self].first = begin;
    nodes_[self].count = end - begin;
    return;
  }

  struct Bin {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(kInfinity), high = Eigen::Vector3d::Constant(-kInfinity);
    int count = 0;
    void Include(const Eigen::Vector3d& l, const Eigen::Vector3d& h, int n) {
      low = low.cwiseMin(l);
      high = high.cwiseMax(h);
      count += n;
    }
  };
  std::array<Bin, kBins> bins;
  const double scale = kBins * (1 - 1e-9) / extent, origin = centre_low[axis];
  const auto bin_of = [&](const Item& item) { return static_cast<int>((item.centre[axis] - origin) * scale); };
  for (std::uint32_t i = begin; i < end; ++i) bins[bin_of(items[i])].Include(items[i].low, items[i].high, 1);
  std::array<double, kBins> left_cost{};
  Bin left;
  for (int k = 0; k + 1 < kBins; ++k) {
    left.Include(bins[k].low, bins[k].high, bins[k].count);
    left_cost[k] = left.count > 0 ? left.count * Area(left.low, left.high) : 0;
  }
  Bin right;
  double best_cost = kInfinity;
  int best_split = kBins / 2;
  for (int k = kBins - 1; k > 0; --k) {
    right.Include(bins[k].low, bins[k].high, bins[k].count);
    const double cost = left_cost[k - 1] + (right.count > 0 ? right.count * Area(right.low, right.high) : 0);
    const bool splits = right.count > 0 && right.count < static_cast<int>(end - begin);
    if (splits && cost < best_cost) best_cost = cost, best_split = k;
  }
  const auto middle = std::stable_partition(items.begin() + begin, items.begin() + end,
                                            [&](const Item& item) { return bin_of(item) < best_split; });
  const auto split = static_cast<std::uint32_t>(middle - items.begin());
  Build(items, begin, split);
  nodes_[self].first = static_cast<std::uint32_t>(nodes_.size());
  Build(items, split, end);
}

std::optional<Hit> TriangleShape::Intersect(const Ray& ray, double limit_mm) const {
  if (nodes_.empty()) return std::nullopt;
  const Eigen::Vector3d inverse = ray.direction.cwiseInverse();
  const auto enters = [&](const Node& node, double limit) {
    double near = 0, far = limit;
    for (int k = 0; k < 3; ++k) {
      const double t0 = (node.low[k] - ray.origin_mm[k]) * inverse[k];
      const double t1 = (node.high[k] - ray.origin_mm[k]) * inverse[k];
      // In this order a NaN (ray within a face's plane) leaves the interval as it is.
      near = std::max(near, std::min(t0, t1));
      far = std::min(far, std::max(t0, t1));
    }
    return near <= far * (1 + 1e-12) ? near : kInfinity;
  };
  double best = limit_mm;
  const Triangle* hit = nullptr;
  std::array<std::pair<std::uint32_t, double>, 128> stack;
  int depth = 0;
  std::uint32_t at = 0;
  double entry = enters(nodes_[0], best);
  while (true) {
    if (entry < best || (entry == 0 && best > 0)) {
      const Node& node = nodes_[at];
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
          // Moeller and Trumbore, both sides.
          const Triangle& triangle = triangles_[i];
          const Eigen::Vector3d p = ray.direction.cross(triangle.edge2);
          const double determinant = triangle.edge1.dot(p);
          if (determinant == 0) continue;
          const Eigen::Vector3d s = ray.origin_mm - triangle.corner;
          const double u = s.dot(p) / determinant;
          if (!(u >= -kEdge && u <= 1 + kEdge)) continue;
          const Eigen::Vector3d q = s.cross(triangle.edge1);
          const double v = ray.direction.dot(q) / determinant;
          if (!(v >= -kEdge && u + v <= 1 + kEdge)) continue;
          const double t = triangle.edge2.dot(q) / determinant;
          if (t > 0 && t < best) best = t, hit = &triangle;
        }
      } else {
        std::uint32_t first = at + 1, second = node.first;
        double first_entry = enters(nodes_[first], best), second_entry = enters(nodes_[second], best);
        if (second_entry < first_entry) std::swap(first, second), std::swap(first_entry, second_entry);
        if (second_entry < best && depth < static_cast<int>(stack.size())) stack[depth++] = {second, second_entry};
        at = first;
        entry = first_entry;
        continue;
      }
    }
    if (depth == 0) break;
    at = stack[--depth].first;
    entry = stack[depth].second;
  }
  if (hit == nullptr) return std::nullopt;
  return Hit{best, hit->edge1.cross(hit->edge2).normalized()};
}

void Scene::Add(std::shared_ptr<const Shape> shape, const Eigen::Isometry3d& machine_from_shape) {
  shapes_.push_back({std::move(shape), machine_from_shape, machine_from_shape.inverse()});
}

std::optional<Hit> Scene::Intersect(const Ray& ray, double limit_mm) const {
  std::optional<Hit> best;
  for (const Placed& placed : shapes_) {
    const Ray in_shape{placed.shape_from_machine * ray.origin_mm, placed.shape_from_machine.linear() * ray.direction};
    const auto hit = placed.shape->Intersect(in_shape, best ? best->distance_mm : limit_mm);
    if (hit) best = Hit{hit->distance_mm, placed.machine_from_shape.linear() * hit->normal};
  }
  return best;
}

}  // namespace sixpoint::simulator

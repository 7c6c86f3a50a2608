#include "metrology/surface/triangle_tree.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

constexpr int kLeafSize = 4;
constexpr int kBinCount = 16;
constexpr int kMedianBelowDepth = 20;  // bounds the tree's depth, hence the traversal's stack
constexpr int kStackSize = 512;

using Box = Eigen::AlignedBox3f;

}  // namespace

struct TriangleTree::Builder {
  struct Entry {
    Box box;
    Eigen::Vector3f centre;
    std::uint32_t item;
  };
  std::vector<Entry> entries;
  std::vector<Node, Eigen::aligned_allocator<Node>>* nodes;

  using Range = std::pair<std::uint32_t, std::uint32_t>;

  Box Bounds(Range range) const {
    Box box;
    for (std::uint32_t i = range.first; i < range.second; ++i) box.extend(entries[i].box);
    return box;
  }

  // Splits by the surface-area heuristic in bins; halves the range where that finds nothing or the tree is deep already.
  std::uint32_t Split(Range range, int depth) {
    Box centres;
    for (std::uint32_t i = range.first; i < range.second; ++i) centres.extend(entries[i].centre);
    int axis;
    const float extent = centres.sizes().maxCoeff(&axis);
    const auto begin = entries.begin() + range.first, end = entries.begin() + range.second;
    const std::uint32_t half = range.first + (range.second - range.first) / 2;
    if (extent > 0 && depth < kMedianBelowDepth) {
      const float low = centres.min()[axis], scale = kBinCount * (1 - 1e-6f) / extent;
      const auto bin_of = [&](const Entry& e) {
        return std::clamp(static_cast<int>((e.centre[axis] - low) * scale), 0, kBinCount - 1);
      };
      std::array<Box, kBinCount> boxes;
      std::array<std::uint32_t, kBinCount> counts{};
      for (auto e = begin; e != end; ++e) {
        const int bin = bin_of(*e);
        boxes[bin].extend(e->box);
        ++counts[bin];
      }
      const auto area = [](const Box& box) {
        if (box.isEmpty()) return 0.f;
        const Eigen::Vector3f s = box.sizes();
        return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
      };
      std::array<float, kBinCount> left_cost{};
      Box box;
      std::uint32_t count = 0;
      for (int b = 0; b < kBinCount - 1; ++b) {
        box.extend(boxes[b]);
        count += counts[b];
        left_cost[b] = area(box) * static_cast<float>(count);
      }
      box.setEmpty();
      count = 0;
      int best_bin = -1;
      float best_cost = std::numeric_limits<float>::infinity();
      for (int b = kBinCount - 1; b > 0; --b) {
        box.extend(boxes[b]);
        count += counts[b];
        const float cost = left_cost[b - 1] + area(box) * static_cast<float>(count);
        if (count > 0 && count < range.second - range.first && cost < best_cost) {
          best_cost = cost;
          best_bin = b;
        }
      }
      if (best_bin > 0) {
        const auto middle = std::stable_partition(begin, end, [&](const Entry& e) { return bin_of(e) < best_bin; });
        return static_cast<std::uint32_t>(middle - entries.begin());
      }
    }
    std::nth_element(begin, entries.begin() + half, end, [axis](const Entry& a, const Entry& b) {
      return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis] : a.item < b.item;
    });
    return half;
  }

  void Build(std::uint32_t node, Range range, int depth) {
    std::vector<Range> children{range};
    while (children.size() < 4) {
      const auto widest = std::max_element(children.begin(), children.end(), [](const Range& a, const Range& b) {
        return a.second - a.first < b.second - b.first;
      });
      if (widest->second - widest->first <= kLeafSize) break;
      const std::uint32_t middle = Split(*widest, depth);
      const Range right{middle, widest->second};
      widest->second = middle;
      children.push_back(right);
    }
    for (int c = 0; c < 4; ++c) {
      const bool used = c < static_cast<int>(children.size());
      const Box box = used ? Bounds(children[c]) : Box();
      for (int k = 0; k < 3; ++k) {
        (*nodes)[node].low[k][c] = used ? box.min()[k] : std::numeric_limits<float>::max();
        (*nodes)[node].high[k][c] = used ? box.max()[k] : std::numeric_limits<float>::max();
      }
      (*nodes)[node].first[c] = used ? children[c].first : kNone;
      (*nodes)[node].count[c] = used ? children[c].second - children[c].first : 0;
    }
    for (int c = 0; c < static_cast<int>(children.size()); ++c) {
      if ((*nodes)[node].count[c] <= kLeafSize) continue;
      const auto child = static_cast<std::uint32_t>(nodes->size());
      nodes->emplace_back();
      (*nodes)[node].first[c] = child;
      (*nodes)[node].count[c] = 0;
      Build(child, children[c], depth + 1);
    }
  }
};

TriangleTree::TriangleTree(const Points& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles)
    : vertices_(vertices) {
  std::vector<Item> items;
  items.reserve(triangles.size());
  Builder builder{{}, &nodes_};
  builder.entries.reserve(triangles.size());
  double reach = 0;
  for (const Eigen::Vector3d& v : vertices) reach = std::max(reach, v.cwiseAbs().maxCoeff());
  const auto margin = static_cast<float>(4e-7 * reach);  // more than float rounds any near coordinate
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const Eigen::Vector3d &a = vertices[triangles[t][0]], &b = vertices[triangles[t][1]],
                          &c = vertices[triangles[t][2]];
    const Eigen::Vector3d ab = b - a, ac = c - a;
    if (!(ab.cross(ac).squaredNorm() > 1e-24 * ab.squaredNorm() * ac.squaredNorm())) continue;
    Box box;
    for (const Eigen::Vector3d* v : {&a, &b, &c}) box.extend(v->cast<float>());
    box.min().array() -= margin;
    box.max().array() += margin;
    builder.entries.push_back({box, box.center(), static_cast<std::uint32_t>(items.size())});
    items.push_back({triangles[t], t});
  }
  if (items.empty()) return;
  nodes_.emplace_back();
  builder.Build(0, {0, static_cast<std::uint32_t>(items.size())}, 0);
  items_.reserve(items.size());
  item_of_triangle_.assign(triangles.size(), kNone);
  for (const Builder::Entry& entry : builder.entries) {
    item_of_triangle_[items[entry.item].triangle] = static_cast<std::uint32_t>(items_.size());
    items_.push_back(items[entry.item]);
  }
}

// Ericson, Real-Time Collision Detection, 5.1.5.
void TriangleTree::Test(const Item& item, const Eigen::Vector3d& query, Nearest* best) const {
  const Eigen::Vector3d &a = corner(item, 0), ab = corner(item, 1) - a, ac = corner(item, 2) - a, ap = query - a;
  const double abab = ab.squaredNorm(), abac = ab.dot(ac), acac = ac.squaredNorm();
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  const double d3 = d1 - abab, d4 = d2 - abac, d5 = d1 - abac, d6 = d2 - acac;
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  double v, w;
  TrianglePart part;
  if (d1 <= 0 && d2 <= 0) {
    v = w = 0;
    part = TrianglePart::kCorner0;
  } else if (d3 >= 0 && d4 <= d3) {
    v = 1;
    w = 0;
    part = TrianglePart::kCorner1;
  } else if (d6 >= 0 && d5 <= d6) {
    v = 0;
    w = 1;
    part = TrianglePart::kCorner2;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    v = d1 / abab;
    w = 0;
    part = TrianglePart::kEdge2;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    v = 0;
    w = d2 / acac;
    part = TrianglePart::kEdge1;
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    v = 1 - w;
    part = TrianglePart::kEdge0;
  } else {
    const double scale = 1 / (va + vb + vc);
    v = vb * scale;
    w = vc * scale;
    part = TrianglePart::kInside;
  }
  const double distance_squared = (ap - v * ab - w * ac).squaredNorm();
  if (distance_squared < best->distance_squared ||
      (distance_squared == best->distance_squared && item.triangle < best->triangle)) {
    *best = {item.triangle, distance_squared, {1 - v - w, v, w}, part, &item};
  }
}

TriangleTree::Nearest TriangleTree::Find(const Eigen::Vector3d& query, double limit_squared, std::uint32_t hint) const {
  Nearest best;
  best.distance_squared = limit_squared;
  if (items_.empty()) return best;
  if (hint < item_of_triangle_.size() && item_of_triangle_[hint] != kNone)
    Test(items_[item_of_triangle_[hint]], query, &best);
  const Eigen::Vector3f q = query.cast<float>();
  const auto reach = [&best] {  // above the best distance by more than float rounds
    return static_cast<float>(best.distance_squared * (1 + 1e-5)) + std::numeric_limits<float>::min();
  };
  struct Waiting {
    float distance_squared;
    std::uint32_t node;
  };
  std::array<Waiting, kStackSize> stack;
  int depth = 0;
  stack[depth++] = {0, 0};
  float limit = reach();
  while (depth > 0) {
    const Waiting next = stack[--depth];
    if (next.distance_squared > limit) continue;
    const Node& node = nodes_[next.node];
    Eigen::Array4f squared = Eigen::Array4f::Zero();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Array4f outside = (node.low[k] - q[k]).max(q[k] - node.high[k]).max(0.f);
      squared += outside * outside;
    }
    const int bottom = depth;
    for (int c = 0; c < 4; ++c) {
      if (!(squared[c] <= limit) || node.first[c] == kNone) continue;
      if (node.count[c] > 0) {
        for (std::uint32_t i = 0; i < node.count[c]; ++i) Test(items_[node.first[c] + i], query, &best);
        limit = reach();
      } else {
        stack[depth++] = {squared[c], node.first[c]};
        for (int i = depth - 1; i > bottom && stack[i].distance_squared > stack[i - 1].distance_squared; --i)
          std::swap(stack[i], stack[i - 1]);
      }
    }
  }
  return best;
}

void TriangleTree::FindEach(const Eigen::Vector3d* queries, std::size_t count, double limit_squared, std::uint32_t hint,
                            Nearest* nearest) const {
  for (std::size_t i = 0; i < count; ++i) {
    nearest[i] = Find(queries[i], limit_squared, hint);
    if (nearest[i].triangle != kNone) hint = nearest[i].triangle;
  }
}

void TriangleTree::FindWithin(const Eigen::Vector3d& query, double distance, std::vector<Within>* found) const {
  found->clear();
  if (items_.empty()) return;
  const Eigen::Vector3f q = query.cast<float>();
  const auto limit = static_cast<float>(distance * distance * (1 + 1e-5)) + std::numeric_limits<float>::min();
  std::array<std::uint32_t, kStackSize> stack;
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    Eigen::Array4f squared = Eigen::Array4f::Zero();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Array4f outside = (node.low[k] - q[k]).max(q[k] - node.high[k]).max(0.f);
      squared += outside * outside;
    }
    for (int c = 0; c < 4; ++c) {
      if (!(squared[c] <= limit) || node.first[c] == kNone) continue;
      if (node.count[c] == 0) {
        stack[depth++] = node.first[c];
        continue;
      }
      for (std::uint32_t i = node.first[c]; i < node.first[c] + node.count[c]; ++i) {
        Nearest nearest;
        Test(items_[i], query, &nearest);
        if (nearest.distance_squared <= distance * distance) found->push_back({i, std::sqrt(nearest.distance_squared)});
      }
    }
  }
}

}  // namespace sixpoint::metrology

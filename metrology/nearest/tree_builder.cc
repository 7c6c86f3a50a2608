#include "metrology/nearest/tree_builder.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

namespace sixpoint::metrology {
namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr int kBinCount = 16;
constexpr int kMedianBelowDepth = 20;  // bounds the tree's depth, hence the traversal's stack

using Box = Eigen::AlignedBox3f;
using Range = std::pair<std::uint32_t, std::uint32_t>;

float HalfArea(const Box& box) {
  if (box.isEmpty()) return 0.f;
  const Eigen::Vector3f s = box.sizes();
  return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

class Builder {
 public:
  struct Entry {
    Box box;
    Eigen::Vector3f centre;
    std::uint32_t item;
  };

  explicit Builder(std::vector<Entry>* entries) : entries_(*entries) {}

  void Build(std::uint32_t node, Range range, int depth) {
    const std::vector<Range> children = Divided(range, depth);
    for (std::size_t c = 0; c < 4; ++c) SetChild(c, c < children.size() ? &children[c] : nullptr, &nodes[node]);
    for (std::size_t c = 0; c < children.size(); ++c) {
      if (nodes[node].count[c] <= kLeafSize) continue;
      const auto child = static_cast<std::uint32_t>(nodes.size());
      nodes.emplace_back();
      nodes[node].first[c] = child;
      nodes[node].count[c] = 0;
      Build(child, children[c], depth + 1);
    }
  }

  std::vector<TreeNode, Eigen::aligned_allocator<TreeNode>> nodes;

 private:
  Box Bounds(Range range) const {
    Box box;
    for (std::uint32_t i = range.first; i < range.second; ++i) box.extend(entries_[i].box);
    return box;
  }

  void SetChild(std::size_t c, const Range* range, TreeNode* node) const {
    const Box box = range != nullptr ? Bounds(*range) : Box();
    for (int k = 0; k < 3; ++k) {
      node->low[k][static_cast<Eigen::Index>(c)] = range != nullptr ? box.min()[k] : std::numeric_limits<float>::max();
      node->high[k][static_cast<Eigen::Index>(c)] = range != nullptr ? box.max()[k] : std::numeric_limits<float>::max();
    }
    node->first[c] = range != nullptr ? range->first : TreeNode::kNoChild;
    node->count[c] = range != nullptr ? range->second - range->first : 0;
  }

  // In up to four, the one with most items always being split next.
  std::vector<Range> Divided(Range range, int depth) {
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
    return children;
  }

  // By the surface-area heuristic in bins; halves the range where that finds nothing or the tree is deep already.
  std::uint32_t Split(Range range, int depth) {
    Box centres;
    for (std::uint32_t i = range.first; i < range.second; ++i) centres.extend(entries_[i].centre);
    int axis;
    const float extent = centres.sizes().maxCoeff(&axis);
    if (extent > 0 && depth < kMedianBelowDepth)
      if (const auto middle = SplitInBins(range, axis, centres.min()[axis], extent)) return *middle;
    const std::uint32_t half = range.first + (range.second - range.first) / 2;
    std::nth_element(entries_.begin() + range.first, entries_.begin() + half, entries_.begin() + range.second,
                     [axis](const Entry& a, const Entry& b) {
                       return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis] : a.item < b.item;
                     });
    return half;
  }

  std::optional<std::uint32_t> SplitInBins(Range range, int axis, float low, float extent) {
    const auto begin = entries_.begin() + range.first, end = entries_.begin() + range.second;
    const float scale = kBinCount * (1 - 1e-6f) / extent;
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
    const int best_bin = CheapestBin(boxes, counts, range.second - range.first);
    if (best_bin <= 0) return std::nullopt;
    const auto middle = std::stable_partition(begin, end, [&](const Entry& e) { return bin_of(e) < best_bin; });
    return static_cast<std::uint32_t>(middle - entries_.begin());
  }

  // The first bin of the right half where areas times counts are least; -1 where all are on one side.
  static int CheapestBin(const std::array<Box, kBinCount>& boxes, const std::array<std::uint32_t, kBinCount>& counts,
                         std::uint32_t total) {
    std::array<float, kBinCount> left_cost{};
    Box box;
    std::uint32_t count = 0;
    for (int b = 0; b < kBinCount - 1; ++b) {
      box.extend(boxes[b]);
      count += counts[b];
      left_cost[b] = HalfArea(box) * static_cast<float>(count);
    }
    box.setEmpty();
    count = 0;
    int best_bin = -1;
    float best_cost = std::numeric_limits<float>::infinity();
    for (int b = kBinCount - 1; b > 0; --b) {
      box.extend(boxes[b]);
      count += counts[b];
      const float cost = left_cost[b - 1] + HalfArea(box) * static_cast<float>(count);
      if (count > 0 && count < total && cost < best_cost) {
        best_cost = cost;
        best_bin = b;
      }
    }
    return best_bin;
  }

  std::vector<Entry>& entries_;
};

}  // namespace

BuiltTree BuildTree(const Points& vertices, const std::vector<TriangleCorners>& triangles) {
  std::vector<IndexedTriangle> items;
  items.reserve(triangles.size());
  std::vector<Builder::Entry> entries;
  entries.reserve(triangles.size());
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
    entries.push_back({box, box.center(), static_cast<std::uint32_t>(items.size())});
    items.push_back({triangles[t], t});
  }
  BuiltTree tree;
  if (items.empty()) return tree;
  Builder builder(&entries);
  builder.nodes.emplace_back();
  builder.Build(0, {0, static_cast<std::uint32_t>(items.size())}, 0);
  tree.nodes = std::move(builder.nodes);
  tree.items.reserve(items.size());
  for (const Builder::Entry& entry : entries) tree.items.push_back(items[entry.item]);
  return tree;
}

}  // namespace sixpoint::metrology

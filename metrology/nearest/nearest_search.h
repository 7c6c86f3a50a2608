// The nearest triangle, exactly: of one point, or of many together in several times less time, to the same bits.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "metrology/nearest/near_cells.h"
#include "metrology/nearest/point_order.h"
#include "metrology/nearest/triangle_tree.h"

namespace sixpoint::metrology {

// Read by any number of threads. A point that is not finite has no nearest triangle, nor has any within a negative distance.
class NearestSearch {
 public:
  // As TriangleTree: triangles without area are left out; vertices near their origin, which stay where they are.
  NearestSearch(const Points& vertices_mm, const std::vector<TriangleCorners>& triangles);

  // Finds one. The hint, a triangle thought near, changes the time only.
  NearestTriangle Find(const Eigen::Vector3d& point_mm, double limit_mm, std::uint32_t hint) const;

  // As TriangleTree.
  bool Meets(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm) const { return tree_.Meets(from_mm, to_mm); }

  // Makes ready for very many points near the surface (once, two seconds of two threads for a million triangles; near_cells.h).
  // Thread-safe; what throws is tried again by the next caller.
  void PrepareNear(int thread_count) const;

  // Finds many: Find of each. Any number of threads may visit.
  class Many {
   public:
    static constexpr std::size_t kMostFound = 64;  // at a time
    // Some of the points, which follow each other in the order.
    struct Found {
      const std::uint32_t* indices;
      const Eigen::Vector3d* points_mm;
      const NearestTriangle* nearest;
      std::size_t count;
    };
    // The search lives longer. The order depends on nothing but the points, the search and whether it is prepared near.
    Many(const NearestSearch& search, std::uint32_t count, PointsAt points_at, double limit_mm, int thread_count);
    // Those at [from, to) of the order.
    void Visit(std::size_t from, std::size_t to, const std::function<void(const Found&)>& take) const;

   private:
    class Visitor;  // one thread's way through the order
    // Points of no cell may have the surface within the limit.
    bool FarMatter() const { return near_ == nullptr || !(limit_mm_ <= near_->covered_mm()); }

    const TriangleTree& tree_;
    const NearCells* near_;
    const PointsAt points_at_;
    const double limit_mm_;
    PointOrder order_;
  };

  // Triangles with an area.
  std::size_t triangle_count() const { return tree_.items().size(); }
  std::size_t memory_bytes() const;

 private:
  TriangleTree tree_;
  mutable std::once_flag near_once_;
  mutable std::unique_ptr<const NearCells> near_;
  mutable std::atomic<const NearCells*> near_ready_ = nullptr;
};

}  // namespace sixpoint::metrology

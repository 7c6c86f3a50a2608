// Nearest triangles of points that lie near each other, together: each candidate is measured against all of them side by side
// (near_lanes.h), and in double precision only where it may be the nearest. The answers of TriangleTree::Find, to the bit.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "metrology/nearest/candidate_lists.h"
#include "metrology/nearest/near_cells.h"
#include "metrology/nearest/pair_lanes.h"
#include "metrology/nearest/triangle_tree.h"

namespace sixpoint::metrology {

// One thread's working space.
class NearBatch {
 public:
  NearBatch(const TriangleTree& tree, const NearCells& cells);
  static constexpr std::size_t kMostPoints = NearLanes::kMost;
  // queries: up to kMostPoints, all in the cell.
  void Find(std::uint32_t cell, const Eigen::Vector3d* queries, std::size_t count, double limit_squared,
            NearestTriangle* nearest);
  // queries: up to kMostPoints, anywhere; quick where they are near to each other. The hint as in TriangleTree::Find.
  void FindAround(const Eigen::Vector3d* queries, std::size_t count, double limit_squared, std::uint32_t hint,
                  NearestTriangle* nearest);

 private:
  // What the lanes leave open: how many candidates were measured, and how far off a distance may be.
  struct Measured {
    std::uint32_t used = 0;
    float tolerance = 0;
  };
  // The nearest of the candidates within the limit, of each query.
  void FindAmong(const Candidates& candidates, const Eigen::Vector3d* queries, std::size_t count, double limit_squared,
                 NearestTriangle* nearest);
  // Lays the queries side by side. How far the farthest is from the centre.
  float LayOut(const Candidates& candidates, const Eigen::Vector3d* queries, std::size_t count);
  Measured Measure(const Candidates& candidates, float from_centre, std::size_t count);

  const TriangleTree& tree_;
  const NearCells& cells_;
  std::unique_ptr<NearLanes> lanes_;
  std::unique_ptr<PairLanes> pairs_;
  std::size_t width_ = 0;             // of the lanes in use, padded
  std::vector<LaneBlock> squared_;    // by candidate and lane
  std::vector<float> tolerances_;     // by candidate
  std::vector<std::uint32_t> items_;  // about points of no cell
  std::vector<float> group_distances_mm_;
  CandidateLists about_{1};  // one list; its distances are all 0
};

}  // namespace sixpoint::metrology

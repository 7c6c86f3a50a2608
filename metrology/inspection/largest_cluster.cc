#include "metrology/inspection/largest_cluster.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
// With the template's body: PCL's library of segmentation, and the features and learning that it needs, stay away.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <pcl/segmentation/impl/extract_clusters.hpp>

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kMostPoints = 50'000;
constexpr std::size_t kMostPairs = 2'000'000;  // that share a cube of the gap's side; each takes 0.1 us

// The search looks at every pair within the gap: 50,000 points in one place would take minutes.
bool TooDense(const Points& points_mm, double gap_mm) {
  std::map<std::array<std::int64_t, 3>, std::size_t> counts;
  std::size_t pairs = 0;
  for (const Eigen::Vector3d& p : points_mm) {
    const Eigen::Vector3d cell = ((p - points_mm.front()) / gap_mm).array().floor();
    if (!(cell.cwiseAbs().maxCoeff() < 1e15)) return true;
    pairs += counts[{static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
                     static_cast<std::int64_t>(cell.z())}]++;
    if (pairs > kMostPairs) return true;
  }
  return false;
}

}  // namespace

std::vector<std::size_t> LargestCluster(const Points& points_mm, double gap_mm) {
  if (points_mm.empty() || points_mm.size() > kMostPoints || TooDense(points_mm, gap_mm)) return {};
  const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Eigen::Vector3d& p : points_mm) {  // floats hold what is near the origin
    const Eigen::Vector3f at = (p - points_mm.front()).cast<float>();
    cloud->emplace_back(at.x(), at.y(), at.z());
  }
  const auto tree = pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
  tree->setInputCloud(cloud);
  std::vector<pcl::PointIndices> clusters;
  pcl::extractEuclideanClusters<pcl::PointXYZ>(*cloud, tree, static_cast<float>(gap_mm), clusters, 1,
                                               static_cast<unsigned>(points_mm.size()));
  const auto largest = std::max_element(clusters.begin(), clusters.end(), [](const auto& a, const auto& b) {
    return a.indices.size() < b.indices.size();
  });
  std::vector<std::size_t> indices(largest->indices.begin(), largest->indices.end());
  std::sort(indices.begin(), indices.end());
  return indices;
}

}  // namespace sixpoint::metrology

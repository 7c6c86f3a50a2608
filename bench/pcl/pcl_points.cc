#include "bench/pcl/pcl_points.h"

#include <pcl/console/print.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/random_sample.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/uniform_sampling.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <algorithm>

namespace sixpoint::bench {
namespace {

using metrology::Points;
using Point = pcl::PointXYZ;
using Cloud = pcl::PointCloud<Point>;

// Floats hold what is near the middle.
struct Centred {
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  Cloud::Ptr cloud{new Cloud};

  explicit Centred(const Points& points_mm) {
    for (const Eigen::Vector3d& p : points_mm) middle_mm += p / static_cast<double>(points_mm.size());
    cloud->reserve(points_mm.size());
    for (const Eigen::Vector3d& p : points_mm) {
      const Eigen::Vector3f at = (p - middle_mm).cast<float>();
      cloud->emplace_back(at.x(), at.y(), at.z());
    }
  }
  Eigen::Vector3d Back(const Point& p) const { return middle_mm + p.getVector3fMap().cast<double>(); }
};

template <typename Filter>
Points Filtered(const Centred& centred, Filter* filter) {
  filter->setInputCloud(centred.cloud);
  Cloud kept;
  filter->filter(kept);
  Points points;
  points.reserve(kept.size());
  for (const Point& p : kept) points.push_back(centred.Back(p));
  return points;
}

pcl::search::KdTree<Point>::Ptr Tree() { return pcl::make_shared<pcl::search::KdTree<Point>>(); }

}  // namespace

void QuietPcl() { pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); }

Points PclVoxelGrid(const Points& points_mm, double cell_mm) {
  pcl::VoxelGrid<Point> grid;
  const auto cell = static_cast<float>(cell_mm);
  grid.setLeafSize(cell, cell, cell);
  return Filtered(Centred(points_mm), &grid);
}

Points PclUniformSampling(const Points& points_mm, double cell_mm) {
  pcl::UniformSampling<Point> sampling;
  sampling.setRadiusSearch(cell_mm);
  return Filtered(Centred(points_mm), &sampling);
}

Points PclRandomSample(const Points& points_mm, std::size_t count) {
  pcl::RandomSample<Point> sample;
  sample.setSample(static_cast<unsigned>(count));
  sample.setSeed(1);
  return Filtered(Centred(points_mm), &sample);
}

Points PclWithoutOutliers(const Points& points_mm, double sigmas) {
  pcl::StatisticalOutlierRemoval<Point> removal;
  removal.setMeanK(20);
  removal.setStddevMulThresh(sigmas);
  return Filtered(Centred(points_mm), &removal);
}

Points PclLargestCluster(const Points& points_mm, double gap_mm) {
  const Centred centred(points_mm);
  const auto tree = Tree();
  tree->setInputCloud(centred.cloud);
  pcl::EuclideanClusterExtraction<Point> extraction;
  extraction.setClusterTolerance(gap_mm);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(centred.cloud);
  std::vector<pcl::PointIndices> clusters;
  extraction.extract(clusters);  // largest first
  Points points;
  if (clusters.empty()) return points;
  for (const int i : clusters.front().indices) points.push_back(points_mm[static_cast<std::size_t>(i)]);
  return points;
}

std::optional<Eigen::Vector3d> PclCylinderStart(const metrology::NominalPin& nominal, const Points& points_mm) {
  const Centred centred(points_mm);
  pcl::PointCloud<pcl::Normal>::Ptr normals(new pcl::PointCloud<pcl::Normal>);
  pcl::NormalEstimation<Point, pcl::Normal> estimation;
  estimation.setSearchMethod(Tree());
  estimation.setKSearch(20);
  estimation.setInputCloud(centred.cloud);
  estimation.compute(*normals);
  pcl::SACSegmentationFromNormals<Point, pcl::Normal> segmentation;
  segmentation.setModelType(pcl::SACMODEL_CYLINDER);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setOptimizeCoefficients(true);
  segmentation.setNormalDistanceWeight(0.01);
  segmentation.setDistanceThreshold(0.01);
  segmentation.setMaxIterations(2'000);
  segmentation.setRadiusLimits(0.25 * nominal.hole_diameter_mm, 0.8 * nominal.hole_diameter_mm);
  segmentation.setAxis(nominal.axis.cast<float>());
  segmentation.setEpsAngle(0.1);
  segmentation.setInputCloud(centred.cloud);
  segmentation.setInputNormals(normals);
  pcl::PointIndices inliers;
  pcl::ModelCoefficients found;
  segmentation.segment(inliers, found);
  if (inliers.indices.size() < 60 || found.values.size() < 7) return std::nullopt;
  const Eigen::Vector3d on_axis = centred.Back({found.values[0], found.values[1], found.values[2]});
  const Eigen::Vector3d axis(found.values[3], found.values[4], found.values[5]);
  return on_axis + axis * (nominal.normal.dot(nominal.start_mm - on_axis) / nominal.normal.dot(axis));
}

}  // namespace sixpoint::bench

#include "bench/pcl/pcl_start.h"

#include <pcl/features/fpfh.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/uniform_sampling.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/ia_ransac.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/sample_consensus_prerejective.h>
#include <pcl/search/kdtree.h>

#include <cstdlib>

namespace sixpoint::bench {
namespace {

using Point = pcl::PointNormal;
using Cloud = pcl::PointCloud<Point>;
using Features = pcl::PointCloud<pcl::FPFHSignature33>;

constexpr float kSpacingMm = 1.5;
constexpr double kNormalRadiusMm = 2, kFeatureRadiusMm = 8;
constexpr std::size_t kSurfaceCount = 60'000;

Point PointOf(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) {
  Point point;
  point.getVector3fMap() = p.cast<float>();
  point.getNormalVector3fMap() = normal.cast<float>();
  return point;
}

pcl::search::KdTree<Point>::Ptr Tree() { return pcl::make_shared<pcl::search::KdTree<Point>>(); }

Cloud::Ptr Spaced(const Cloud::Ptr& cloud) {
  pcl::UniformSampling<Point> sampling;
  sampling.setRadiusSearch(kSpacingMm);
  sampling.setInputCloud(cloud);
  Cloud::Ptr spaced(new Cloud);
  sampling.filter(*spaced);
  return spaced;
}

Features::Ptr FeaturesOf(const Cloud::Ptr& cloud) {
  pcl::FPFHEstimation<Point, Point, pcl::FPFHSignature33> estimation;
  estimation.setSearchMethod(Tree());
  estimation.setRadiusSearch(kFeatureRadiusMm);
  estimation.setInputCloud(cloud);
  estimation.setInputNormals(cloud);
  Features::Ptr features(new Features);
  estimation.compute(*features);
  return features;
}

// At zero about `middle_mm`; each view's normals look towards its scanner.
Cloud::Ptr CloudOf(const std::vector<metrology::ScanPortion>& portions, const Eigen::Vector3d& middle_mm) {
  Cloud::Ptr all(new Cloud);
  for (const metrology::ScanPortion& portion : portions) {
    Cloud::Ptr view(new Cloud);
    for (std::size_t i = 0; i < portion.sensor.size(); ++i)
      view->push_back(PointOf(portion.zero_mm(i) - middle_mm, Eigen::Vector3d::Zero()));
    const Eigen::Vector3f scanner = 1e4f * portion.zero_from_sensor.linear().col(2).normalized().cast<float>();
    const Cloud::Ptr spaced = Spaced(view);
    pcl::NormalEstimation<Point, Point> estimation;
    estimation.setSearchMethod(Tree());
    estimation.setSearchSurface(view);
    estimation.setInputCloud(spaced);
    estimation.setRadiusSearch(kNormalRadiusMm);
    estimation.setViewPoint(scanner.x(), scanner.y(), scanner.z());
    estimation.compute(*spaced);
    for (const Point& point : *spaced)
      if (point.getNormalVector3fMap().allFinite()) all->push_back(point);
  }
  return Spaced(all);
}

// Onto the blade, from where it was found; within a spacing or two.
std::optional<Eigen::Isometry3d> Settled(const Cloud::Ptr& scan, const Cloud::Ptr& blade,
                                         const Eigen::Matrix4f& start) {
  pcl::IterativeClosestPointWithNormals<Point, Point> icp;
  icp.setInputSource(scan);
  icp.setInputTarget(blade);
  icp.setMaxCorrespondenceDistance(2 * kSpacingMm);
  icp.setMaximumIterations(40);
  icp.setTransformationEpsilon(1e-8);
  Cloud aligned;
  icp.align(aligned, start);
  if (!icp.hasConverged()) return std::nullopt;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(icp.getFinalTransformation().topLeftCorner<3, 3>().cast<double>())
                      .normalized()
                      .toRotationMatrix();
  pose.translation() = icp.getFinalTransformation().topRightCorner<3, 1>().cast<double>();
  return pose;
}

}  // namespace

struct PclStart::Model {
  Cloud::Ptr cloud;
  Features::Ptr features;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
};

PclStart::PclStart(const Blade& blade) : model_(std::make_unique<Model>()) {
  for (const Eigen::Vector3d& vertex : blade.mesh.vertices_mm)
    model_->middle_mm += vertex / static_cast<double>(blade.mesh.vertices_mm.size());
  CaseSampler sampler(blade, CaseKind::kWholeBody, 0, std::nullopt, 1);
  Cloud::Ptr dense(new Cloud);
  for (std::size_t k = 0; k < kSurfaceCount; ++k) {
    const CaseSampler::OnSurface on = sampler.NextOnSurface();
    dense->push_back(PointOf(on.part_mm - model_->middle_mm, on.normal));
  }
  model_->cloud = Spaced(dense);
  model_->features = FeaturesOf(model_->cloud);
}

PclStart::~PclStart() = default;

std::optional<Eigen::Isometry3d> PclStart::Find(const std::vector<metrology::ScanPortion>& portions, StartBy by) const {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for (const metrology::ScanPortion& portion : portions)
    for (std::size_t i = 0; i < portion.sensor.size(); i += 10, ++count) middle += portion.zero_mm(i);
  middle /= static_cast<double>(count);
  const Cloud::Ptr scan = CloudOf(portions, middle);
  const Features::Ptr features = FeaturesOf(scan);
  Cloud aligned;
  Eigen::Matrix4f found;
  std::srand(1);
  if (by == StartBy::kPrerejection) {
    pcl::SampleConsensusPrerejective<Point, Point, pcl::FPFHSignature33> search;
    search.setInputSource(scan);
    search.setSourceFeatures(features);
    search.setInputTarget(model_->cloud);
    search.setTargetFeatures(model_->features);
    search.setMaximumIterations(20'000);
    search.setNumberOfSamples(3);
    search.setCorrespondenceRandomness(5);
    search.setSimilarityThreshold(0.9f);
    search.setMaxCorrespondenceDistance(1.5 * kSpacingMm);
    search.setInlierFraction(0.25f);
    search.align(aligned);
    if (!search.hasConverged()) return std::nullopt;
    found = search.getFinalTransformation();
  } else {
    pcl::SampleConsensusInitialAlignment<Point, Point, pcl::FPFHSignature33> search;
    search.setInputSource(scan);
    search.setSourceFeatures(features);
    search.setInputTarget(model_->cloud);
    search.setTargetFeatures(model_->features);
    search.setMaximumIterations(300);
    search.setNumberOfSamples(3);
    search.setCorrespondenceRandomness(5);
    search.setMinSampleDistance(6 * kSpacingMm);
    search.setMaxCorrespondenceDistance(2 * kSpacingMm);
    search.align(aligned);
    found = search.getFinalTransformation();
  }
  const auto part_from_scan = Settled(scan, model_->cloud, found);
  if (!part_from_scan) return std::nullopt;
  return Eigen::Translation3d(middle) * part_from_scan->inverse(Eigen::Isometry) *
         Eigen::Translation3d(-model_->middle_mm);
}

}  // namespace sixpoint::bench

#include "bench/registration/pcl_peer.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>
#include <pcl/search/kdtree.h>

#include "bench/registration/our_fit.h"

namespace sixpoint::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;

constexpr std::size_t kTargetCount = 500'000;

// Says how often it went round.
class Icp : public pcl::IterativeClosestPoint<pcl::PointNormal, pcl::PointNormal, double> {
 public:
  int iteration_count() const { return nr_iterations_; }
};

pcl::PointNormal At(const Eigen::Vector3d& point_mm) {
  pcl::PointNormal at;
  at.getVector3fMap() = point_mm.cast<float>();
  return at;
}

}  // namespace

PeerFit PclPointToPlane(const Blade& blade, const metrology::Points& scan_mm, std::size_t stride) {
  Cloud::Ptr target(new Cloud), source(new Cloud);
  CaseSampler sampler(blade, CaseKind::kWholeBody, 0, std::nullopt, 1);
  for (std::size_t k = 0; k < kTargetCount; ++k) {
    const CaseSampler::OnSurface on = sampler.NextOnSurface();
    pcl::PointNormal point = At(on.part_mm);
    point.getNormalVector3fMap() = on.normal.cast<float>();
    target->push_back(point);
  }
  for (std::size_t i = 0; i < scan_mm.size(); i += stride) source->push_back(At(scan_mm[i]));

  Icp icp;
  icp.setTransformationEstimation(
      pcl::make_shared<
          pcl::registration::TransformationEstimationPointToPlaneLLS<pcl::PointNormal, pcl::PointNormal, double>>());
  const auto tree = pcl::make_shared<pcl::search::KdTree<pcl::PointNormal>>();
  tree->setInputCloud(target);
  icp.setSearchMethodTarget(tree, true);
  icp.setInputTarget(target);
  icp.setInputSource(source);
  // Twice what the start is off by; a step of 10 nm and 0.1 urad ends it.
  icp.setMaxCorrespondenceDistance(3);
  icp.setMaximumIterations(100);
  icp.setTransformationEpsilon(1e-10);
  icp.setTransformationRotationEpsilon(1 - 5e-15);
  Cloud aligned;
  PeerFit fit;
  const double begin = Seconds(), processor_begin = ProcessorSeconds();
  icp.align(aligned);
  fit.seconds = Seconds() - begin;
  fit.processor_s = ProcessorSeconds() - processor_begin;
  fit.iteration_count = icp.iteration_count();
  fit.scan_from_part = Eigen::Isometry3d(icp.getFinalTransformation()).inverse(Eigen::Isometry);
  return fit;
}

}  // namespace sixpoint::bench

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
  std::vector<Eigen::Vector3d> normals(blade.mesh.vertices_mm.size(), Eigen::Vector3d::Zero());
  for (std::size_t t = 0; t < blade.normals.size(); ++t)
    for (const std::uint32_t corner : blade.mesh.triangles[t]) normals[corner] += blade.areas_mm2[t] * blade.normals[t];
  Cloud::Ptr target(new Cloud), source(new Cloud);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    pcl::PointNormal vertex = At(blade.mesh.vertices_mm[v]);
    vertex.getNormalVector3fMap() = normals[v].normalized().cast<float>();
    target->push_back(vertex);
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

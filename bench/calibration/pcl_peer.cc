#include "bench/calibration/pcl_peer.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_circle.h>
#include <pcl/sample_consensus/sac_model_plane.h>

#include <cmath>

namespace sixpoint::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

template <typename Model>
bool Fit(const typename Model::Ptr& model, double band_mm, Eigen::VectorXf* coefficients) {
  pcl::RandomSampleConsensus<pcl::PointXYZ> consensus(model, band_mm);
  if (!consensus.computeModel()) return false;
  pcl::Indices inliers;
  consensus.getInliers(inliers);
  Eigen::VectorXf first;
  consensus.getModelCoefficients(first);
  model->optimizeModelCoefficients(inliers, first, *coefficients);
  return true;
}

}  // namespace

std::optional<metrology::SensorPose> PclPlaneAndCircles(const std::vector<metrology::LineScan>& scans,
                                                        const metrology::Artefact& artefact,
                                                        const metrology::ArtefactTouch& touch,
                                                        const metrology::SensorPose& near,
                                                        const Eigen::Isometry3d& machine_from_artefact) {
  constexpr double kDepthMm = 0.75, kHalfSliceMm = 0.05;
  metrology::Points from, onto;
  for (const metrology::LineScan& scan : scans) {
    // PCL's points are floats: near the origin they hold 0.1 um. The unshearing is given to it, too.
    const Eigen::Isometry3d artefact_from_machine = machine_from_artefact.inverse();
    Cloud::Ptr upper(new Cloud);
    std::vector<Cloud::Ptr> walls;
    for (std::size_t k = 0; k < artefact.cones.size(); ++k) walls.emplace_back(new Cloud);
    for (std::size_t i = 0; i < scan.points_mm.size(); ++i) {
      const Eigen::Vector3d at = artefact_from_machine * near.MachineFromSensor(scan.points_mm[i], scan.v0_mm);
      const pcl::PointXYZ p(static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z()));
      if (i % 20 == 0) upper->push_back(p);
      if (std::abs(at.z() + kDepthMm) > 0.2) continue;
      for (std::size_t k = 0; k < walls.size(); ++k)
        if ((at.head<2>() - artefact.cones[k].centre_mm).norm() < artefact.cone_top_radius_mm) walls[k]->push_back(p);
    }
    Eigen::VectorXf plane;
    if (!Fit<pcl::SampleConsensusModelPlane<pcl::PointXYZ>>(
            pcl::make_shared<pcl::SampleConsensusModelPlane<pcl::PointXYZ>>(upper), 0.006, &plane))
      return std::nullopt;
    if (plane(2) < 0) plane = -plane;
    for (std::size_t k = 0; k < walls.size(); ++k) {
      Cloud::Ptr slice(new Cloud);
      for (const pcl::PointXYZ& p : *walls[k])
        if (std::abs(plane(0) * p.x + plane(1) * p.y + plane(2) * p.z + plane(3) + kDepthMm) < kHalfSliceMm)
          slice->push_back(p);
      Eigen::VectorXf circle;
      if (slice->size() < 20 ||
          !Fit<pcl::SampleConsensusModelCircle2D<pcl::PointXYZ>>(
              pcl::make_shared<pcl::SampleConsensusModelCircle2D<pcl::PointXYZ>>(slice), kHalfSliceMm, &circle))
        return std::nullopt;
      // Along the cone's axis up to the plane.
      const double x = circle(0) + plane(0) * kDepthMm, y = circle(1) + plane(1) * kDepthMm;
      const Eigen::Vector3d centre(x, y, -(plane(0) * x + plane(1) * y + plane(3)) / plane(2));
      const Eigen::Vector3d in_machine = machine_from_artefact * centre;
      // Back to the sensor: p_machine = R (0, y, z) + (x, 0, 0) - V0 + T has one solution.
      Eigen::Matrix3d linear;
      linear << Eigen::Vector3d::UnitX(), near.rotation.col(1), near.rotation.col(2);
      const Eigen::Vector3d p = linear.inverse() * (in_machine + scan.v0_mm - near.t_sm_mm);
      from.emplace_back(0, p.y(), p.z());
      onto.push_back(*metrology::TouchedCentre(touch, artefact.cones[k].name) + scan.v0_mm -
                     Eigen::Vector3d(p.x(), 0, 0));
    }
  }
  const Eigen::Isometry3d fit = metrology::RigidFit(from, onto);
  metrology::SensorPose sensor = metrology::SensorPose::Exact();
  sensor.rotation = fit.linear();
  sensor.t_sm_mm = fit.translation();
  return sensor;
}

}  // namespace sixpoint::bench

#include "bench/pcl/pcl_artefact.h"

#include <absl/status/status.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/lmeds.h>
#include <pcl/sample_consensus/mlesac.h>
#include <pcl/sample_consensus/msac.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_circle.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace sixpoint::bench {
namespace {

using metrology::FacePoint;
using metrology::Recess;
using Point = pcl::PointXYZ;
using Cloud = pcl::PointCloud<Point>;
using Model = pcl::SampleConsensusModel<Point>;
using PlaneModel = pcl::SampleConsensusModelPerpendicularPlane<Point>;

constexpr std::size_t kFewCount = 2'500;  // as ours
constexpr double kPlaneBandMm = 0.03;
constexpr double kNeighbourMm = 8, kLeastShare = 1.0 / 30;
constexpr int kTrials = 500;
constexpr float kVoxelMm = 0.25f;      // as our cells
constexpr unsigned kLeastInVoxel = 3;  // fewer are strays
constexpr double kClusterGapMm = 1.1;  // a hole cut by missing profiles is one; holes stand 3 mm apart
constexpr double kMatchMm = 0.7;

std::shared_ptr<pcl::SampleConsensus<Point>> Make(Consensus consensus, const Model::Ptr& model, double band_mm) {
  switch (consensus) {
    case Consensus::kRansac:
      return std::make_shared<pcl::RandomSampleConsensus<Point>>(model, band_mm);
    case Consensus::kMsac:
      return std::make_shared<pcl::MEstimatorSampleConsensus<Point>>(model, band_mm);
    case Consensus::kMlesac:
      return std::make_shared<pcl::MaximumLikelihoodSampleConsensus<Point>>(model, band_mm);
    case Consensus::kLmeds:
      return std::make_shared<pcl::LeastMedianSquares<Point>>(model, band_mm);
  }
  return nullptr;
}

std::optional<Eigen::VectorXf> Consented(Consensus consensus, const Model::Ptr& model, double band_mm) {
  const auto search = Make(consensus, model, band_mm);
  search->setMaxIterations(kTrials);
  if (!search->computeModel()) return std::nullopt;
  Eigen::VectorXf found;
  search->getModelCoefficients(found);
  return found;
}

// Least squares of what lies in the band about it.
Eigen::VectorXf Refined(const Model& model, const Eigen::VectorXf& start, double band_mm) {
  pcl::Indices inliers;
  const_cast<Model&>(model).selectWithinDistance(start, band_mm, inliers);
  Eigen::VectorXf refined = start;
  if (inliers.size() > 3) model.optimizeModelCoefficients(inliers, start, refined);
  return refined;
}

// Floats hold what is near the origin.
Cloud::Ptr CloudOf(const metrology::Points& points_mm, const Eigen::Vector3d& origin_mm) {
  Cloud::Ptr cloud(new Cloud);
  cloud->reserve(points_mm.size());
  for (const Eigen::Vector3d& p : points_mm) {
    const Eigen::Vector3f at = (p - origin_mm).cast<float>();
    cloud->emplace_back(at.x(), at.y(), at.z());
  }
  return cloud;
}

PlaneModel::Ptr LevelPlane(const Cloud::Ptr& cloud) {
  const auto model = pcl::make_shared<PlaneModel>(cloud);
  model->setAxis(Eigen::Vector3f::UnitZ());
  model->setEpsAngle(M_PI / 6);
  return model;
}

double HeightOf(const Eigen::VectorXf& plane, const Point& p) {
  return plane[0] * p.x + plane[1] * p.y + plane[2] * p.z + plane[3];
}

// A cone's centre from the circle at half its depth.
std::optional<Eigen::Vector2d> ConeCentre(const std::vector<FacePoint>& seen, const metrology::Artefact& artefact,
                                          const Eigen::Vector2d& near) {
  const double depth = artefact.ConeDepth() / 2, half_slice = 0.1;
  const double radius = artefact.cone_top_radius_mm - depth * std::tan(artefact.cone_half_angle_rad);
  Cloud::Ptr slice(new Cloud);
  for (const FacePoint& s : seen)
    if (std::abs(s.depth - depth) < half_slice && (s.at - near).norm() < artefact.cone_top_radius_mm + kClusterGapMm)
      slice->emplace_back(static_cast<float>(s.at.x()), static_cast<float>(s.at.y()), 0.0f);
  if (slice->size() < 20) return std::nullopt;
  const auto model = pcl::make_shared<pcl::SampleConsensusModelCircle2D<Point>>(slice);
  model->setRadiusLimits(radius - 0.2, radius + 0.2);
  const auto circle = Consented(Consensus::kRansac, model, half_slice);
  if (!circle) return std::nullopt;
  return Refined(*model, *circle, half_slice).head<2>().cast<double>();
}

struct Feature {
  Eigen::Vector2d centre;
  bool slot;
};

// The record's features laid on the holes by a rigid motion in the face.
struct Laid {
  Eigen::Isometry2d pose = Eigen::Isometry2d::Identity();
  int cones = 0, count = 0;
  double squares = 0;
  Eigen::Matrix2Xd from, onto;  // what matched
};

Laid Lay(const std::vector<Feature>& features, const std::vector<Recess>& regions, const Eigen::Isometry2d& pose) {
  Laid laid;
  laid.pose = pose;
  laid.from.resize(2, static_cast<Eigen::Index>(features.size()));
  laid.onto = laid.from;
  for (const Feature& feature : features) {
    const Recess* nearest = nullptr;
    double best = kMatchMm * kMatchMm;
    for (const Recess& region : regions) {
      const double squared = (region.centre - pose * feature.centre).squaredNorm();
      if (region.slot != feature.slot || squared >= best) continue;
      best = squared;
      nearest = &region;
    }
    if (nearest == nullptr) continue;
    laid.from.col(laid.count) = feature.centre;
    laid.onto.col(laid.count++) = nearest->centre;
    laid.cones += feature.slot ? 0 : 1;
    laid.squares += best;
  }
  laid.from.conservativeResize(2, laid.count);
  laid.onto.conservativeResize(2, laid.count);
  return laid;
}

bool Better(const Laid& a, const Laid& b) {
  if (a.count != b.count) return a.count > b.count;
  return a.squares < b.squares;
}

// Every two round holes that stand apart as two cones do propose a pose; the fit of what then matches is kept.
Laid BestLaid(const metrology::Artefact& artefact, const std::vector<Recess>& regions) {
  std::vector<Feature> features;
  for (const auto& cone : artefact.cones) features.push_back({cone.centre_mm, false});
  for (const auto& slot : artefact.slots) features.push_back({slot.centre_mm, true});
  Laid best;
  for (std::size_t i = 0; i < artefact.cones.size(); ++i)
    for (std::size_t j = i + 1; j < artefact.cones.size(); ++j)
      for (const Recess& r : regions)
        for (const Recess& s : regions) {
          if (&r == &s || r.slot || s.slot) continue;
          Eigen::Matrix2d from, onto;
          from << features[i].centre, features[j].centre;
          onto << r.centre, s.centre;
          if (std::abs((from.col(1) - from.col(0)).norm() - (onto.col(1) - onto.col(0)).norm()) > kMatchMm) continue;
          const Laid proposed = Lay(features, regions, Eigen::Isometry2d(Eigen::umeyama(from, onto, false)));
          if (proposed.count < 3) continue;
          const Laid settled =
              Lay(features, regions, Eigen::Isometry2d(Eigen::umeyama(proposed.from, proposed.onto, false)));
          if (Better(settled, best)) best = settled;
        }
  return best;
}

}  // namespace

std::vector<metrology::Plane> PclFlatFaces(const metrology::Points& sample, double band_mm, std::size_t most,
                                           Consensus consensus) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : sample) middle += p / static_cast<double>(sample.size());
  const PlaneModel::Ptr all = LevelPlane(CloudOf(sample, middle));
  Cloud::Ptr few = CloudOf(metrology::EvenSample(sample, kFewCount), middle);
  const double least = std::max(10.0, kLeastShare * static_cast<double>(few->size()));
  std::vector<metrology::Plane> faces;
  while (faces.size() < most && static_cast<double>(few->size()) > least) {
    const PlaneModel::Ptr model = LevelPlane(few);
    const auto tree = pcl::make_shared<pcl::search::KdTree<Point>>();
    tree->setInputCloud(few);
    model->setSamplesMaxDist(kNeighbourMm, tree);
    const auto found = Consented(consensus, model, band_mm);
    if (!found || static_cast<double>(model->countWithinDistance(*found, band_mm)) < least) break;
    const Eigen::VectorXf plane = Refined(*all, Refined(*all, *found, band_mm), band_mm / 2);
    const Eigen::Vector3d normal = plane.head<3>().cast<double>() * (plane[2] < 0 ? -1 : 1);
    faces.push_back({normal.normalized(), middle - plane[3] * plane.head<3>().cast<double>()});
    Cloud::Ptr rest(new Cloud);
    for (const Point& p : *few)
      if (std::abs(HeightOf(plane, p)) >= 2 * band_mm) rest->push_back(p);
    if (rest->size() == few->size()) break;
    few = rest;
  }
  return faces;
}

std::vector<Recess> PclHolesBelow(const std::vector<FacePoint>& seen, const metrology::Artefact& artefact,
                                  HoleCentres centres) {
  using Flat = pcl::PointCloud<pcl::PointXYZI>;  // the depth as its intensity
  const double deepest = std::max(artefact.ConeDepth(), artefact.slot_depth_mm) + 0.2;
  Flat::Ptr low(new Flat);
  for (const FacePoint& s : seen) {
    if (s.depth < metrology::kBelowMm || s.depth > deepest) continue;
    pcl::PointXYZI p(static_cast<float>(s.depth));
    p.getVector3fMap() << s.at.cast<float>(), 0.0f;
    low->push_back(p);
  }
  if (low->empty()) return {};
  Flat::Ptr thin(new Flat);
  pcl::VoxelGrid<pcl::PointXYZI> grid;
  grid.setInputCloud(low);
  grid.setLeafSize(kVoxelMm, kVoxelMm, kVoxelMm);
  grid.setMinimumPointsNumberPerVoxel(kLeastInVoxel);
  grid.filter(*thin);
  const auto tree = pcl::make_shared<pcl::search::KdTree<pcl::PointXYZI>>();
  tree->setInputCloud(thin);
  std::vector<pcl::PointIndices> clusters;
  pcl::EuclideanClusterExtraction<pcl::PointXYZI> extraction;
  extraction.setClusterTolerance(kClusterGapMm);
  extraction.setMinClusterSize(10);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(thin);
  extraction.extract(clusters);
  const double widest = 2 * std::max(artefact.cone_top_radius_mm, artefact.slot_width_mm) + 1;
  std::vector<Recess> regions;
  for (const pcl::PointIndices& cluster : clusters) {
    Eigen::AlignedBox2f box;
    std::size_t floor = 0;
    for (const int i : cluster.indices) {
      const pcl::PointXYZI& p = (*thin)[static_cast<std::size_t>(i)];
      box.extend(p.getVector3fMap().head<2>());
      floor += std::abs(p.intensity - artefact.slot_depth_mm) < 0.05;
    }
    if (box.sizes().maxCoeff() > widest || box.sizes().minCoeff() < 0.5) continue;
    Recess region{box.center().cast<double>(), cluster.indices.size(), 2 * floor > cluster.indices.size()};
    if (!region.slot && centres == HoleCentres::kOfCircles)
      region.centre = ConeCentre(seen, artefact, region.centre).value_or(region.centre);
    regions.push_back(region);
  }
  return regions;
}

absl::StatusOr<metrology::ArtefactSighting> PclFindArtefact(const metrology::LineScan& scan,
                                                            const metrology::Artefact& artefact, HoleCentres centres) {
  const metrology::Points sample = metrology::EvenSample(scan.points_mm, kArtefactSampleCount);
  std::vector<FacePoint> seen(sample.size());
  Laid best;
  std::optional<metrology::FaceFrame> upper;
  for (const metrology::Plane& face : PclFlatFaces(sample, kPlaneBandMm, kMostArtefactFaces, Consensus::kRansac)) {
    const metrology::FaceFrame frame(face);
    for (std::size_t i = 0; i < sample.size(); ++i) seen[i] = frame.See(sample[i]);
    const Laid laid = BestLaid(artefact, PclHolesBelow(seen, artefact, centres));
    if (!Better(laid, best)) continue;
    best = laid;
    upper = frame;
    if (best.count == static_cast<int>(artefact.cones.size() + artefact.slots.size())) break;
  }
  if (!upper || best.cones < static_cast<int>(artefact.cones.size()))
    return absl::FailedPreconditionError("the artefact's pattern was not found");
  metrology::ArtefactSighting sighting;
  sighting.matched_features = best.count;
  Eigen::Matrix3d face;
  face << upper->u, upper->v, upper->plane.normal;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = best.pose.linear();
  sighting.sensor_from_artefact.linear() = face * turn;
  sighting.sensor_from_artefact.translation() = upper->plane.point + face.leftCols<2>() * best.pose.translation();
  return sighting;
}

}  // namespace sixpoint::bench

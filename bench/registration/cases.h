// The cases of the registration benchmark: a twisted blade of 200,000 triangles and scans of it with a known displacement,
// as shared/tools/registration_cases.py makes them (`--only generator` compares the two), any number of points of each.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::bench {

// A casting deviation: height_mm * exp(-r^2 / (2 sigma_mm^2)) along the normal, r in the part's x and z.
struct Bump {
  double x_mm = 4, z_mm = 12;
  double height_mm = 0.3;
  double sigma_mm = 8;
  int side = 1;  // faces whose normal has this sign in y

  double At(const Eigen::Vector3d& part_mm, const Eigen::Vector3d& normal) const;
};

// The blade's triangles have an area; its vertices are floats, as an STL holds them. Every edge is shared by two triangles.
struct Blade {
  metrology::TriangleMesh mesh;
  std::vector<Eigen::Vector3d> normals;  // of the triangles
  std::vector<double> areas_mm2;
  std::vector<std::uint32_t> trailing_edge;  // vertices, root to tip
};
// `shape` scales its twist, taper and lean: at 0 its section is constant, and its walls do not hold the span.
Blade TwistedBlade(double shape = 1);

Eigen::Isometry3d ScanFromPart();

enum class CaseKind {
  kOneSide,    // A: the span is weakly held
  kWellHeld,   // C and, with a bump, D: both sides and the tip
  kWholeBody,  // all faces, the root too
};

// Points of a scan, one after the other: spread over the faces by area, isotropic noise, carried by ScanFromPart.
class CaseSampler {
 public:
  // The blade lives longer.
  CaseSampler(const Blade& blade, CaseKind kind, double noise_mm, const std::optional<Bump>& bump, std::uint64_t seed);

  Eigen::Vector3d NextScanned();  // scan frame
  struct OnSurface {
    Eigen::Vector3d part_mm;
    Eigen::Vector3d normal;
  };
  OnSurface NextOnSurface();  // before bump and noise; counts for the bound too
  double NextUniform() { return uniform_(random_); }

  // Of the pose, from all points so far, for this noise: perturbations of scan_from_part as PoseCovariance has them, about
  // a reference in the scan frame. Its inverse is the Cramer-Rao bound.
  metrology::Matrix6d Information(const Eigen::Vector3d& reference_mm) const;

 private:
  const Blade& blade_;
  const double noise_mm_;
  const std::optional<Bump> bump_;
  std::vector<std::uint32_t> triangles_;
  std::vector<double> area_up_to_mm2_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::normal_distribution<double> normal_{0, 1};
  metrology::Matrix6d information_ = metrology::Matrix6d::Zero();  // part frame, about its origin, for 1 mm
};

struct CaseScan {
  metrology::Points scan_mm;
  metrology::PoseCovariance bound;  // Cramer-Rao, of scan_from_part
  double vertex_bound_um = 0;       // root mean square displacement of the mesh's vertices
  double square_scatter =
      0;  // standard deviation of that displacement's square at the bound, by its mean: 1.4 where one
          // direction is held much less than the others
};
CaseScan MakeScan(const Blade& blade, CaseKind kind, std::size_t count, double noise_mm,
                  const std::optional<Bump>& bump, std::uint64_t seed);

// Root mean square over the mesh's vertices, between two poses.
double VertexDisplacementUm(const Blade& blade, const Eigen::Isometry3d& one, const Eigen::Isometry3d& other);

// The same from a pose's covariance.
double VertexDisplacementUm(const Blade& blade, const Eigen::Isometry3d& pose,
                            const metrology::PoseCovariance& covariance);

// The same covariance about another reference.
metrology::PoseCovariance About(const metrology::PoseCovariance& covariance, const Eigen::Vector3d& reference_mm);

// The perturbation that takes the truth to what was found.
metrology::Vector6d PoseError(const Eigen::Isometry3d& found, const Eigen::Isometry3d& truth,
                              const Eigen::Vector3d& reference_mm);

}  // namespace sixpoint::bench

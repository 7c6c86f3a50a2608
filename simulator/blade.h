// A parametric turbine blade as a plant's design office would hand it over: closed mesh, hole groups, six datum points.
//
// Part frame, mm: z runs along the span from the root (0) to the tip, x from leading to trailing edge, y from the
// pressure to the suction side; the stacking axis is x = y = 0.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::simulator {

// Sections: a parabolic camber line with a half thickness 2 sqrt(u (1 - u)) (F0 + (F1 - F0) u) across it, u from the leading
// to the trailing edge: smooth all around, with edge radii 2 F^2 / chord.
struct AirfoilDesign {
  double span_mm = 45;
  double root_chord_mm = 31;
  double tip_chord_mm = 27;
  double camber_mm = 5;  // at mid chord of the root, in proportion to the chord elsewhere
  double leading_edge_radius_mm = 1.2;
  double trailing_edge_radius_mm = 0.4;
  double root_twist_deg = 14;  // section turned about the stacking axis, linear to
  double tip_twist_deg = -12;
  double lean_mm = 1.2;  // the stacking line bows towards the suction side by this at the tip (quadratic)
  int columns = 320;     // around a section, even
  int rows = 150;        // along the span
};

class Airfoil {
 public:
  explicit Airfoil(const AirfoilDesign& design) : design_(design) {}
  // turn in [0, 2 pi): 0 leading edge, 0..pi suction side, pi trailing edge, then the pressure side back.
  Eigen::Vector3d Point(double turn_rad, double z_mm) const;
  // Outward unit normal.
  Eigen::Vector3d Normal(double turn_rad, double z_mm) const;
  // Closed by flat caps at root and tip. Vertices hold single precision, so that an STL file carries them exactly.
  metrology::TriangleMesh Mesh() const;
  const AirfoilDesign& design() const { return design_; }

 private:
  AirfoilDesign design_;
};

struct DesignedHole {
  std::string name;
  Eigen::Vector3d start_mm, normal;
};

struct DesignedHoleGroup {
  std::string name;
  double diameter_mm = 0, depth_mm = 0;
  double a_nominal_deg = 0, b_nominal_deg = 0;  // puts `axis` along machine Z on ideal axes
  Eigen::Vector3d axis;                         // out of the part
  std::vector<DesignedHole> holes;
  double position_tolerance_mm = 0.08, inclination_tolerance_deg = 0.5;
};

struct DesignedDatum {
  std::string name;
  Eigen::Vector3d point_mm, normal;
};

// A place in a fixture that holds several of a part.
struct DesignedStation {
  std::string name;
  Eigen::Isometry3d zero_from_part_nominal;
};

struct DesignedPart {
  AirfoilDesign airfoil;
  metrology::TriangleMesh mesh;
  std::vector<DesignedHoleGroup> hole_groups;
  std::vector<DesignedDatum> six_points;
  Eigen::Isometry3d zero_from_part_nominal;
  std::vector<DesignedStation> stations;  // none: it stands alone
};

// A row of holes along the span.
struct HoleGroupDesign {
  std::string name;
  double diameter_mm = 0.44;
  double turn_deg = 0;       // where around the section
  double lean_deg = 0;       // of the axis from the surface normal, towards the trailing edge
  double span_lean_deg = 0;  // and towards the tip
  int holes = 5;
  double position_tolerance_mm = 0.08;
};
std::vector<HoleGroupDesign> UsualHoleGroups();

// The nominal pose stands the stacking axis on the nominal B axis (machine X), the root `root_from_centre_mm` from the
// nominal centre.
DesignedPart DesignPart(const AirfoilDesign& design, const Eigen::Vector3d& nominal_centre_mm,
                        double root_from_centre_mm = 24,
                        const std::vector<HoleGroupDesign>& hole_groups = UsualHoleGroups());

// Rows n x, n y, n z, (p - middle) x n scaled by the blade's half size: least over greatest singular value, 1 = best.
double NestConditioning(const std::vector<DesignedDatum>& datums);

// What the six-point nest leaves of a casting's deviation: nothing within 2.5 mm of a datum point nor on tip and root, then smoothly
// more, all of it within 7 mm.
double LeftByNest(const DesignedPart& part, const Eigen::Vector3d& point_mm);

// A casting: every vertex moved along its normal by a smooth field of at most greatest_mm that vanishes at the datum
// points, where the six-point nest holds the blade.
metrology::TriangleMesh Cast(const DesignedPart& part, double greatest_mm, std::uint64_t seed);

// A foil on it, as wide as a thumb.
void StickFoil(const DesignedDatum& datum, double thickness_mm, metrology::TriangleMesh* mesh);

// Little-endian binary STL.
std::string BinaryStl(const metrology::TriangleMesh& mesh);

}  // namespace sixpoint::simulator

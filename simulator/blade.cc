#include "simulator/blade.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "metrology/frames/angles.h"
#include "simulator/random.h"
#include "simulator/ray_tracer.h"

namespace sixpoint::simulator {
namespace {

using metrology::kPi;
using metrology::kRadPerDeg;
// No datum point nearer to a hole than this, nor to the tip's or the root's edge.
constexpr double kDatumFromHole_mm = 5;
constexpr double kDatumFromEdge_mm = 5;

// GCC 12 at -O2 drops a vectorised rounding to float and back (seen in lane x); volatile keeps it.
Eigen::Vector3d SinglePrecision(const Eigen::Vector3d& p) {
  const volatile float x = static_cast<float>(p.x()), y = static_cast<float>(p.y()), z = static_cast<float>(p.z());
  return {x, y, z};
}

// Where a line through `near` along `direction` enters the part from outside.
Eigen::Vector3d OnSurface(const TriangleShape& surface, const Eigen::Vector3d& near, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d origin = near + 2 * direction;
  const auto hit = surface.Intersect({origin, -direction}, 4);
  return hit ? Eigen::Vector3d(origin - hit->distance_mm * direction) : near;
}

std::vector<DesignedHoleGroup> DesignHoles(const Airfoil& airfoil, const TriangleShape& surface,
                                           const Eigen::Matrix3d& zero_from_part,
                                           const std::vector<HoleGroupDesign>& designs) {
  std::vector<DesignedHoleGroup> groups;
  const double span = airfoil.design().span_mm;
  for (const HoleGroupDesign& plan : designs) {
    const double turn = plan.turn_deg * kRadPerDeg;
    DesignedHoleGroup group;
    group.name = plan.name;
    group.diameter_mm = plan.diameter_mm;
    group.position_tolerance_mm = plan.position_tolerance_mm;
    group.depth_mm = 6;
    // The group's axis: the normal at mid span, leaned about the span and about the chord.
    const Eigen::Vector3d normal = airfoil.Normal(turn, span / 2);
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(normal).normalized();
    group.axis = (Eigen::AngleAxisd(-plan.lean_deg * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(-plan.span_lean_deg * kRadPerDeg, across) * normal)
                     .normalized();
    const Eigen::Vector3d v = zero_from_part * group.axis;
    const double b = std::atan2(v.y(), v.z());
    group.b_nominal_deg = b / kRadPerDeg;
    group.a_nominal_deg = std::atan2(-v.x(), v.y() * std::sin(b) + v.z() * std::cos(b)) / kRadPerDeg;
    for (int k = 0; k < plan.holes; ++k) {
      const double z = span * (0.26 + 0.5 * k / (plan.holes - 1));
      group.holes.push_back({"H" + std::to_string(k + 1), OnSurface(surface, airfoil.Point(turn, z), group.axis),
                             airfoil.Normal(turn, z)});
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

Eigen::Matrix<double, 6, 1> NestRow(const DesignedDatum& datum, const Eigen::Vector3d& middle) {
  constexpr double kHalfSize_mm = 18;
  Eigen::Matrix<double, 6, 1> row;
  row << datum.normal, (datum.point_mm - middle).cross(datum.normal) / kHalfSize_mm;
  return row;
}

// One point on the tip; the five others exchanged one at a time for better ones until none is.
std::vector<DesignedDatum> ChooseDatums(const Airfoil& airfoil, const TriangleShape& surface,
                                        const std::vector<DesignedHoleGroup>& groups) {
  const double span = airfoil.design().span_mm;
  std::vector<DesignedDatum> candidates;
  for (int turn_deg = 35; turn_deg < 330; turn_deg += 10) {
    if (turn_deg > 140 && turn_deg < 220) continue;  // the trailing edge is too sharp for a local surface
    for (int k = 0; k <= 6; ++k) {
      const double z = kDatumFromEdge_mm + (span - 2 * kDatumFromEdge_mm) * k / 6;
      const Eigen::Vector3d normal = airfoil.Normal(turn_deg * kRadPerDeg, z);
      const Eigen::Vector3d point = OnSurface(surface, airfoil.Point(turn_deg * kRadPerDeg, z), normal);
      bool clear = true;
      for (const auto& group : groups)
        for (const auto& hole : group.holes) clear = clear && (hole.start_mm - point).norm() > kDatumFromHole_mm;
      if (clear) candidates.push_back({"", point, normal});
    }
  }
  std::vector<DesignedDatum> chosen;
  for (std::size_t i = 0; i < 5; ++i) chosen.push_back(candidates[i * (candidates.size() - 1) / 4]);
  const Eigen::Vector3d camber_middle = 0.5 * (airfoil.Point(kPi / 2, span) + airfoil.Point(1.5 * kPi, span));
  chosen.push_back({"", SinglePrecision(camber_middle), Eigen::Vector3d::UnitZ()});
  double best = NestConditioning(chosen);
  for (bool better = true; better;) {
    better = false;
    for (std::size_t i = 0; i < 5; ++i) {
      for (const DesignedDatum& candidate : candidates) {
        const DesignedDatum before = chosen[i];
        chosen[i] = candidate;
        const double conditioning = NestConditioning(chosen);
        if (conditioning > best + 1e-9) {
          best = conditioning;
          better = true;
        } else {
          chosen[i] = before;
        }
      }
    }
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) chosen[i].name = "D" + std::to_string(i + 1);
  return chosen;
}

}  // namespace

Eigen::Vector3d Airfoil::Point(double turn_rad, double z_mm) const {
  const AirfoilDesign& d = design_;
  const double s = z_mm / d.span_mm;
  const double chord = d.root_chord_mm + (d.tip_chord_mm - d.root_chord_mm) * s;
  const double camber = d.camber_mm * chord / d.root_chord_mm;
  const double u = (1 - std::cos(turn_rad)) / 2;
  const double front = std::sqrt(d.leading_edge_radius_mm * chord / 2);
  const double back = std::sqrt(d.trailing_edge_radius_mm * chord / 2);
  const double half_thickness = std::sin(turn_rad) * (front + (back - front) * u);  // sin = +-2 sqrt(u (1 - u))
  const double slope = 4 * camber * (1 - 2 * u) / chord;
  const Eigen::Vector2d across = Eigen::Vector2d(-slope, 1) / std::hypot(slope, 1);
  const Eigen::Vector2d section =
      Eigen::Vector2d((u - 0.5) * chord, 4 * camber * (u * (1 - u) - 1.0 / 6)) + half_thickness * across;
  const double twist = (d.root_twist_deg + (d.tip_twist_deg - d.root_twist_deg) * s) * kRadPerDeg;
  const Eigen::Vector2d turned = Eigen::Rotation2Dd(twist) * section;
  return {turned.x(), turned.y() + d.lean_mm * s * s, z_mm};
}

Eigen::Vector3d Airfoil::Normal(double turn_rad, double z_mm) const {
  const double step = 1e-5;
  const Eigen::Vector3d around = Point(turn_rad + step, z_mm) - Point(turn_rad - step, z_mm);
  const Eigen::Vector3d along = Point(turn_rad, z_mm + step) - Point(turn_rad, z_mm - step);
  return along.cross(around).normalized();
}

metrology::TriangleMesh Airfoil::Mesh() const {
  metrology::TriangleMesh mesh;
  mesh.closed = true;
  const auto columns = static_cast<std::uint32_t>(design_.columns), rows = static_cast<std::uint32_t>(design_.rows);
  for (std::uint32_t row = 0; row <= rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column)
      mesh.vertices_mm.push_back(SinglePrecision(Point(2 * kPi * column / columns, design_.span_mm * row / rows)));
  const auto vertex = [&](std::uint32_t row, std::uint32_t column) { return row * columns + column % columns; };
  // Suction side first, seen from outside: turning goes against the counter-clockwise sense about +z.
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t a = vertex(row, column), b = vertex(row, column + 1);
      const std::uint32_t c = vertex(row + 1, column + 1), d = vertex(row + 1, column);
      mesh.triangles.push_back({a, c, b});
      mesh.triangles.push_back({a, d, c});
    }
  }
  // Caps: ladders between the points of both sides at equal chord positions.
  for (const std::uint32_t row : {0u, rows}) {
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (row == 0)
        mesh.triangles.push_back({a, b, c});
      else
        mesh.triangles.push_back({a, c, b});
    };
    const std::uint32_t half = columns / 2;
    add(vertex(row, 0), vertex(row, 1), vertex(row, columns - 1));
    for (std::uint32_t k = 1; k + 1 < half; ++k) {
      const std::uint32_t s0 = vertex(row, k), s1 = vertex(row, k + 1);
      const std::uint32_t p0 = vertex(row, columns - k), p1 = vertex(row, columns - k - 1);
      add(s0, s1, p1);
      add(s0, p1, p0);
    }
    add(vertex(row, half - 1), vertex(row, half), vertex(row, half + 1));
  }
  return mesh;
}

double NestConditioning(const std::vector<DesignedDatum>& datums) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const DesignedDatum& datum : datums) middle += datum.point_mm / static_cast<double>(datums.size());
  Eigen::MatrixXd rows(datums.size(), 6);
  for (std::size_t i = 0; i < datums.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = NestRow(datums[i], middle).transpose();
  const Eigen::VectorXd values = rows.jacobiSvd().singularValues();
  return values(5) / values(0);
}

std::vector<HoleGroupDesign> UsualHoleGroups() {
  return {{"G1", 0.44, 62, 35, 3, 5}, {"G2", 0.44, 285, -28, -4, 5}, {"G3", 0.40, 118, 30, 2, 4}};
}

DesignedPart DesignPart(const AirfoilDesign& design, const Eigen::Vector3d& nominal_centre_mm,
                        double root_from_centre_mm, const std::vector<HoleGroupDesign>& hole_groups) {
  const Airfoil airfoil(design);
  DesignedPart part;
  part.airfoil = design;
  part.mesh = airfoil.Mesh();
  // Span along machine X, chord along Y, the suction side up.
  Eigen::Matrix3d turn;
  turn << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  part.zero_from_part_nominal = Eigen::Isometry3d::Identity();
  part.zero_from_part_nominal.linear() = turn;
  part.zero_from_part_nominal.translation() = nominal_centre_mm + Eigen::Vector3d(root_from_centre_mm, 0, 0);
  const TriangleShape surface(part.mesh);
  part.hole_groups = DesignHoles(airfoil, surface, turn, hole_groups);
  part.six_points = ChooseDatums(airfoil, surface, part.hole_groups);
  return part;
}

double LeftByNest(const DesignedPart& part, const Eigen::Vector3d& point_mm) {
  const auto rise = [](double s) {
    s = std::clamp(s, 0.0, 1.0);
    return s * s * s * (10 - 15 * s + 6 * s * s);
  };
  double left = rise(std::min(point_mm.z(), part.airfoil.span_mm - point_mm.z()) / 4);
  for (const DesignedDatum& datum : part.six_points) left *= rise(((point_mm - datum.point_mm).norm() - 2.5) / 4.5);
  return left;
}

metrology::TriangleMesh Cast(const DesignedPart& part, double greatest_mm, std::uint64_t seed) {
  metrology::TriangleMesh mesh = part.mesh;
  if (greatest_mm == 0) return mesh;
  struct Bump {
    Eigen::Vector3d centre;
    double height_mm, width_mm;
  };
  Random random(seed);
  std::vector<Bump> bumps;
  for (int k = 0; k < 12; ++k) {
    const Eigen::Vector3d centre =
        Airfoil(part.airfoil).Point(random.Uniform(0, 2 * kPi), random.Uniform(0, part.airfoil.span_mm));
    const double height = random.Uniform(-1, 1), width = random.Uniform(6, 12);
    bumps.push_back({centre, height, width});
  }
  Airfoil airfoil(part.airfoil);
  std::vector<double> deviation(mesh.vertices_mm.size());
  double greatest = 0;
  for (std::size_t i = 0; i < deviation.size(); ++i) {
    double value = 0;
    for (const Bump& bump : bumps)
      value += bump.height_mm *
               std::exp(-(mesh.vertices_mm[i] - bump.centre).squaredNorm() / (bump.width_mm * bump.width_mm));
    deviation[i] = value * LeftByNest(part, mesh.vertices_mm[i]);
    greatest = std::max(greatest, std::abs(deviation[i]));
  }
  if (greatest == 0) return mesh;
  const auto columns = static_cast<std::size_t>(part.airfoil.columns);
  for (std::size_t i = 0; i < deviation.size(); ++i) {
    const double turn = 2 * kPi * static_cast<double>(i % columns) / static_cast<double>(columns);
    mesh.vertices_mm[i] = SinglePrecision(mesh.vertices_mm[i] + greatest_mm * deviation[i] / greatest *
                                                                    airfoil.Normal(turn, mesh.vertices_mm[i].z()));
  }
  return mesh;
}

void StickFoil(const DesignedDatum& datum, double thickness_mm, metrology::TriangleMesh* mesh) {
  constexpr double kRadius_mm = 5;
  for (Eigen::Vector3d& vertex : mesh->vertices_mm)
    if ((vertex - datum.point_mm).norm() < kRadius_mm) vertex += thickness_mm * datum.normal;
}

std::string BinaryStl(const metrology::TriangleMesh& mesh) {
  static_assert(sizeof(float) == 4);
  std::string bytes(80, '\0');
  const std::string title = "Sixpoint simulator: parametric blade, mm";
  std::copy(title.begin(), title.end(), bytes.begin());
  const auto append = [&](const void* value, std::size_t size) { bytes.append(static_cast<const char*>(value), size); };
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  bytes.reserve(84 + 50 * mesh.triangles.size());
  append(&count, 4);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d &p = mesh.vertices_mm[a], &q = mesh.vertices_mm[b], &r = mesh.vertices_mm[c];
    const Eigen::Vector3f values[4] = {(q - p).cross(r - p).normalized().cast<float>(), p.cast<float>(),
                                       q.cast<float>(), r.cast<float>()};
    for (const Eigen::Vector3f& value : values) append(value.data(), 12);
    const std::uint16_t attribute = 0;
    append(&attribute, 2);
  }
  return bytes;
}

}  // namespace sixpoint::simulator

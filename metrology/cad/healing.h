// Edges of real CAD lie off their faces, by what another system's curves approximate. The faces are the part; an edge only says where one
// ends and the next begins. So an edge that is off is put to where its faces meet, and what they lack to meet is told.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <vector>

#include "metrology/cad/refinement.h"

namespace sixpoint::metrology {

// How far edges were found off their faces, at most, and where.
struct EdgesOff {
  double distance_mm = 0;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();

  // INVALID_ARGUMENT beyond the greatest, with the distance and the place.
  absl::Status Check(double greatest_mm) const;
};

struct FaceUv {
  std::uint16_t face;
  Eigen::Vector2d uv;
};

// A point of an edge, or a corner, farther than least_mm from one of its faces: moved as near to all of them as it goes, along no direction
// in which they do not tell where they meet (faces that go on smoothly). Left as it is where that does not bring it nearer.
void Heal(const ShapeGeometry& shape, double least_mm, Eigen::Vector3d* point_mm, std::vector<FaceUv>* on_faces,
          EdgesOff* off);

// The same of every vertex.
void HealVertices(const ShapeGeometry& shape, double least_mm, CoarseMesh* mesh, EdgesOff* off);

// Where each chord is cut: in the middle of its curve, or on its faces where that is off them.
class ChordMiddles {
 public:
  ChordMiddles(const ShapeGeometry& shape, double least_mm, EdgesOff* off)
      : shape_(shape), least_mm_(least_mm), off_(*off) {}

  // Borders in their order.
  void AddBorder(std::uint32_t border, std::uint32_t chord);
  // Once it has its borders, and again when it was cut.
  void Find(const CoarseMesh& mesh, std::uint32_t chord);
  const Eigen::Vector3d& point_mm(std::uint32_t chord) const { return points_mm_[chord]; }
  const Eigen::Vector2d& uv(std::uint32_t border) const { return uvs_[border]; }

 private:
  const ShapeGeometry& shape_;
  const double least_mm_;
  EdgesOff& off_;
  std::vector<std::vector<std::uint32_t>> borders_of_;  // chord
  Points points_mm_;
  std::vector<Eigen::Vector2d> uvs_;
};

}  // namespace sixpoint::metrology

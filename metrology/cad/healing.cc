#include "metrology/cad/healing.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr int kStepLimit = 12;
constexpr double kRestedMm = 1e-7;
// Of the eigenvalues of the faces' directions: at 0.04, two faces at less than 23 degrees count as one that goes on.
constexpr double kLeastHeld = 0.04;

double FarthestFace(const ShapeGeometry& shape, const Vector3d& point_mm, const std::vector<FaceUv>& on_faces) {
  double farthest_mm = 0;
  for (const FaceUv& on : on_faces)
    farthest_mm = std::max(farthest_mm, (shape.FacePoint(on.face, on.uv) - point_mm).norm());
  return farthest_mm;
}

// The shortest step to where the faces' planes meet, or come nearest to each other.
Vector3d Step(const ShapeGeometry& shape, const Vector3d& point_mm, std::vector<FaceUv>* on_faces) {
  Eigen::Matrix3d held = Eigen::Matrix3d::Zero();
  Vector3d pull = Vector3d::Zero();
  for (FaceUv& on : *on_faces) {
    on.uv = shape.FaceFoot(on.face, point_mm, on.uv);
    const Vector3d to_face = shape.FacePoint(on.face, on.uv) - point_mm;
    const Vector3d normal = shape.FaceNormal(on.face, on.uv);
    // Beyond a face's end, or at a pole, the way to it is no normal.
    const double distance = to_face.norm();
    const bool beside = normal.isZero() || std::abs(to_face.dot(normal)) < 0.9 * distance;
    const Vector3d towards = beside && distance > kRestedMm ? Vector3d(to_face / distance) : normal;
    held += towards * towards.transpose();
    pull += towards.dot(to_face) * towards;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(held);
  Vector3d step = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const double value = eigen.eigenvalues()[k];
    if (!(value > kLeastHeld * eigen.eigenvalues()[2])) continue;
    step += eigen.eigenvectors().col(k) * (eigen.eigenvectors().col(k).dot(pull) / value);
  }
  return step;
}

}  // namespace

absl::Status EdgesOff::Check(double greatest_mm) const {
  if (distance_mm <= greatest_mm) return absl::OkStatus();
  return Refuse("cad.faces",
                "an edge " + Rounded(distance_mm) + " mm off its face at (" + Rounded(at_mm.x()) + ", " +
                    Rounded(at_mm.y()) + ", " + Rounded(at_mm.z()) + ") mm",
                "edges within " + NumberText(greatest_mm) + " mm of their faces");
}

void Heal(const ShapeGeometry& shape, double least_mm, Vector3d* point_mm, std::vector<FaceUv>* on_faces,
          EdgesOff* off) {
  const double before_mm = FarthestFace(shape, *point_mm, *on_faces);
  if (before_mm > off->distance_mm || !std::isfinite(before_mm)) *off = {before_mm, *point_mm};
  if (!(before_mm > least_mm)) return;
  Vector3d moved = *point_mm;
  std::vector<FaceUv> there = *on_faces;
  for (int k = 0; k < kStepLimit; ++k) {
    const Vector3d step = Step(shape, moved, &there);
    moved += step;
    if (step.norm() < kRestedMm) break;
  }
  for (FaceUv& on : there) on.uv = shape.FaceFoot(on.face, moved, on.uv);
  // Farther than it was off, it is somewhere else.
  if (!moved.allFinite() || !((moved - *point_mm).norm() <= 2 * before_mm)) return;
  if (!(FarthestFace(shape, moved, there) < before_mm)) return;
  *point_mm = moved;
  *on_faces = std::move(there);
}

void HealVertices(const ShapeGeometry& shape, double least_mm, CoarseMesh* mesh, EdgesOff* off) {
  std::vector<std::vector<std::uint32_t>> nodes_of(mesh->vertices_mm.size());
  for (std::uint32_t n = 0; n < mesh->nodes.size(); ++n) nodes_of[mesh->nodes[n].vertex].push_back(n);
  for (std::size_t v = 0; v < nodes_of.size(); ++v) {
    std::vector<FaceUv> on_faces;
    for (const std::uint32_t n : nodes_of[v]) on_faces.push_back({mesh->nodes[n].face, mesh->nodes[n].uv});
    Heal(shape, least_mm, &mesh->vertices_mm[v], &on_faces, off);
    for (std::size_t i = 0; i < nodes_of[v].size(); ++i) mesh->nodes[nodes_of[v][i]].uv = on_faces[i].uv;
  }
}

void ChordMiddles::AddBorder(std::uint32_t border, std::uint32_t chord) {
  if (borders_of_.size() <= chord) borders_of_.resize(chord + 1);
  borders_of_[chord].push_back(border);
  uvs_.resize(std::max<std::size_t>(uvs_.size(), border + 1));
}

void ChordMiddles::Find(const CoarseMesh& mesh, std::uint32_t chord) {
  if (borders_of_.size() <= chord) borders_of_.resize(chord + 1);
  points_mm_.resize(std::max<std::size_t>(points_mm_.size(), chord + 1));
  const CoarseMesh::Chord& piece = mesh.chords[chord];
  const double parameter = (piece.first + piece.last) / 2;
  std::vector<FaceUv> on_faces;
  for (const std::uint32_t b : borders_of_[chord]) {
    const CoarseMesh::Border& border = mesh.borders[b];
    on_faces.push_back({mesh.nodes[border.nodes[0]].face, shape_.CurveUv(border.curve_on_face, parameter)});
  }
  points_mm_[chord] = shape_.CurvePoint(piece.curve, parameter);
  Heal(shape_, least_mm_, &points_mm_[chord], &on_faces, &off_);
  for (std::size_t i = 0; i < on_faces.size(); ++i) uvs_[borders_of_[chord][i]] = on_faces[i].uv;
}

}  // namespace sixpoint::metrology

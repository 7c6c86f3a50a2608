#include "metrology/cad/tessellation.h"

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <Eigen/LU>
#include <Geom2d_Curve.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <Standard_Failure.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "metrology/cad/cad_file.h"
#include "metrology/cad/cad_refusal.h"
#include "metrology/cad/refinement.h"
#include "metrology/mesh/skin.h"
#include "metrology/mesh/volume.h"
#include "metrology/mesh/weld.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

constexpr double kLeastExtentMm = 0.1, kGreatestExtentMm = 10e3;
// Faces that share an edge get the same points on it; rounding by locations is far below this.
constexpr double kWeldToleranceMm = 1e-6;
constexpr double kCoarseDeflectionMm = 0.05;
constexpr double kCoarseAngleRad = 0.5;
constexpr int kFootSteps = 8;
constexpr double kFootRestedMm = 1e-8;

Eigen::Vector3d ToEigen(const gp_XYZ& v) { return {v.X(), v.Y(), v.Z()}; }

absl::Status CheckExtent(const TopoDS_Shape& shape, double* extent_mm) {
  Bnd_Box box;
  BRepBndLib::Add(shape, box, false);
  if (box.IsVoid()) return RefuseCad("extent", "empty", "a surface");
  if (box.IsOpen()) return RefuseCad("extent", "infinite", "a bounded surface");
  double low[3], high[3];
  box.Get(low[0], low[1], low[2], high[0], high[1], high[2]);
  const double extent = *extent_mm = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  if (!(extent >= kLeastExtentMm && extent <= kGreatestExtentMm))
    return RefuseCad("extent_mm", Rounded(extent), "0.1 to 10000; are its units right?");
  return absl::OkStatus();
}

// The shape's faces and edges, evaluated.
class OcctGeometry : public ShapeGeometry {
 public:
  OcctGeometry(const TopTools_IndexedMapOfShape& faces, const TopTools_IndexedMapOfShape& edges) {
    for (int i = 1; i <= faces.Extent(); ++i) {
      const TopoDS_Face& face = TopoDS::Face(faces(i));
      surfaces_.emplace_back(face, false);
      // A mirrored face's parameters run the other way round.
      const bool inward = (face.Orientation() == TopAbs_REVERSED) != bool(surfaces_.back().Trsf().IsNegative());
      signs_.push_back(inward ? -1.0 : 1.0);
    }
    for (int i = 1; i <= edges.Extent(); ++i) {
      const TopoDS_Edge& edge = TopoDS::Edge(edges(i));
      curves_.push_back(BRep_Tool::Degenerated(edge) ? BRepAdaptor_Curve() : BRepAdaptor_Curve(edge));
    }
  }
  std::uint32_t AddCurveOnFace(const Handle(Geom2d_Curve) & curve) {
    curves_on_faces_.push_back(curve);
    return static_cast<std::uint32_t>(curves_on_faces_.size() - 1);
  }
  Eigen::Vector3d FacePoint(std::uint16_t face, const Eigen::Vector2d& uv) const override {
    return ToEigen(surfaces_[face].Value(uv.x(), uv.y()).XYZ());
  }
  Eigen::Vector3d FaceNormal(std::uint16_t face, const Eigen::Vector2d& uv) const override {
    gp_Pnt point;
    gp_Vec du, dv;
    surfaces_[face].D1(uv.x(), uv.y(), point, du, dv);
    const Eigen::Vector3d u = ToEigen(du.XYZ()), v = ToEigen(dv.XYZ()), cross = u.cross(v);
    if (!(cross.norm() > 1e-9 * u.norm() * v.norm())) return Eigen::Vector3d::Zero();
    return signs_[face] * cross.normalized();
  }
  // Newton's steps; within the surface's own bounds, for beyond them it may do anything.
  Eigen::Vector2d FaceFoot(std::uint16_t face, const Eigen::Vector3d& point_mm,
                           const Eigen::Vector2d& near_uv) const override {
    const BRepAdaptor_Surface& surface = surfaces_[face];
    const auto within = [](double value, bool turns, double first, double last) {
      return turns ? value : std::clamp(value, std::min(first, last), std::max(first, last));
    };
    Eigen::Vector2d uv = near_uv;
    for (int k = 0; k < kFootSteps; ++k) {
      gp_Pnt at;
      gp_Vec du, dv;
      surface.D1(uv.x(), uv.y(), at, du, dv);
      Eigen::Matrix<double, 3, 2> slopes;
      slopes << ToEigen(du.XYZ()), ToEigen(dv.XYZ());
      const Eigen::Matrix2d normal = slopes.transpose() * slopes;
      if (!(std::abs(normal.determinant()) > 1e-12 * normal(0, 0) * normal(1, 1))) break;
      const Eigen::Vector2d step = normal.inverse() * (slopes.transpose() * (point_mm - ToEigen(at.XYZ())));
      const Eigen::Vector2d next(
          within(uv.x() + step.x(), surface.IsUPeriodic(), surface.FirstUParameter(), surface.LastUParameter()),
          within(uv.y() + step.y(), surface.IsVPeriodic(), surface.FirstVParameter(), surface.LastVParameter()));
      const double moved_mm = (slopes * (next - uv)).norm();
      uv = next;
      if (!(moved_mm > kFootRestedMm)) break;
    }
    return uv;
  }
  Eigen::Vector3d CurvePoint(std::uint32_t curve, double parameter) const override {
    return ToEigen(curves_[curve].Value(parameter).XYZ());
  }
  Eigen::Vector2d CurveUv(std::uint32_t curve_on_face, double parameter) const override {
    const gp_Pnt2d uv = curves_on_faces_[curve_on_face]->Value(parameter);
    return {uv.X(), uv.Y()};
  }

 private:
  std::vector<BRepAdaptor_Surface> surfaces_;
  std::vector<double> signs_;
  std::vector<BRepAdaptor_Curve> curves_;
  std::vector<Handle(Geom2d_Curve)> curves_on_faces_;
};

// The kernel's own triangulation of a shape, taken apart.
class CoarseReader {
 public:
  CoarseReader(const TopTools_IndexedMapOfShape& edges, OcctGeometry* geometry) : edges_(edges), geometry_(*geometry) {}

  absl::Status AddFace(const TopoDS_Face& face, std::uint16_t number) {
    TopLoc_Location location;
    const Handle(Poly_Triangulation) triangles = BRep_Tool::Triangulation(face, location);
    if (triangles.IsNull() || triangles->NbTriangles() < 1 || !triangles->HasUVNodes())
      return RefuseCad("faces[" + std::to_string(number) + "]", "cannot be tessellated", "a face with an area");
    const auto first_node = static_cast<std::uint32_t>(mesh_.nodes.size());
    for (int i = 1; i <= triangles->NbNodes(); ++i) {
      const gp_Pnt2d uv = triangles->UVNode(i);
      mesh_.nodes.push_back({first_node + i - 1, number, {uv.X(), uv.Y()}, -1});
      mesh_.vertices_mm.push_back(ToEigen(triangles->Node(i).Transformed(location.Transformation()).XYZ()));
    }
    for (int i = 1; i <= triangles->NbTriangles(); ++i) {
      int a, b, c;
      triangles->Triangle(i).Get(a, b, c);
      mesh_.triangles.push_back({first_node + a - 1, first_node + b - 1, first_node + c - 1});
    }
    for (TopExp_Explorer edge(face, TopAbs_EDGE); edge.More(); edge.Next())
      AddBorders(TopoDS::Edge(edge.Current()), face, triangles, location, first_node);
    return absl::OkStatus();
  }

  CoarseMesh Take() {
    const std::vector<std::uint32_t> welded = Weld(kWeldToleranceMm, &mesh_.vertices_mm);
    for (CoarseMesh::Node& node : mesh_.nodes) node.vertex = welded[node.vertex];
    JoinPoles();
    return std::move(mesh_);
  }

 private:
  // One node for each pole of a face: which of its many parameters a triangle came with means nothing.
  void JoinPoles() {
    std::map<std::pair<std::uint16_t, std::uint32_t>, std::uint32_t> pole_of;
    const auto joined = [&](std::uint32_t node) {
      const CoarseMesh::Node& at = mesh_.nodes[node];
      return at.free_parameter < 0 ? node : pole_of.try_emplace({at.face, at.vertex}, node).first->second;
    };
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (const auto& [a, b, c] : mesh_.triangles) {
      const std::array<std::uint32_t, 3> triangle{joined(a), joined(b), joined(c)};
      if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0])
        triangles.push_back(triangle);
    }
    mesh_.triangles = std::move(triangles);
    for (CoarseMesh::Border& border : mesh_.borders) border.nodes = {joined(border.nodes[0]), joined(border.nodes[1])};
  }

  // Each edge of a face is a chain of chords, shared by number and parameters with the other face along it.
  void AddBorders(const TopoDS_Edge& edge, const TopoDS_Face& face, const Handle(Poly_Triangulation) & triangles,
                  const TopLoc_Location& location, std::uint32_t first_node) {
    const Handle(Poly_PolygonOnTriangulation) chain = BRep_Tool::PolygonOnTriangulation(edge, triangles, location);
    if (chain.IsNull() || !chain->HasParameters()) return;
    if (BRep_Tool::Degenerated(edge)) {
      const gp_XY along =
          triangles->UVNode(chain->Node(chain->NbNodes())).XY() - triangles->UVNode(chain->Node(1)).XY();
      for (int i = 1; i <= chain->NbNodes(); ++i)
        mesh_.nodes[first_node + chain->Node(i) - 1].free_parameter = std::abs(along.X()) > std::abs(along.Y()) ? 0 : 1;
      return;
    }
    // A seam has a curve for each of its sides; which of them goes with this chain is told by where its nodes are.
    Handle(Geom2d_Curve) on_face;
    double nearest = std::numeric_limits<double>::infinity();
    for (TopAbs_Orientation sense : {TopAbs_FORWARD, TopAbs_REVERSED}) {
      double first = 0, last = 0;
      const Handle(Geom2d_Curve) side =
          BRep_Tool::CurveOnSurface(TopoDS::Edge(edge.Oriented(sense)), face, first, last);
      if (side.IsNull()) continue;
      double distance = 0;
      for (int i = 1; i <= chain->NbNodes(); ++i)
        distance += side->Value(chain->Parameter(i)).Distance(triangles->UVNode(chain->Node(i)));
      if (distance < nearest) {
        nearest = distance;
        on_face = side;
      }
    }
    if (on_face.IsNull()) return;
    const std::uint32_t curve_on_face = geometry_.AddCurveOnFace(on_face);
    const auto curve = static_cast<std::uint32_t>(edges_.FindIndex(edge) - 1);
    for (int i = 1; i < chain->NbNodes(); ++i) {
      const CoarseMesh::Chord chord{curve, chain->Parameter(i), chain->Parameter(i + 1)};
      auto [number, fresh] = chord_numbers_.try_emplace(std::make_tuple(curve, chord.first, chord.last),
                                                        static_cast<std::uint32_t>(mesh_.chords.size()));
      if (fresh) mesh_.chords.push_back(chord);
      mesh_.borders.push_back(
          {{first_node + chain->Node(i) - 1, first_node + chain->Node(i + 1) - 1}, number->second, curve_on_face});
    }
  }

  const TopTools_IndexedMapOfShape& edges_;
  OcctGeometry& geometry_;
  CoarseMesh mesh_;
  std::map<std::tuple<std::uint32_t, double, double>, std::uint32_t> chord_numbers_;
};

absl::StatusOr<TriangleMesh> Tessellate(const TopoDS_Shape& shape, double extent_mm,
                                        const TessellationOptions& options) {
  TopTools_IndexedMapOfShape faces, edges;
  TopExp::MapShapes(shape, TopAbs_FACE, faces);
  TopExp::MapShapes(shape, TopAbs_EDGE, edges);
  IMeshTools_Parameters parameters;
  parameters.Deflection = std::max(1e-3 * options.chordal_error_um, std::min(kCoarseDeflectionMm, 1e-3 * extent_mm));
  parameters.Angle = kCoarseAngleRad;
  parameters.InParallel = false;  // equal inputs, equal bytes
  BRepMesh_IncrementalMesh mesher(shape, parameters);

  OcctGeometry geometry(faces, edges);
  CoarseReader reader(edges, &geometry);
  for (int i = 1; i <= faces.Extent(); ++i) {
    if (absl::Status status = reader.AddFace(TopoDS::Face(faces(i)), static_cast<std::uint16_t>(i - 1)); !status.ok())
      return status;
  }
  const CoarseMesh coarse = reader.Take();
  RefinementOptions refinement;
  refinement.chordal_error_mm = 1e-3 * options.chordal_error_um;
  refinement.greatest_triangle_count = options.greatest_triangle_count;
  absl::StatusOr<TriangleMesh> mesh = Refine(coarse, geometry, refinement);
  while (absl::IsResourceExhausted(mesh.status()) &&
         2e3 * refinement.chordal_error_mm <= options.greatest_chordal_error_um) {
    refinement.chordal_error_mm *= 2;
    refinement.patch_error_mm *= 2;
    mesh = Refine(coarse, geometry, refinement);
  }
  if (absl::IsResourceExhausted(mesh.status()))
    return RefuseCad("triangle_count",
                     "beyond the limit even at " + NumberText(1e3 * refinement.chordal_error_mm) + " um",
                     "at most " + std::to_string(refinement.greatest_triangle_count));
  return mesh;
}

absl::StatusOr<TriangleMesh> ReadAndTessellate(CadFormat format, const std::string& path,
                                               const TessellationOptions& options) {
  TopoDS_Shape shape;
  if (absl::Status status = ReadCad(format, path, options.solid, &shape); !status.ok()) return status;
  double extent_mm = 0;
  if (absl::Status status = CheckExtent(shape, &extent_mm); !status.ok()) return status;
  absl::StatusOr<TriangleMesh> mesh = Tessellate(shape, extent_mm, options);
  if (!mesh.ok()) return mesh;
  for (const Eigen::Vector3d& vertex : mesh->vertices_mm) {
    if (!vertex.allFinite()) return RefuseCad("vertices_mm", "not finite", "finite coordinates");
  }
  if (mesh->triangles.empty()) return RefuseCad("faces", "none with an area", "at least one");
  if (absl::Status status = CheckOneSided(*mesh); !status.ok()) return status;
  mesh->closed = IsClosed(*mesh);
  if (SignedVolume(*mesh) < 0) TurnOver(&*mesh);
  return mesh;
}

}  // namespace

absl::StatusOr<TriangleMesh> TessellateCad(CadFormat format, const std::string& path,
                                           const TessellationOptions& options) {
  if (!(options.chordal_error_um >= 0.01 && options.chordal_error_um <= 1000))
    return RefuseCad("chordal_error_um", NumberText(options.chordal_error_um), "0.01 to 1000");
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  try {
    return ReadAndTessellate(format, path, options);
  } catch (const Standard_Failure& failure) {
    return RefuseCad("content", failure.DynamicType()->Name(), "geometry that can be read");
  } catch (const std::bad_alloc&) {
    return RefuseCad("content", "exhausts the memory", "a smaller part");
  } catch (const std::exception& failure) {
    return RefuseCad("content", failure.what(), "geometry that can be read");
  }
}

}  // namespace sixpoint::metrology

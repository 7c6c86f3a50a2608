#include "tests/metrology/cad/true_surface.h"

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRepExtrema_DistShapeShape.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Eigen/Geometry>
#include <GCPnts_AbscissaPoint.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>

namespace sixpoint::testing {
namespace {

constexpr double kDeflectionMm = 0.05, kAngleRad = 0.5;

Eigen::Vector3d ToEigen(const gp_XYZ& v) { return {v.X(), v.Y(), v.Z()}; }

// Cubes of a grid in and next to which an edge runs.
class NearEdges {
 public:
  NearEdges(const TopoDS_Shape& shape, double width_mm) : width_mm_(width_mm) {
    for (TopExp_Explorer faces(shape, TopAbs_FACE); faces.More(); faces.Next())
      for (TopExp_Explorer edges(faces.Current(), TopAbs_EDGE); edges.More(); edges.Next()) {
        const TopoDS_Edge& edge = TopoDS::Edge(edges.Current());
        // Along a seam a face only meets itself.
        if (BRep_Tool::Degenerated(edge) || BRep_Tool::IsClosed(edge, TopoDS::Face(faces.Current()))) continue;
        const BRepAdaptor_Curve curve(edge);
        const double first = curve.FirstParameter(), last = curve.LastParameter();
        const auto pieces = static_cast<int>(GCPnts_AbscissaPoint::Length(curve) / (0.5 * width_mm)) + 1;
        for (int i = 0; i <= 4 * pieces; ++i)  // parameters need not run evenly
          Mark(ToEigen(curve.Value(first + i * (last - first) / (4 * pieces)).XYZ()));
      }
  }
  bool Holds(const Eigen::Vector3d& point_mm) const { return cubes_.count(CubeOf(point_mm)) > 0; }

 private:
  using Cube = std::array<std::int64_t, 3>;
  Cube CubeOf(const Eigen::Vector3d& p) const {
    return {std::llround(p.x() / width_mm_), std::llround(p.y() / width_mm_), std::llround(p.z() / width_mm_)};
  }
  void Mark(const Eigen::Vector3d& point_mm) {
    const Cube at = CubeOf(point_mm);
    for (std::int64_t i = -1; i <= 1; ++i)
      for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t k = -1; k <= 1; ++k) cubes_.insert({at[0] + i, at[1] + j, at[2] + k});
  }

  const double width_mm_;
  std::set<Cube> cubes_;
};

TopoDS_Shape Read(const std::string& step_path) {
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  STEPControl_Reader reader;
  if (reader.ReadFile(step_path.c_str()) != IFSelect_RetDone) return {};
  reader.TransferRoots();
  return reader.OneShape();
}

struct Piece {
  std::size_t face;
  std::array<gp_XY, 3> uv;
};

}  // namespace

std::vector<TruePoint> TruePoints(const std::string& step_path, double from_edges_mm, std::size_t count,
                                  std::uint64_t seed) {
  const TopoDS_Shape shape = Read(step_path);
  if (shape.IsNull()) return {};
  BRepMesh_IncrementalMesh mesher(shape, kDeflectionMm, false, kAngleRad, false);

  std::vector<BRepAdaptor_Surface> surfaces;
  std::vector<double> signs, area_up_to;
  std::vector<Piece> pieces;
  double area = 0;
  for (TopExp_Explorer faces(shape, TopAbs_FACE); faces.More(); faces.Next()) {
    const TopoDS_Face& face = TopoDS::Face(faces.Current());
    TopLoc_Location location;
    const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, location);
    if (mesh.IsNull()) return {};
    surfaces.emplace_back(face, false);
    const bool inward = (face.Orientation() == TopAbs_REVERSED) != bool(surfaces.back().Trsf().IsNegative());
    signs.push_back(inward ? -1 : 1);
    for (int t = 1; t <= mesh->NbTriangles(); ++t) {
      int a, b, c;
      mesh->Triangle(t).Get(a, b, c);
      pieces.push_back({surfaces.size() - 1, {mesh->UVNode(a).XY(), mesh->UVNode(b).XY(), mesh->UVNode(c).XY()}});
      const Eigen::Vector3d corner = ToEigen(mesh->Node(a).XYZ());
      area += (ToEigen(mesh->Node(b).XYZ()) - corner).cross(ToEigen(mesh->Node(c).XYZ()) - corner).norm();
      area_up_to.push_back(area);
    }
  }
  if (pieces.empty()) return {};

  const NearEdges near_edges(shape, from_edges_mm);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<TruePoint> points;
  for (std::size_t drawn = 0; points.size() < count && drawn < 4 * count; ++drawn) {
    std::size_t index = drawn / 2 % pieces.size();
    if (drawn % 2 == 0) {
      const auto chosen = std::lower_bound(area_up_to.begin(), area_up_to.end(), area * unit(random));
      index = std::min(pieces.size() - 1, static_cast<std::size_t>(chosen - area_up_to.begin()));
    }
    const Piece& piece = pieces[index];
    const double from = std::sqrt(unit(random)), along = unit(random);
    const gp_XY uv = piece.uv[0] * (1 - from) + piece.uv[1] * (from * (1 - along)) + piece.uv[2] * (from * along);
    gp_Pnt point;
    gp_Vec du, dv;
    surfaces[piece.face].D1(uv.X(), uv.Y(), point, du, dv);
    const Eigen::Vector3d normal = ToEigen(du.XYZ()).cross(ToEigen(dv.XYZ()));
    if (!(normal.norm() > 1e-9 * du.Magnitude() * dv.Magnitude())) continue;  // a pole
    if (near_edges.Holds(ToEigen(point.XYZ()))) continue;
    const Eigen::Vector3d outward = signs[piece.face] * normal.normalized();
    points.push_back({ToEigen(point.XYZ()), outward});
  }
  return points;
}

std::vector<double> TrueDistances(const std::string& step_path, const std::vector<Eigen::Vector3d>& points_mm) {
  TopoDS_Compound faces;  // a solid's inside would be at no distance
  BRep_Builder builder;
  builder.MakeCompound(faces);
  for (TopExp_Explorer face(Read(step_path), TopAbs_FACE); face.More(); face.Next()) builder.Add(faces, face.Current());
  std::vector<double> distances_mm;
  for (const Eigen::Vector3d& p : points_mm)
    distances_mm.push_back(
        BRepExtrema_DistShapeShape(BRepBuilderAPI_MakeVertex(gp_Pnt(p.x(), p.y(), p.z())).Vertex(), faces).Value());
  return distances_mm;
}

}  // namespace sixpoint::testing

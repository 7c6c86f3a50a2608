#include "tests/metrology/cad/foreign_cad.h"

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <GC_MakeArcOfCircle.hxx>
#include <Geom_Curve.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <IGESControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <STEPControl_Writer.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <cstdio>
#include <cstdlib>
#include <gp_Circ.hxx>

#include "tests/metrology/cad/written_cad.h"

namespace sixpoint::testing {
namespace {

TopoDS_Shape RaisedEdges(double by_mm) {
  const TopoDS_Shape shape = BRepPrimAPI_MakeCylinder(5, 20).Shape();
  const gp_Vec up(0, 0, by_mm);
  const BRep_Builder builder;
  TopTools_IndexedMapOfShape edges, corners;
  TopExp::MapShapes(shape, TopAbs_EDGE, edges);
  TopExp::MapShapes(shape, TopAbs_VERTEX, corners);
  for (int i = 1; i <= edges.Extent(); ++i) {
    double first = 0, last = 0;
    const TopoDS_Edge& edge = TopoDS::Edge(edges(i));
    const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, first, last);
    if (curve.IsNull()) continue;
    builder.UpdateEdge(edge, Handle(Geom_Curve)::DownCast(curve->Translated(up)), 2 * by_mm);
  }
  for (int i = 1; i <= corners.Extent(); ++i) {
    const TopoDS_Vertex& corner = TopoDS::Vertex(corners(i));
    builder.UpdateVertex(corner, BRep_Tool::Pnt(corner).Translated(up), 2 * by_mm);
  }
  return shape;
}

// Without curves in the parameters of faces: those a reader makes for itself, as other systems' files need it.
std::string Step(const TopoDS_Shape& shape, bool assembly = false, const std::string& unit = "MM") {
  return Written([&](const std::string& path) {
    STEPControl_Writer writer;  // makes the settings known
    Interface_Static::SetIVal("write.surfacecurve.mode", 0);
    Interface_Static::SetIVal("write.step.assembly", assembly ? 1 : 0);
    Interface_Static::SetCVal("write.step.unit", unit.c_str());
    writer.Transfer(shape, STEPControl_AsIs);
    writer.Write(path.c_str());
    Interface_Static::SetIVal("write.surfacecurve.mode", 1);
    Interface_Static::SetIVal("write.step.assembly", 0);
    Interface_Static::SetCVal("write.step.unit", "MM");
  });
}

std::string Iges(const TopoDS_Shape& shape, bool as_solids) {
  return Written([&](const std::string& path) {
    IGESControl_Writer writer("MM", as_solids ? 1 : 0);
    writer.AddShape(shape);
    writer.ComputeModel();
    writer.Write(path.c_str());
  });
}

void WidenLastCylinder(double by_mm, std::string* step) {
  const std::size_t at = step->rfind("CYLINDRICAL_SURFACE("), end = step->find(')', at);
  if (at == std::string::npos || end == std::string::npos) std::abort();
  const std::size_t comma = step->rfind(',', end);
  char radius[32];
  std::snprintf(radius, sizeof radius, "%.12g", std::stod(step->substr(comma + 1)) + by_mm);
  step->replace(comma + 1, end - comma - 1, radius);
}

TopoDS_Shape BoxAt(double size_mm, double x_mm) {
  return BRepPrimAPI_MakeBox(gp_Pnt(x_mm, 0, 0), size_mm, 2 * size_mm, 3 * size_mm).Shape();
}

TopoDS_Compound Together(const std::vector<TopoDS_Shape>& shapes) {
  TopoDS_Compound all;
  const BRep_Builder builder;
  builder.MakeCompound(all);
  for (const TopoDS_Shape& shape : shapes) builder.Add(all, shape);
  return all;
}

std::vector<TopoDS_Shape> Boxes(const std::vector<NamedBox>& boxes) {
  std::vector<TopoDS_Shape> shapes;
  for (const NamedBox& box : boxes) shapes.push_back(BoxAt(box.size_mm, 100.0 * static_cast<double>(shapes.size())));
  return shapes;
}

// The writer numbers its products; those that have a solid get the boxes' names, in the order in which they come.
std::string Named(std::string step, const std::vector<NamedBox>& boxes) {
  std::size_t from = 0;
  for (const NamedBox& box : boxes) {
    const std::size_t solid = step.find("MANIFOLD_SOLID_BREP('", from);
    if (solid == std::string::npos) std::abort();
    const std::size_t product = step.rfind("PRODUCT('", solid);
    const std::size_t end = step.find("',", product);
    const std::size_t second = step.find("',", end + 2);
    const std::string named = "PRODUCT('" + box.name + "','" + box.name;
    if (product == std::string::npos || product < from) std::abort();
    step.replace(product, second - product, named);
    from = step.find("MANIFOLD_SOLID_BREP('", product) + 1;
  }
  return step;
}

}  // namespace

std::string StepOfRaisedEdges(double by_mm) { return Step(RaisedEdges(by_mm)); }
std::string IgesOfRaisedEdges(double by_mm) { return Iges(RaisedEdges(by_mm), false); }

std::string StepOfSteppedHalves(double step_mm) {
  const gp_Circ circle(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 5);
  const gp_Pnt right(5, 0, 0), left(-5, 0, 0);
  BRepBuilderAPI_MakeWire wire(BRepBuilderAPI_MakeEdge(circle, right, left),
                               BRepBuilderAPI_MakeEdge(circle, left, right));
  std::string step = Step(BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Vec(0, 0, 20)).Shape());
  if (step_mm > 0) WidenLastCylinder(step_mm, &step);
  return step;
}

std::string StepOfAssembly(const std::vector<NamedBox>& boxes, const std::string& unit) {
  return Named(Step(Together(Boxes(boxes)), true, unit), boxes);
}

std::string StepOfNestedAssembly(const std::vector<NamedBox>& boxes) {
  gp_Trsf moved, turned;
  moved.SetTranslation(gp_Vec(500, 20, -30));
  turned.SetRotation(gp_Ax1(gp_Pnt(1, 2, 3), gp_Dir(1, 1, 0.5)), 0.7);
  const std::vector<TopoDS_Shape> shapes = Boxes(boxes);
  const TopoDS_Compound inner = Together({shapes.begin() + 1, shapes.end()});
  return Named(Step(Together({shapes.front(), inner.Located(TopLoc_Location(moved * turned))}), true), boxes);
}

std::string StepOfBlade(const DrawnBlade& blade) {
  const gp_Pnt left(-7, -2.5, 0), middle(0, 2.5, 0), right(7, -2.5, 0);
  const Handle(Geom_TrimmedCurve) arc = GC_MakeArcOfCircle(right, middle, left).Value();
  const double first = arc->FirstParameter(), last = arc->LastParameter(), half = (first + last) / 2;
  BRepBuilderAPI_MakeWire section(BRepBuilderAPI_MakeEdge(left, right),
                                  BRepBuilderAPI_MakeEdge(arc->BasisCurve(), first, half),
                                  BRepBuilderAPI_MakeEdge(arc->BasisCurve(), half, last));
  const TopoDS_Face foot = BRepBuilderAPI_MakeFace(section.Wire());
  const TopoDS_Shape airfoil = BRepPrimAPI_MakePrism(foot, gp_Vec(0, 0, 30)).Shape();
  const TopoDS_Shape platform = BRepPrimAPI_MakeBox(gp_Pnt(-10, -6, -4), 20, 12, 4).Shape();
  TopoDS_Shape whole = BRepAlgoAPI_Fuse(airfoil, platform).Shape();
  for (const double height_mm : blade.hole_heights_mm) {
    const gp_Ax2 axis(gp_Pnt(0, -10, height_mm), gp_Dir(0, 1, 0));
    whole = BRepAlgoAPI_Cut(whole, BRepPrimAPI_MakeCylinder(axis, blade.hole_radius_mm, 20).Shape()).Shape();
  }
  std::string step = Step(whole);
  if (blade.step_mm > 0) WidenLastCylinder(blade.step_mm, &step);
  return step;
}

std::string IgesOfBoxes(const std::vector<NamedBox>& boxes) { return Iges(Together(Boxes(boxes)), true); }

}  // namespace sixpoint::testing

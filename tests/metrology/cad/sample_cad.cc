#include "tests/metrology/cad/sample_cad.h"

#include <BRepBuilderAPI_Transform.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <IGESControl_Writer.hxx>
#include <STEPControl_Writer.hxx>
#include <cstdlib>

#include "tests/metrology/cad/written_cad.h"

#if defined(__SANITIZE_ADDRESS__)
// OpenCASCADE's readers and writers keep their tables for as long as the process lives.
extern "C" const char* __lsan_default_suppressions() { return "leak:libTK"; }
#endif

namespace sixpoint::testing {
namespace {

TopoDS_Shape Make(SampleShape shape) {
  gp_Trsf far, turn, mirror;
  far.SetTranslation(gp_Vec(6350, -20, 330));
  turn.SetRotation(gp_Ax1(gp_Pnt(1, 2, 3), gp_Dir(1, 1, 0.5)), 0.7);
  mirror.SetMirror(gp_Ax2(gp_Pnt(1, 0, 0), gp_Dir(1, 0.2, 0)));
  switch (shape) {
    case SampleShape::kBox:
      return BRepPrimAPI_MakeBox(10, 20, 30).Shape();
    case SampleShape::kCylinder:
      return BRepPrimAPI_MakeCylinder(5, 20).Shape();
    case SampleShape::kSphere:
      return BRepPrimAPI_MakeSphere(8).Shape();
    case SampleShape::kTorus:
      return BRepPrimAPI_MakeTorus(10, 3).Shape();
    case SampleShape::kFarCylinder:
      return BRepBuilderAPI_Transform(BRepPrimAPI_MakeCylinder(5, 20).Shape(), far * turn).Shape();
    case SampleShape::kMirroredCone:
      return BRepBuilderAPI_Transform(BRepPrimAPI_MakeCone(6, 2, 9).Shape(), mirror).Shape();
    case SampleShape::kHugeBox:
      return BRepPrimAPI_MakeBox(20e3, 10, 10).Shape();
    case SampleShape::kTinyBox:
      return BRepPrimAPI_MakeBox(0.02, 0.02, 0.02).Shape();
  }
  std::abort();
}

}  // namespace

std::string StepOf(SampleShape shape) {
  return Written([&](const std::string& path) {
    STEPControl_Writer writer;
    writer.Transfer(Make(shape), STEPControl_AsIs);
    writer.Write(path.c_str());
  });
}

std::string IgesOf(SampleShape shape) {
  return Written([&](const std::string& path) {
    IGESControl_Writer writer("IN", 0);
    writer.AddShape(Make(shape));
    writer.ComputeModel();
    writer.Write(path.c_str());
  });
}

}  // namespace sixpoint::testing

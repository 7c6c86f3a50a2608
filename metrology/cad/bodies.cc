#include "metrology/cad/bodies.h"

#include <BRepGProp.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS_Shape.hxx>
#include <cmath>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kMostListed = 12;     // a refusal is read by people
constexpr std::size_t kMostNameBytes = 64;  // of each

struct Body {
  TopoDS_Shape shape;
  BodyName name;

  bool Is(const std::string& asked) const { return name.own == asked || name.product == asked; }
};

// In the file's order; each as often as it is placed.
std::vector<Body> BodiesOf(const TopoDS_Shape& shape, const std::vector<BodyName>& names) {
  std::vector<Body> bodies;
  for (TopExp_Explorer at(shape, TopAbs_SOLID); at.More(); at.Next()) bodies.push_back({at.Current(), {}});
  for (TopExp_Explorer at(shape, TopAbs_SHELL); bodies.empty() && at.More(); at.Next()) {
    for (; at.More(); at.Next())
      if (BRep_Tool::IsClosed(at.Current())) bodies.push_back({at.Current(), {}});
    break;
  }
  for (Body& body : bodies)
    for (const BodyName& name : names)
      if (name.body == body.shape.TShape().get()) body.name = name;
  return bodies;
}

std::string Shown(const std::string& name) {
  return name.size() <= kMostNameBytes ? name : name.substr(0, kMostNameBytes) + "...";
}

// Number, name and volume of each.
std::string Listed(const std::vector<Body>& bodies) {
  std::string text;
  for (std::size_t i = 0; i < bodies.size() && i < kMostListed; ++i) {
    const BodyName& name = bodies[i].name;
    GProp_GProps volume;
    BRepGProp::VolumeProperties(bodies[i].shape, volume);
    text += (i == 0 ? "" : ", ") + std::to_string(i + 1);
    if (!name.own.empty()) text += " \"" + Shown(name.own) + "\"";
    if (!name.product.empty() && name.product != name.own)
      text += (name.own.empty() ? " \"" : " of \"") + Shown(name.product) + "\"";
    text += " (" + Rounded(std::abs(volume.Mass())) + " mm3)";
  }
  if (bodies.size() > kMostListed) text += " and " + std::to_string(bodies.size() - kMostListed) + " more";
  return text;
}

// A whole number from 1 to count; 0: none.
std::size_t NumberIn(const std::string& text, std::size_t count) {
  if (text.empty() || text.size() > 6 || text.find_first_not_of("0123456789") != std::string::npos) return 0;
  const std::size_t number = std::stoul(text);
  return number <= count ? number : 0;
}

}  // namespace

int CountFaces(const TopoDS_Shape& shape) {
  TopTools_IndexedMapOfShape faces;
  if (!shape.IsNull()) TopExp::MapShapes(shape, TopAbs_FACE, faces);
  return faces.Extent();
}

absl::Status ChooseBody(const std::string& asked, const std::vector<BodyName>& names, TopoDS_Shape* shape) {
  const std::vector<Body> bodies = BodiesOf(*shape, names);
  const std::string field = "part.solid";
  if (bodies.empty()) return asked.empty() ? absl::OkStatus() : Refuse(field, asked, "none: the CAD has no solid");
  const std::string wanted = "its name or number of " + Listed(bodies);
  std::size_t chosen = bodies.size(), count = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (asked.empty() || !bodies[i].Is(asked)) continue;
    chosen = i;
    ++count;
  }
  if (count > 1) return Refuse(field, asked + ", the name of " + std::to_string(count) + " solids", wanted);
  if (const std::size_t number = NumberIn(asked, bodies.size()); count == 0 && number > 0) chosen = number - 1;
  if (asked.empty() && bodies.size() == 1) chosen = 0;
  if (chosen == bodies.size())
    return Refuse(field, asked.empty() ? "none of " + std::to_string(bodies.size()) + " solids" : asked, wanted);
  // A shell beside open faces, which nobody asked to leave out: the part may be all of them.
  const bool is_solid = bodies[chosen].shape.ShapeType() == TopAbs_SOLID;
  if (asked.empty() && !is_solid) return absl::OkStatus();
  if (CountFaces(bodies[chosen].shape) != CountFaces(*shape)) *shape = bodies[chosen].shape;
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology

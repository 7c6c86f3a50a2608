// Which body of a CAD file is the part. An assembly has several: the blade, its fixture, its neighbours.
#pragma once

#include <absl/status/status.h>

#include <string>
#include <vector>

class TopoDS_Shape;

namespace sixpoint::metrology {

// What a file calls one of its bodies: by itself (MANIFOLD_SOLID_BREP), and by the product that it is the shape of. Either may be empty.
struct BodyName {
  const void* body;  // TopoDS_TShape: placed twice it is still one
  std::string own, product;
};

// Leaves of the shape the one body that is asked for: by a name that no other has, or by its number in the file's order, from 1 on. Unasked, a
// shape with one solid and surfaces beside it becomes that solid, one with none stays whole. Where no solid is, as IGES has it, closed
// shells are the bodies.
// INVALID_ARGUMENT (part.solid), with names, numbers and volumes: several and none asked for, none or several of that name, a solid
// asked for where there is none.
absl::Status ChooseBody(const std::string& asked, const std::vector<BodyName>& names, TopoDS_Shape* shape);

// Each once, however often it is placed; 0 where there is no shape.
int CountFaces(const TopoDS_Shape& shape);

}  // namespace sixpoint::metrology

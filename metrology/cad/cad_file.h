// STEP and IGES files, read by OpenCASCADE. In a worker only, as tessellation.h says.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "metrology/cad/tessellation.h"

class TopoDS_Shape;

namespace sixpoint::metrology {

// The body that is asked for (bodies.h), in millimetres, placed as its file has it; faces that meet are sewn. An empty path is the standard
// input. INVALID_ARGUMENT: nothing readable, or not that body. May throw what OpenCASCADE throws.
absl::Status ReadCad(CadFormat format, const std::string& path, const std::string& solid, TopoDS_Shape* shape);

}  // namespace sixpoint::metrology

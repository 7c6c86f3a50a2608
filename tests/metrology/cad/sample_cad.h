// CAD files of shapes that have closed forms.
#pragma once

#include <string>

namespace sixpoint::testing {

enum class SampleShape {
  kBox,           // 10 x 20 x 30 mm, a corner at the origin
  kCylinder,      // radius 5 mm, height 20 mm
  kSphere,        // radius 8 mm
  kTorus,         // radii 10 mm and 3 mm
  kFarCylinder,   // the cylinder, turned and 6.35 m from the origin
  kMirroredCone,  // radii 6 and 2 mm, height 9 mm, mirrored by its placement
  kHugeBox,       // 20 m
  kTinyBox,       // 0.02 mm
};

// Contents of a STEP or IGES file.
std::string StepOf(SampleShape shape);
std::string IgesOf(SampleShape shape);

}  // namespace sixpoint::testing

// CAD files as other systems write them: edges that lie off their faces, faces that do not meet, assemblies, parts with their holes drawn.
#pragma once

#include <string>
#include <vector>

namespace sixpoint::testing {

// A cylinder of radius 5 mm and height 20 mm whose edges and corners all stand higher than they should.
std::string StepOfRaisedEdges(double by_mm);
std::string IgesOfRaisedEdges(double by_mm);

// A disc prism of height 20 mm in two halves: y > 0 of radius 5 mm, y < 0 of radius 5 mm + step. They go on smoothly, but for the step.
std::string StepOfSteppedHalves(double step_mm);

// Boxes of edges 1, 2 and 3 times a size, apart from each other; each the shape of a product of that name.
struct NamedBox {
  std::string name;
  double size_mm;
};
std::string StepOfAssembly(const std::vector<NamedBox>& boxes, const std::string& unit = "MM");
// The same within two sub-assemblies, placed and turned.
std::string StepOfNestedAssembly(const std::vector<NamedBox>& boxes);
// One product with several solids, none of them named.
std::string IgesOfBoxes(const std::vector<NamedBox>& boxes);

// A blade of height 30 mm on its platform of 20 x 12 x 4 mm, along z: 14 mm of chord, flat at y = -2.5 mm, round on the other side up to
// y = 2.5 mm at x = 0; with holes through it along y, at these heights over the platform.
struct DrawnBlade {
  std::vector<double> hole_heights_mm;
  double hole_radius_mm = 0.5;
  double step_mm = 0;  // by which the round side is wider at x < 0; not with holes
};
std::string StepOfBlade(const DrawnBlade& blade);

}  // namespace sixpoint::testing

#include "tests/metrology/inspection/simulated_pin.h"

#include <cmath>

namespace sixpoint::metrology {

Points SeenFrom(const SimulatedPin& pin, const std::vector<Eigen::Vector3d>& views, int count,
                std::mt19937_64* random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  Points points;
  for (const Eigen::Vector3d& view : views) {
    // Across the view, in the plane of view and axis' normal: the silhouette is a strip of the pin's width.
    const Eigen::Vector3d across = pin.axis.cross(view).normalized();
    const Eigen::Vector3d facing = across.cross(pin.axis);  // outward where the ray hits the middle of the strip
    const double side = facing.dot(view) < 0 ? 1 : -1;
    for (int i = 0; i < count; ++i) {
      const double height = 0.15 + uniform(*random) * (pin.length_mm - 0.15);
      const double x = 2 * uniform(*random) - 1;  // uniform over the strip, as equidistant rays are
      const bool on_top = view.dot(pin.axis) < -0.2 && uniform(*random) < 0.05;
      Eigen::Vector3d point;
      if (on_top) {
        const double angle = 2 * M_PI * uniform(*random), r = pin.radius_mm * std::sqrt(uniform(*random));
        point = pin.start_mm + pin.length_mm * pin.axis + r * (std::cos(angle) * across + std::sin(angle) * facing);
      } else {
        point = pin.start_mm + height * pin.axis + pin.radius_mm * (x * across + side * std::sqrt(1 - x * x) * facing);
      }
      points.push_back(point + pin.noise_mm * normal(*random) * view);
    }
  }
  return points;
}

}  // namespace sixpoint::metrology

#include "report/drawing.h"

#include <algorithm>
#include <cmath>

#include "report/number_text.h"

namespace sixpoint::report {

void Drawing::Box(Place corner, double box_width_mm, double box_height_mm, std::optional<Pen> pen,
                  std::optional<Colour> fill) {
  const double right = corner.x_mm + box_width_mm, bottom = corner.y_mm + box_height_mm;
  shapes.emplace_back(Path{{corner, {right, corner.y_mm}, {right, bottom}, {corner.x_mm, bottom}}, true, pen, fill});
}

void Drawing::Arrow(Place from, Place to, const Pen& pen, double head_mm) {
  const double dx = to.x_mm - from.x_mm, dy = to.y_mm - from.y_mm, length = std::hypot(dx, dy);
  if (length < 1e-6) return;
  const double head = std::min(head_mm, length), ux = dx / length, uy = dy / length;
  const Place neck{to.x_mm - head * ux, to.y_mm - head * uy};
  const double half = 0.36 * head;
  if (length > head) Line(from, neck, pen);
  shapes.emplace_back(
      Path{{to, {neck.x_mm - half * uy, neck.y_mm + half * ux}, {neck.x_mm + half * uy, neck.y_mm - half * ux}},
           true,
           std::nullopt,
           pen.colour});
}

namespace {

double RoundDown(double greatest, std::initializer_list<double> steps) {
  const double power = std::pow(10, std::floor(std::log10(std::max(1e-6, greatest))));
  for (const double step : steps)
    if (step * power <= greatest * 1.001) return step * power;
  return power;
}

}  // namespace

double RoundLength(double longest_mm) { return RoundDown(longest_mm, {5, 2}); }
double RoundMagnification(double greatest) { return RoundDown(greatest, {8, 6, 5, 4, 3, 2.5, 2, 1.5}); }

void DrawScaleBar(Drawing* drawing, Place left, double longest_mm, double part_scale) {
  const double length_mm = RoundLength(longest_mm / part_scale), drawn = length_mm * part_scale;
  const Place right{left.x_mm + drawn, left.y_mm};
  const Pen pen{kInk, 0.25};
  drawing->Line(left, right, pen);
  for (const Place& end : {left, right}) drawing->Line({end.x_mm, end.y_mm - 0.8}, {end.x_mm, end.y_mm + 0.8}, pen);
  drawing->Text({right.x_mm + 1.4, right.y_mm + 0.8}, Shortest(length_mm) + " mm", 2.3, kInk);
}

}  // namespace sixpoint::report

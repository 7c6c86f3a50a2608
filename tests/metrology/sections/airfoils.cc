#include "tests/metrology/sections/airfoils.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr double kPi = 3.14159265358979323846;

Vector2d Left(const Vector2d& v) { return {-v.y(), v.x()}; }

// Of the camber line at t: from +turning / 2 down to -turning / 2 about the chord.
Vector2d Direction(const Blade& blade, double t) {
  const double angle = blade.stagger_rad + blade.turning_rad * (0.5 - t);
  return {std::cos(angle), std::sin(angle)};
}

// d(half thickness) / d(arc length).
double Slope(const Blade& blade, double t) {
  constexpr double h = 1e-6;
  return (HalfThickness(blade, t + h) - HalfThickness(blade, t - h)) / (2 * h) / blade.arc_mm;
}

// The envelope: side +1 to the left of the camber line.
Vector2d SidePoint(const Blade& blade, double t, double side) {
  const double slope = Slope(blade, t);
  const Vector2d along = Direction(blade, t);
  return CamberPoint(blade, t) +
         HalfThickness(blade, t) * (-slope * along + side * std::sqrt(1 - slope * slope) * Left(along));
}

// Where the side meets the line across the camber line's end.
double SquareEnd(const Blade& blade, double end, double side) {
  double in = 0.5, out = end + (end > 0.5 ? 0.2 : -0.2);
  const Vector2d at = CamberPoint(blade, end), along = (end > 0.5 ? 1 : -1) * Direction(blade, end);
  for (int k = 0; k < 80; ++k) {
    const double middle = (in + out) / 2;
    ((SidePoint(blade, middle, side) - at).dot(along) < 0 ? in : out) = middle;
  }
  return in;
}

// From the contact on one side about the end to the contact on the other.
void AddEnd(const Blade& blade, bool leading, double step_mm, std::vector<Vector2d>* polygon) {
  const double t = leading ? 0 : 1, radius = HalfThickness(blade, t);
  const Vector2d centre = CamberPoint(blade, t), out = (leading ? -1 : 1) * Direction(blade, t);
  const BladeEnd kind = leading ? blade.leading : blade.trailing;
  const double slope = Slope(blade, t) * (leading ? 1 : -1);  // the contacts' normals lean that far outward
  const double half = std::acos(std::clamp(slope, -1.0, 1.0));
  if (kind == BladeEnd::kSquare) {
    const double side = leading ? 1 : -1;  // counter-clockwise: the leading end is gone round from left to right
    const Vector2d from = SidePoint(blade, SquareEnd(blade, t, side), side),
                   to = SidePoint(blade, SquareEnd(blade, t, -side), -side);
    const int count = std::max(12, static_cast<int>((to - from).norm() / step_mm));
    for (int k = 0; k <= count; ++k) polygon->push_back(from + static_cast<double>(k) / count * (to - from));
    return;
  }
  const double length = kind == BladeEnd::kEllipse ? blade.lead_slenderness * radius : radius;
  const int count = std::max(120, static_cast<int>(2 * half * length / step_mm));
  for (int k = 1; k < count; ++k) {
    const double angle = -half + 2 * half * k / count;
    polygon->push_back(centre + length * std::cos(angle) * out + radius * std::sin(angle) * Left(out));
  }
}

void AddSide(const Blade& blade, double side, double step_mm, std::vector<Vector2d>* polygon) {
  const double first = blade.leading == BladeEnd::kSquare ? SquareEnd(blade, 0, side) : 0;
  const double last = blade.trailing == BladeEnd::kSquare ? SquareEnd(blade, 1, side) : 1;
  const int count = static_cast<int>(blade.arc_mm / step_mm);
  const bool square_first = blade.leading == BladeEnd::kSquare, square_last = blade.trailing == BladeEnd::kSquare;
  for (int k = 0; k <= count; ++k) {
    if ((k == 0 && square_first) || (k == count && square_last)) continue;  // corners are the ends'
    const double t = first + (last - first) * k / count;
    polygon->push_back(SidePoint(blade, side > 0 ? first + last - t : t, side));
  }
}

}  // namespace

Vector2d CamberPoint(const Blade& blade, double t) {
  const double radius = blade.arc_mm / blade.turning_rad, from = blade.stagger_rad + blade.turning_rad / 2;
  const double angle = from - blade.turning_rad * t;
  return blade.place_mm + radius * Vector2d(std::sin(from) - std::sin(angle), std::cos(angle) - std::cos(from));
}

double HalfThickness(const Blade& blade, double t) {
  if (blade.flat_laws) {
    const double s = t * t * (3 - 2 * t);
    return blade.lead_mm + (blade.trail_mm - blade.lead_mm) * s + blade.bulge_mm * 16 * t * t * (1 - t) * (1 - t);
  }
  return blade.lead_mm + (blade.trail_mm - blade.lead_mm) * t +
         blade.bulge_mm * 4 * t * (1 - t) * (1 + blade.skew * (0.5 - t));
}

BladeTruth TruthOf(const Blade& blade) {
  BladeTruth truth;
  const double ahead =
      blade.leading == BladeEnd::kSquare
          ? 0
          : HalfThickness(blade, 0) * (blade.leading == BladeEnd::kEllipse ? blade.lead_slenderness : 1);
  const double behind =
      blade.trailing == BladeEnd::kSquare
          ? 0
          : HalfThickness(blade, 1) * (blade.trailing == BladeEnd::kEllipse ? blade.lead_slenderness : 1);
  truth.leading_mm = CamberPoint(blade, 0) - ahead * Direction(blade, 0);
  truth.trailing_mm = CamberPoint(blade, 1) + behind * Direction(blade, 1);
  const Vector2d chord = truth.trailing_mm - truth.leading_mm;
  truth.chord_mm = chord.norm();
  truth.stagger_rad = std::atan2(chord.y(), chord.x());
  double low = 0, high = 1;
  for (int k = 0; k < 200; ++k) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (HalfThickness(blade, a) < HalfThickness(blade, b) ? low : high) =
        HalfThickness(blade, a) < HalfThickness(blade, b) ? a : b;
  }
  truth.thickness_mm = 2 * HalfThickness(blade, (low + high) / 2);
  truth.lead_radius_mm = HalfThickness(blade, 0);
  truth.trail_radius_mm = HalfThickness(blade, 1);
  return truth;
}

std::vector<Vector2d> PolygonOf(const Blade& blade, double step_mm) {
  std::vector<Vector2d> polygon;
  AddSide(blade, -1, step_mm, &polygon);
  AddEnd(blade, false, step_mm, &polygon);
  AddSide(blade, 1, step_mm, &polygon);
  AddEnd(blade, true, step_mm, &polygon);
  return polygon;
}

Blade RandomBlade(std::mt19937_64& random) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Blade blade;
  blade.arc_mm = between(20, 60);
  blade.turning_rad = between(0.2, 1.9);
  blade.stagger_rad = between(-1, 1);
  blade.lead_mm = blade.arc_mm * between(0.012, 0.04);
  blade.trail_mm = blade.arc_mm * between(0.006, 0.015);
  blade.bulge_mm = blade.arc_mm * between(0.03, 0.07);
  blade.skew = between(0, 0.9);
  blade.place_mm = {between(-20, 20), between(-20, 20)};
  return blade;
}

std::vector<Vector2d> Naca4(double camber, double camber_place, double thickness, double chord_mm, bool closed) {
  const double last = closed ? -0.1036 : -0.1015;
  const auto half = [&](double x) {
    return 5 * thickness *
           (0.2969 * std::sqrt(x) - 0.1260 * x - 0.3516 * x * x + 0.2843 * x * x * x + last * x * x * x * x);
  };
  const auto point = [&](double x, double side) {
    const double p = camber_place;
    double line = 0, slope = 0;
    if (camber > 0) {
      line = x < p ? camber / (p * p) * (2 * p * x - x * x)
                   : camber / std::pow(1 - p, 2) * (1 - 2 * p + 2 * p * x - x * x);
      slope = x < p ? 2 * camber / (p * p) * (p - x) : 2 * camber / std::pow(1 - p, 2) * (p - x);
    }
    const double angle = std::atan(slope);
    return Vector2d(chord_mm * (x - side * half(x) * std::sin(angle)),
                    chord_mm * (line + side * half(x) * std::cos(angle)));
  };
  std::vector<Vector2d> polygon;
  constexpr int kSide = 2000;
  // Dense at the nose, where x is a square.
  for (int k = 0; k <= kSide; ++k) polygon.push_back(point(std::pow(static_cast<double>(k) / kSide, 2), -1));
  const Vector2d low = point(1, -1), high = point(1, 1);
  for (int k = 1; k < 12 && !closed; ++k) polygon.push_back(low + k / 12.0 * (high - low));
  for (int k = kSide; k > 0; --k) {
    if (k == kSide && closed) continue;
    polygon.push_back(point(std::pow(static_cast<double>(k) / kSide, 2), 1));
  }
  return polygon;
}

Points MeasuredOn(const std::vector<Vector2d>& polygon, const Measuring& measuring, std::mt19937_64& random) {
  std::vector<double> at{0};
  for (std::size_t i = 0; i < polygon.size(); ++i)
    at.push_back(at.back() + (polygon[(i + 1) % polygon.size()] - polygon[i]).norm());
  std::uniform_real_distribution<double> anywhere(0, 1);
  std::normal_distribution<double> normal;
  Points points;
  while (points.size() < measuring.count) {
    const double part = anywhere(random);
    if (measuring.seen && !measuring.seen(part)) continue;
    const double along = part * at.back();
    const auto i = static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), along) - at.begin()) - 1;
    const Vector2d a = polygon[i], b = polygon[(i + 1) % polygon.size()];
    const Vector2d outward = -Left((b - a).normalized());
    const double height = measuring.half_width_mm * (2 * anywhere(random) - 1);
    double off = measuring.noise_mm * normal(random) + (measuring.form_mm ? measuring.form_mm(part) : 0);
    if (anywhere(random) < measuring.outliers) off = 2 * anywhere(random) - 1;
    const Vector2d p = a + (along - at[i]) / (b - a).norm() * (b - a) + off * outward + height * measuring.lean;
    points.emplace_back(p.x(), p.y(), height);
  }
  return points;
}

std::function<double(double)> FourierForm(double rms_mm, int least, int most, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<double> cosines, sines;
  double squares = 0;
  for (int k = least; k <= most; ++k) {
    cosines.push_back(normal(random));
    sines.push_back(normal(random));
    squares += (std::pow(cosines.back(), 2) + std::pow(sines.back(), 2)) / 2;
  }
  const double scale = rms_mm / std::sqrt(squares);
  return [=](double part) {
    double sum = 0;
    for (std::size_t i = 0; i < cosines.size(); ++i) {
      const double angle = 2 * kPi * part * (least + static_cast<double>(i));
      sum += cosines[i] * std::cos(angle) + sines[i] * std::sin(angle);
    }
    return scale * sum;
  };
}

std::function<double(double)> SplineForm(double rms_mm, int knots, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<double> values;
  for (int k = 0; k < knots; ++k) values.push_back(normal(random));
  const auto raw = [=](double part) {  // a uniform cubic B-spline
    const double x = part * knots;
    const auto i = static_cast<long>(std::floor(x));
    const double t = x - static_cast<double>(i);
    const auto value = [&](long k) { return values[static_cast<std::size_t>(((i + k) % knots + knots) % knots)]; };
    return ((1 - t) * (1 - t) * (1 - t) * value(-1) + (3 * t * t * t - 6 * t * t + 4) * value(0) +
            (-3 * t * t * t + 3 * t * t + 3 * t + 1) * value(1) + t * t * t * value(2)) /
           6;
  };
  double squares = 0;
  for (int k = 0; k < 1000; ++k) squares += std::pow(raw(k / 1000.0), 2) / 1000;
  const double scale = rms_mm / std::sqrt(squares);
  return [=](double part) { return scale * raw(part); };
}

}  // namespace sixpoint::metrology

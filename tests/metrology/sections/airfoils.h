// Airfoils with closed forms: the envelope of circles along a circular arc, with ends of several kinds; NACA's four digits; and points
// measured on them, with noise and form that the estimator does not know.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <random>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

inline constexpr double kStepMm = 0.02;  // of a polygon that stands for a section

enum class BladeEnd { kCircle, kEllipse, kSquare };

// Camber: an arc of `turning_rad` and `arc_mm` from t = 0 (leading) to 1, its chord's direction at stagger_rad. Half thickness at t:
// lead + (trail - lead) s(t) + bulge b(t), both flat at t = 0 and 1 where the end is an ellipse.
struct Blade {
  double arc_mm = 40, turning_rad = 1, stagger_rad = 0.4;
  double lead_mm = 0.8, trail_mm = 0.3, bulge_mm = 2.5, skew = 0.5;
  BladeEnd leading = BladeEnd::kCircle, trailing = BladeEnd::kCircle;
  double lead_slenderness = 2;  // of an ellipse: its half length by its half width
  bool flat_laws = false;       // r'(0) = r'(1) = 0
  Eigen::Vector2d place_mm = {3, -2};
};

struct BladeTruth {
  Eigen::Vector2d leading_mm, trailing_mm;
  double chord_mm = 0, stagger_rad = 0, thickness_mm = 0, lead_radius_mm = 0, trail_radius_mm = 0;
};

Eigen::Vector2d CamberPoint(const Blade& blade, double t);
double HalfThickness(const Blade& blade, double t);
BladeTruth TruthOf(const Blade& blade);

// Closed, counter-clockwise, no farther apart than the step (less at the ends).
std::vector<Eigen::Vector2d> PolygonOf(const Blade& blade, double step_mm);

Blade RandomBlade(std::mt19937_64& random);

// Unit chord times chord_mm; trailing edge open (a flat) as the digits have it, or closed to a corner.
std::vector<Eigen::Vector2d> Naca4(double camber, double camber_place, double thickness, double chord_mm, bool closed);

// Of a dense closed polygon: points about its outline at random, in random order.
struct Measuring {
  std::size_t count = 5000;
  double noise_mm = 0.002, half_width_mm = 0.1;
  std::function<double(double)> form_mm;  // outward, of the part of the outline's length from 0 to 1
  std::function<bool(double)> seen;       // by the same; empty: all
  Eigen::Vector2d lean = {0, 0};          // shift of the section for each mm of height
  double outliers = 0;                    // part of the points that are anywhere within 1 mm
};
Points MeasuredOn(const std::vector<Eigen::Vector2d>& polygon, const Measuring& measuring, std::mt19937_64& random);

// Fourier terms of orders 2 to 8 with random weights and phases, of the given root mean square over the outline.
std::function<double(double)> FourierForm(double rms_mm, int least, int most, std::mt19937_64& random);
// A periodic cubic spline through as many random values.
std::function<double(double)> SplineForm(double rms_mm, int knots, std::mt19937_64& random);

}  // namespace sixpoint::metrology

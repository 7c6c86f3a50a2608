// A pin as a line scanner sees it: rays of given directions hit its side (and its top) and are read with noise along them.
#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

struct SimulatedPin {
  Eigen::Vector3d start_mm = Eigen::Vector3d::Zero();  // on its axis, at the surface
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double radius_mm = 0.22;
  double length_mm = 6;
  double noise_mm = 2e-3;
};

// `count` points seen along each view (a unit direction, from the sensor to the pin), from 0.15 mm above the start.
Points SeenFrom(const SimulatedPin& pin, const std::vector<Eigen::Vector3d>& views, int count, std::mt19937_64* random);

}  // namespace sixpoint::metrology

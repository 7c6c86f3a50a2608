// Reproducible noise: the same seed gives the same bits on every machine and any number of threads, which the
// distributions of <random> do not promise.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "metrology/frames/angles.h"

namespace sixpoint::simulator {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  // An independent stream for one part of the work (a scan, a profile), whoever computes it and when.
  static std::uint64_t StreamSeed(std::uint64_t seed, std::uint64_t stream) {
    Random mix(seed ^ (0x9e3779b97f4a7c15ull * (stream + 1)));
    mix.Next();
    return mix.Next();
  }

  // splitmix64 (Steele, Lea, Flood 2014).
  std::uint64_t Next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  // In (0, 1).
  double Uniform() { return (static_cast<double>(Next() >> 11) + 0.5) * 0x1.0p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  // Standard normal, by Box and Muller.
  double Gaussian() {
    const double radius = std::sqrt(-2 * std::log(Uniform()));
    return radius * std::cos(2 * metrology::kPi * Uniform());
  }
  Eigen::Vector3d GaussianVector() {
    const double x = Gaussian(), y = Gaussian(), z = Gaussian();
    return {x, y, z};
  }
  Eigen::Vector3d UniformVector(double extent) {
    const double x = Uniform(-extent, extent), y = Uniform(-extent, extent), z = Uniform(-extent, extent);
    return {x, y, z};
  }

 private:
  std::uint64_t state_;
};

}  // namespace sixpoint::simulator

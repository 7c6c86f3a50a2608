// Points, directions and long lists of numbers as rows keep them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace sixpoint::runtime {

inline std::array<double, 3> ThreeOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline std::vector<double> ListOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
// None where there are not three.
inline std::optional<Eigen::Vector3d> VectorOf(const std::vector<double>& three) {
  if (three.size() != 3) return std::nullopt;
  return Eigen::Vector3d(three[0], three[1], three[2]);
}

// Of what is kept and answered as float: what reads back is what was digested.
inline double Short(double value) { return static_cast<double>(static_cast<float>(value)); }

// Some of a row's numbers, [first, end), at the end of a message's.
template <typename Numbers, typename Out>
void AddSlice(const Numbers& numbers, std::size_t first, std::size_t end, Out* out) {
  for (std::size_t i = first; i < end; ++i) out->Add(static_cast<typename Out::value_type>(numbers[i]));
}

}  // namespace sixpoint::runtime

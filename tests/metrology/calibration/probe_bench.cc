#include "tests/metrology/calibration/probe_bench.h"

#include <Eigen/LU>
#include <cmath>

namespace sixpoint::testing {

using metrology::ProbeReading;

// Each face by two angles and its distance from the machine's origin, expected observations differentiated numerically,
// the faces marginalised.
metrology::Matrix6d ProbeBench::Bound(const std::vector<ProbeReading>& readings) const {
  const int parameters = 6 + 3 * static_cast<int>(planes.size());
  const auto expected = [&](const Eigen::VectorXd& x) {
    std::vector<double> values;
    for (std::size_t j = 0; j < planes.size(); ++j) {
      const Eigen::VectorXd f = x.segment<3>(6 + 3 * static_cast<Eigen::Index>(j));
      const Eigen::Vector3d n(std::cos(f(0)) * std::sin(f(1)), std::sin(f(0)) * std::sin(f(1)), std::cos(f(1)));
      for (const ProbeReading& r : readings) {
        if (r.face != planes[j].face) continue;
        const double beam = n.dot(Eigen::Vector3d(x.head<3>()));
        const double true_beam = planes[j].normal.dot(approach);
        values.push_back(
            (f(2) - n.dot(r.position_mm + Eigen::Vector3d(x.segment<3>(3)))) / beam /
            std::sqrt(noise_mm * noise_mm + position_noise_mm * position_noise_mm / (true_beam * true_beam)));
      }
      for (const Eigen::Vector3d& p : Spread(planes[j])) values.push_back((n.dot(p) - f(2)) / touch_mm);
    }
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
  };
  Eigen::VectorXd truth(parameters);
  truth.head<3>() = approach;
  truth.segment<3>(3) = offset_mm;
  for (std::size_t j = 0; j < planes.size(); ++j) {
    const Eigen::Vector3d& n = planes[j].normal;
    truth.segment<3>(6 + 3 * static_cast<Eigen::Index>(j)) << std::atan2(n.y(), n.x()), std::acos(n.z()),
        n.dot(planes[j].middle_mm);
  }
  Eigen::MatrixXd derivative(expected(truth).size(), parameters);
  for (int k = 0; k < parameters; ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(parameters);
    step(k) = 1e-5;
    derivative.col(k) = (expected(truth + step) - expected(truth - step)) / 2e-5;
  }
  return (derivative.transpose() * derivative).fullPivLu().inverse().topLeftCorner<6, 6>();
}

}  // namespace sixpoint::testing

#include "metrology/registration/surface_residuals.h"

#include <algorithm>
#include <cmath>

#include "metrology/linear_algebra/symmetric.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {

void SurfaceResiduals::Search(const Eigen::Isometry3d& zero_from_part, double reach_mm) {
  const Eigen::Isometry3d part_from_zero = zero_from_part.inverse(Eigen::Isometry);
  ForEachChunk(samples_.size(), kChunkSize, thread_count_, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Sample& sample = samples_[i];
      const SurfacePoint found = surface_->ClosestWithin(part_from_zero * sample.zero_mm, reach_mm, sample.triangle);
      sample.usable = std::isfinite(found.signed_distance_mm) && found.feature == SurfaceFeature::kFace;
      if (!std::isfinite(found.signed_distance_mm)) continue;
      sample.triangle = found.triangle;
      sample.residual_mm = found.signed_distance_mm;
      sample.normal = zero_from_part.linear() * found.normal;
    }
  });
}

SurfaceResiduals::Equations SurfaceResiduals::At(const Vector6d& change, double width_mm) const {
  const auto of_chunk = [&](std::size_t begin, std::size_t end) {
    Equations part;
    for (std::size_t i = begin; i < end; ++i) {
      const Sample& sample = samples_[i];
      if (!sample.usable) {
        part.loss += 1;
        continue;
      }
      const Vector6d row = Row(sample);
      const double left = sample.residual_mm - row.dot(change);
      const double u = left / width_mm, inside = 1 - u * u;
      part.loss += inside > 0 ? 1 - inside * inside * inside : 1;
      if (!(inside > 0)) continue;
      const double weight = inside * inside;
      part.matrix.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
      part.right += weight * left * row;
    }
    return part;
  };
  Equations sum;
  for (const Equations& part : OfEachChunk<Equations>(samples_.size(), kChunkSize, thread_count_, of_chunk)) {
    sum.matrix += part.matrix;
    sum.right += part.right;
    sum.loss += part.loss;
  }
  sum.matrix = Matrix6d(sum.matrix.selfadjointView<Eigen::Lower>());
  sum.loss /= static_cast<double>(std::max<std::size_t>(1, samples_.size()));
  return sum;
}

Vector6d SurfaceResiduals::Minimise(Vector6d change, double width_mm, int step_limit) const {
  for (int step = 0; step < step_limit; ++step) {
    const Equations equations = At(change, width_mm);
    const Vector6d by = SolveHeld(equations.matrix, equations.right);
    change += by;
    if (by.norm() < 1e-8) break;
  }
  return change;
}

double SurfaceResiduals::NeighbourNoise() const {
  std::vector<double> differences;
  for (std::size_t i = 1; i < samples_.size(); ++i)
    if (samples_[i].follows && samples_[i].usable && samples_[i - 1].usable)
      differences.push_back(std::abs(samples_[i].residual_mm - samples_[i - 1].residual_mm));
  return RobustSigmaOfMagnitudes(std::move(differences)) / std::sqrt(2.0);
}

}  // namespace sixpoint::metrology

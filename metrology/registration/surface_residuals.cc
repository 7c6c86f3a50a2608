#include "metrology/registration/surface_residuals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
void ForEach(std::size_t count, int thread_count, const std::function<void(std::size_t)>& body) {
  if (thread_count <= 1 || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  tbb::task_arena arena(thread_count);
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 1), [&](const tbb::blocked_range<std::size_t>& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
    });
  });
}

void ForEachChunk(std::size_t count, int thread_count,
                  const std::function<void(std::size_t, std::size_t, std::size_t)>& body) {
  ForEach(ChunkCount(count), thread_count,
          [&](std::size_t chunk) { body(chunk, chunk * kChunkSize, std::min(count, (chunk + 1) * kChunkSize)); });
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double RobustSigma(const std::vector<double>& residuals) {
  const double median = Median(residuals);
  std::vector<double> deviations;
  deviations.reserve(residuals.size());
  for (const double r : residuals) deviations.push_back(std::abs(r - median));
  return 1.4826 * Median(std::move(deviations));
}

void SurfaceResiduals::Search(const Eigen::Isometry3d& zero_from_part, double reach_mm) {
  const Eigen::Isometry3d part_from_zero = zero_from_part.inverse(Eigen::Isometry);
  ForEachChunk(samples_.size(), thread_count_, [&](std::size_t, std::size_t begin, std::size_t end) {
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
  std::vector<Equations> parts(ChunkCount(samples_.size()));
  ForEachChunk(samples_.size(), thread_count_, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
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
    parts[chunk] = part;
  });
  Equations sum;
  for (const Equations& part : parts) {
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
  return 1.4826 * Median(std::move(differences)) / std::sqrt(2.0);
}

Eigen::VectorXd SolveHeld(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right, double least) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  const double floor = least * eigen.eigenvalues()[matrix.cols() - 1];
  Eigen::VectorXd solution = Eigen::VectorXd::Zero(right.size());
  for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
    const double value = eigen.eigenvalues()[k];
    if (value > floor) solution += eigen.eigenvectors().col(k).dot(right) / value * eigen.eigenvectors().col(k);
  }
  return solution;
}

double ConditionNumber(const Matrix6d& matrix, Vector6d* weakest) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(matrix);
  *weakest = eigen.eigenvectors().col(0);
  const double low = eigen.eigenvalues()[0], high = eigen.eigenvalues()[5];
  return low > high * 1e-24 ? std::min(1e12, std::sqrt(high / low)) : 1e12;
}

}  // namespace sixpoint::metrology

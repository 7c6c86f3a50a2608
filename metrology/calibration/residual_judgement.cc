#include "metrology/calibration/residual_judgement.h"

#include <algorithm>

#include "metrology/linear_algebra/inverse.h"
#include "metrology/statistics/distributions.h"

namespace sixpoint::metrology {
namespace {

constexpr double kLeastProbability = 1e-3;  // one sound calibration in a thousand waits for a person
constexpr double kMostFreedom = 1e6;        // as good as infinite

}  // namespace

ResidualJudgement JudgeSquares(const std::string& of, double squares_over_variance, double count,
                               double degrees_of_freedom) {
  ResidualJudgement judgement;
  judgement.of = of;
  judgement.count = count;
  judgement.ratio = squares_over_variance / count;
  judgement.probability = FisherUpperTail(judgement.ratio, count, std::min(degrees_of_freedom, kMostFreedom));
  judgement.agrees = judgement.probability >= kLeastProbability;
  return judgement;
}

ResidualJudgement JudgeResiduals(const std::string& of, const Eigen::VectorXd& residuals,
                                 const Eigen::MatrixXd& covariance, double degrees_of_freedom, double spent) {
  const double squares = residuals.dot(SolvePositiveDefinite(covariance, residuals));
  return JudgeSquares(of, squares, static_cast<double>(residuals.size()) - spent, degrees_of_freedom);
}

}  // namespace sixpoint::metrology

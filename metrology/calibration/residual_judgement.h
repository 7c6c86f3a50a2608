// Whether residuals that took no part in a fit, or that it says nothing else of, are what its uncertainty explains.
#pragma once

#include <Eigen/Core>
#include <string>

namespace sixpoint::metrology {

struct ResidualJudgement {
  std::string of;          // what was asked: "held-out poses"
  double ratio = 0;        // mean square over what is expected: Fisher's F
  double count = 0;        // independent residuals
  double probability = 1;  // of as great a ratio or a greater one by chance
  bool agrees = true;      // as probable as one in a thousand, or more
};

// residuals: all of them; covariance: of them, by the noise and by what the fit is uncertain. spent: how many were used up by what was
// fitted to them. degrees_of_freedom: of the noise; infinite where it was stated.
ResidualJudgement JudgeResiduals(const std::string& of, const Eigen::VectorXd& residuals,
                                 const Eigen::MatrixXd& covariance, double degrees_of_freedom, double spent = 0);
// The same of a sum of squares, each over its variance.
ResidualJudgement JudgeSquares(const std::string& of, double squares_over_variance, double count,
                               double degrees_of_freedom);

}  // namespace sixpoint::metrology

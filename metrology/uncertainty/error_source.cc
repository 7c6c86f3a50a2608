#include "metrology/uncertainty/error_source.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/kinematics/axis_line.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/statistics/distributions.h"

namespace sixpoint::metrology {

namespace {

constexpr double kKnown = 1e6;  // so many degrees of freedom are as good as infinite

// draws: 6 x any, of the linear axes.
ErrorSource OfLinearAxes(const std::string& name, const Eigen::MatrixXd& draws, const LinearResponse& response) {
  ErrorSource source;
  source.name = name;
  source.parameters_per_sigma.setZero(kCalibrationParameterCount, draws.cols());
  source.parameters_per_sigma.middleRows<kAxisParameterCount>(kFirstAxisParameter) = response * draws;
  source.parameters_per_sigma.bottomRows<kLinearParameterCount>() = draws;
  return source;
}

// The square root of a covariance: columns whose products are it.
Eigen::MatrixXd RootOf(const Eigen::MatrixXd& covariance) {
  // One that was never computed has no root: its directions would look like ones without variance, and be left out.
  if (!covariance.allFinite())
    return Eigen::MatrixXd::Constant(covariance.rows(), covariance.cols(), std::numeric_limits<double>::quiet_NaN());
  // In units in which all variances are 1, so that an angle's is not lost beside a length's.
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd inverse = sigma.unaryExpr([](double s) { return s > 0 ? 1 / s : 0; });
  const EigenSystem eigen = EigenSystemOf(Eigen::MatrixXd(inverse.asDiagonal() * covariance * inverse.asDiagonal()));
  std::vector<Eigen::Index> counting;
  for (Eigen::Index k = 0; k < eigen.values.size(); ++k)
    if (eigen.values[k] > 1e-12) counting.push_back(k);
  Eigen::MatrixXd root(covariance.rows(), static_cast<Eigen::Index>(counting.size()));
  for (std::size_t k = 0; k < counting.size(); ++k)
    root.col(static_cast<Eigen::Index>(k)) =
        std::sqrt(eigen.values[counting[k]]) * sigma.cwiseProduct(eigen.vectors.col(counting[k]));
  return root;
}

}  // namespace

ErrorSource SourceOf(const std::string& name, const CalibrationCovariance& covariance) {
  ErrorSource source;
  source.name = name;
  source.parameters_per_sigma = RootOf(covariance);
  return source;
}

CalibrationCovariance CovarianceOf(const std::vector<ErrorSource>& sources) {
  CalibrationCovariance covariance = CalibrationCovariance::Zero();
  for (const ErrorSource& source : sources)
    covariance += source.parameters_per_sigma * source.parameters_per_sigma.transpose();
  return covariance;
}

Matrix6d PoseCovarianceOf(const std::vector<ErrorSource>& sources) {
  Matrix6d covariance = Matrix6d::Zero();
  for (const ErrorSource& source : sources) covariance += source.pose_per_sigma * source.pose_per_sigma.transpose();
  return covariance;
}

void ActOnPose(const PoseSensitivity& sensitivity, std::vector<ErrorSource>* sources) {
  for (ErrorSource& source : *sources) source.pose_per_sigma = sensitivity * source.parameters_per_sigma;
}

double EffectiveDegreesOfFreedom(const std::vector<UncertaintyComponent>& components) {
  double variance = 0, spent = 0;
  for (const UncertaintyComponent& one : components) {
    variance += one.variance;
    if (one.degrees_of_freedom < kKnown) spent += one.variance * one.variance / std::max(1.0, one.degrees_of_freedom);
  }
  return spent > 0 ? variance * variance / spent : std::numeric_limits<double>::infinity();
}

double WideningOf(double probability, double degrees_of_freedom, double components) {
  if (!(degrees_of_freedom < kKnown)) return 1;
  // With one component Fisher's quantile is Student's squared.
  return std::sqrt(components * FisherQuantile(probability, components, std::max(1.0, degrees_of_freedom)) /
                   ChiSquaredQuantile(probability, components));
}

double ComponentsOf(const Eigen::Matrix3d& covariance) {
  const double square = covariance.squaredNorm();
  return square > 0 ? covariance.trace() * covariance.trace() / square : 1;
}

ErrorSource SensorCalibrationSource(const SensorCovariance& covariance, double degrees_of_freedom,
                                    const std::string& calibration) {
  ErrorSource source =
      SourceOf("sensor calibration, " + calibration, JointCovariance(covariance, AxesCovariance::Zero()));
  source.degrees_of_freedom = degrees_of_freedom;
  return source;
}

ErrorSource RotationCalibrationSource(const AxesCovariance& covariance, double degrees_of_freedom,
                                      const std::string& calibration) {
  ErrorSource source =
      SourceOf("rotation calibration, " + calibration, JointCovariance(SensorCovariance::Zero(), covariance));
  source.degrees_of_freedom = degrees_of_freedom;
  return source;
}

ErrorSource TouchOffset(double standard_uncertainty_mm, const Eigen::Vector3d& a_direction,
                        const Eigen::Vector3d& b_direction) {
  ErrorSource source;
  source.name = "touch probe's offset";
  source.parameters_per_sigma.setZero(kCalibrationParameterCount, 3);
  source.parameters_per_sigma.middleRows<3>(3).setIdentity();
  // Of each axis two parameters lean it and two place it, along the basis across it.
  source.parameters_per_sigma.middleRows<2>(kFirstAxisParameter + 2) = TangentBasis(a_direction).transpose();
  source.parameters_per_sigma.middleRows<2>(kFirstAxisParameter + 6) = TangentBasis(b_direction).transpose();
  source.parameters_per_sigma *= standard_uncertainty_mm;
  return source;
}

ErrorSource ScannerFieldSource(const FieldCovariance& covariance_mm2, const FieldResponse& response) {
  Eigen::Matrix<double, kCalibrationParameterCount, kFieldParameterCount> moves;
  moves.setZero();
  moves.topRows<kSensorParameterCount>() = response;
  moves.middleRows<kFieldParameterCount>(kFirstFieldParameter).setIdentity();
  ErrorSource source;
  source.name = "scanner's field";
  source.parameters_per_sigma = moves * RootOf(covariance_mm2);
  return source;
}

ErrorSource ScalesOfLinearAxes(double standard_uncertainty_ratio, const LinearResponse& response) {
  return OfLinearAxes("linear axes' scales",
                      standard_uncertainty_ratio * Eigen::MatrixXd::Identity(kLinearParameterCount, 3), response);
}

ErrorSource SquarenessOfLinearAxes(double standard_uncertainty_ratio, const LinearResponse& response) {
  return OfLinearAxes(
      "linear axes' squareness",
      standard_uncertainty_ratio * Eigen::MatrixXd::Identity(kLinearParameterCount, kLinearParameterCount).rightCols(3),
      response);
}

ErrorSource Expansion(const std::string& name, double standard_uncertainty_ratio, const LinearResponse& response) {
  Eigen::MatrixXd alike = Eigen::MatrixXd::Zero(kLinearParameterCount, 1);
  alike.topRows<3>().setConstant(standard_uncertainty_ratio);
  return OfLinearAxes(name, alike, response);
}

ErrorSource EncoderLatency(const std::string& name, double standard_uncertainty_mm) {
  ErrorSource source;
  source.name = name;
  source.parameters_per_sigma.setZero(kCalibrationParameterCount, 1);
  source.parameters_per_sigma(3, 0) = standard_uncertainty_mm;  // T_sm along X
  return source;
}

ErrorSource ArmSwing(const std::string& name, const SensorCovariance& spread, double degrees_of_freedom) {
  CalibrationCovariance covariance = CalibrationCovariance::Zero();
  covariance.topLeftCorner<kSensorParameterCount, kSensorParameterCount>() = spread;
  ErrorSource source = SourceOf(name, covariance);
  source.degrees_of_freedom = degrees_of_freedom;
  return source;
}

}  // namespace sixpoint::metrology

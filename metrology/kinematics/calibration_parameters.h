// What maps a scan to the part at A = B = 0, parameter by parameter: what a machine's calibrations give, then the scanner's own field and how the linear axes' readings are
// stretched. It is the one list, in the one order that every covariance and every sensitivity follows. All counts derive from it.
//
// A parameter more is a line more here, and its column in the Jacobian that the list names.
#pragma once

#include <Eigen/Core>
#include <array>

namespace sixpoint::metrology {

enum class ParameterUnit { kRad, kMm, kRatio };

struct CalibrationParameter {
  const char* name;
  ParameterUnit unit;
};

// Order of SensorPose::ParameterJacobian: the rotation vector of R_sm in machine axes, then T_sm.
inline constexpr std::array kSensorParameters = {
    CalibrationParameter{"alpha (turn about machine X)", ParameterUnit::kRad},
    CalibrationParameter{"beta (turn about machine Y)", ParameterUnit::kRad},
    CalibrationParameter{"gamma (turn about machine Z)", ParameterUnit::kRad},
    CalibrationParameter{"T_sm x", ParameterUnit::kMm},
    CalibrationParameter{"T_sm y", ParameterUnit::kMm},
    CalibrationParameter{"T_sm z", ParameterUnit::kMm},
};

// Order of RotaryAxes::ParameterJacobian: of the axis on the bed (a), then of the one that it carries (b), how its direction
// leans and where it stands, each along e1 and e2 across it.
inline constexpr std::array kAxisParameters = {
    CalibrationParameter{"a direction e1", ParameterUnit::kRad},
    CalibrationParameter{"a direction e2", ParameterUnit::kRad},
    CalibrationParameter{"a point e1", ParameterUnit::kMm},
    CalibrationParameter{"a point e2", ParameterUnit::kMm},
    CalibrationParameter{"b direction e1", ParameterUnit::kRad},
    CalibrationParameter{"b direction e2", ParameterUnit::kRad},
    CalibrationParameter{"b point e1", ParameterUnit::kMm},
    CalibrationParameter{"b point e2", ParameterUnit::kMm},
};

// Order of ScannerField::TermsAt: how far a reading is off along z, by Legendre polynomials of y and z over the measuring field. The
// constant is T_sm's.
inline constexpr std::array kFieldParameters = {
    CalibrationParameter{"field y", ParameterUnit::kMm},   CalibrationParameter{"field z", ParameterUnit::kMm},
    CalibrationParameter{"field yy", ParameterUnit::kMm},  CalibrationParameter{"field yz", ParameterUnit::kMm},
    CalibrationParameter{"field zz", ParameterUnit::kMm},  CalibrationParameter{"field yyy", ParameterUnit::kMm},
    CalibrationParameter{"field yyz", ParameterUnit::kMm}, CalibrationParameter{"field yzz", ParameterUnit::kMm},
    CalibrationParameter{"field zzz", ParameterUnit::kMm},
};

// Order of LinearAxesJacobian: what the linear axes read of a true position p is p + L p, L the upper triangle of these (mm in a mm).
inline constexpr std::array kLinearParameters = {
    CalibrationParameter{"scale of X", ParameterUnit::kRatio},
    CalibrationParameter{"scale of Y", ParameterUnit::kRatio},
    CalibrationParameter{"scale of Z", ParameterUnit::kRatio},
    CalibrationParameter{"X to Y not square", ParameterUnit::kRatio},
    CalibrationParameter{"X to Z not square", ParameterUnit::kRatio},
    CalibrationParameter{"Y to Z not square", ParameterUnit::kRatio},
};

// Of all: the sensor's, the axes', the field's, the linear axes'. The first two are calibrated.
inline constexpr int kSensorParameterCount = static_cast<int>(kSensorParameters.size());
inline constexpr int kAxisParameterCount = static_cast<int>(kAxisParameters.size());
inline constexpr int kFieldParameterCount = static_cast<int>(kFieldParameters.size());
inline constexpr int kCalibratedParameterCount = kSensorParameterCount + kAxisParameterCount;
inline constexpr int kLinearParameterCount = static_cast<int>(kLinearParameters.size());
inline constexpr int kCalibrationParameterCount =
    kCalibratedParameterCount + kFieldParameterCount + kLinearParameterCount;
// Where each begins in the list.
inline constexpr int kFirstAxisParameter = kSensorParameterCount, kFirstFieldParameter = kCalibratedParameterCount,
                     kFirstLinearParameter = kFirstFieldParameter + kFieldParameterCount;

using SensorCovariance = Eigen::Matrix<double, kSensorParameterCount, kSensorParameterCount>;
using AxesCovariance = Eigen::Matrix<double, kAxisParameterCount, kAxisParameterCount>;
// Change of a sensor's calibrated parameters per field parameter of the scans that it was found from.
using FieldResponse = Eigen::Matrix<double, kSensorParameterCount, kFieldParameterCount>;
// Change of both rotary axes' parameters per parameter of the linear axes that their sphere was probed with.
using LinearResponse = Eigen::Matrix<double, kAxisParameterCount, kLinearParameterCount>;
// What the scanner's field is, and how well that is known, in the order of kFieldParameters.
using FieldTerms = Eigen::Matrix<double, kFieldParameterCount, 1>;
using FieldCovariance = Eigen::Matrix<double, kFieldParameterCount, kFieldParameterCount>;
using CalibrationCovariance = Eigen::Matrix<double, kCalibrationParameterCount, kCalibrationParameterCount>;
using CalibrationVector = Eigen::Matrix<double, kCalibrationParameterCount, 1>;

// Change of a point, and of a pose (order of PoseCovariance), per change of each parameter.
using PointSensitivity = Eigen::Matrix<double, 3, kCalibrationParameterCount>;
using PoseSensitivity = Eigen::Matrix<double, 6, kCalibrationParameterCount>;

// Of what the two calibrations, which know nothing of each other, say of their own noise.
inline CalibrationCovariance JointCovariance(const SensorCovariance& sensor, const AxesCovariance& axes) {
  CalibrationCovariance joint = CalibrationCovariance::Zero();
  joint.topLeftCorner<kSensorParameterCount, kSensorParameterCount>() = sensor;
  joint.block<kAxisParameterCount, kAxisParameterCount>(kSensorParameterCount, kSensorParameterCount) = axes;
  return joint;
}

}  // namespace sixpoint::metrology

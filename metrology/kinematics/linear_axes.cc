#include "metrology/kinematics/linear_axes.h"

#include "metrology/kinematics/axis_line.h"

namespace sixpoint::metrology {

Eigen::Matrix<double, 3, kLinearParameterCount> LinearAxesJacobian(const Eigen::Vector3d& machine_mm) {
  const double x = machine_mm.x(), y = machine_mm.y(), z = machine_mm.z();
  Eigen::Matrix<double, 3, kLinearParameterCount> jacobian;
  jacobian << x, 0, 0, y, z, 0,  //
      0, y, 0, 0, 0, z,          //
      0, 0, z, 0, 0, 0;
  return jacobian;
}

LinearResponse LineResponse(const RotaryAxes& axes) {
  LinearResponse response;
  int row = 0;
  for (const AxisLine& line : {axes.a, axes.b}) {
    const Eigen::Matrix<double, 2, 3> across = TangentBasis(line.direction).transpose();
    response.middleRows<2>(row) = across * LinearAxesJacobian(line.direction);
    response.middleRows<2>(row + 2) = across * LinearAxesJacobian(line.point_mm);
    row += 4;
  }
  return response;
}

}  // namespace sixpoint::metrology

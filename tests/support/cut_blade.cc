#include "tests/support/cut_blade.h"

#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::testing {
namespace {

constexpr double kRadPerCutDeg = 3.14159265358979323846 / 180;
constexpr double kCutAngles[2][2] = {{0, 55}, {20, -30}};  // A, B of G1 and G2

std::array<double, 3> ThreeOfCut(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::vector<CutHole> HolesOf(const CutBlade& blade) {
  std::vector<CutHole> holes;
  for (int g = 0; g < 2; ++g)
    for (int h = 0; h < 2; ++h) {
      CutHole& hole = holes.emplace_back();
      hole.group = "G" + std::to_string(g + 1);
      hole.hole = "H" + std::to_string(h + 1);
      hole.a_deg = kCutAngles[g][0];
      hole.b_deg = kCutAngles[g][1];
      const metrology::RotaryAxes axes;
      const Eigen::Matrix3d part_from_machine =
          axes.MachineFromZero(hole.a_deg * kRadPerCutDeg, hole.b_deg * kRadPerCutDeg).linear().transpose();
      const Eigen::Vector3d start_mm(10.0 * h, 5.0 * g, 20);
      hole.predicted_start_mm = ThreeOfCut(start_mm);
      hole.found_start_mm = ThreeOfCut(start_mm + part_from_machine * blade.off_mm);
      hole.axis = ThreeOfCut(part_from_machine * Eigen::Vector3d::UnitZ());
    }
  return holes;
}

std::vector<std::string> CutBudgetSources() { return {"points of the pin", "sensor calibration"}; }
std::vector<double> CutBudget_um() { return {4, 3}; }

}  // namespace sixpoint::testing

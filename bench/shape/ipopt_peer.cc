#include "bench/shape/ipopt_peer.h"

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <cmath>
#include <map>

namespace sixpoint::bench {
namespace {

using Ipopt::Index;
using Ipopt::Number;
using metrology::ControlLattice;
using metrology::DisplacementLimit;
using metrology::FreeFormDeformation;

constexpr double kEnergyPrice = 1e-3;  // beside a millimetre of slack

// Elements of the lower triangle, of one component.
std::map<std::pair<Index, Index>, double> EnergyOf(const FreeFormDeformation& still,
                                                   const std::vector<Index>& unknown_of, double stiffness,
                                                   double decay_mm) {
  // Five points of Gauss a cell and axis.
  const double nodes[] = {0.0469100770306680, 0.2307653449471585, 0.5, 0.7692346550528415, 0.9530899229693319};
  const double weights[] = {0.1184634425280945, 0.2393143352496832, 0.2844444444444444, 0.2393143352496832,
                            0.1184634425280945};
  const ControlLattice& lattice = still.lattice();
  const Eigen::Vector3d h = lattice.spacing_mm;
  Eigen::MatrixXd element = Eigen::MatrixXd::Zero(64, 64);
  for (int point = 0; point < 125; ++point) {
    const int at[3] = {point / 25, point / 5 % 5, point % 5};
    const double weight = stiffness * h.prod() * weights[at[0]] * weights[at[1]] * weights[at[2]];
    std::array<double, 4> by[3][3];  // [order][axis]
    for (int axis = 0; axis < 3; ++axis) {
      by[0][axis] = metrology::SplineValues(nodes[at[axis]]);
      by[1][axis] = metrology::SplineSlopes(nodes[at[axis]]);
      by[2][axis] = metrology::SplineBends(nodes[at[axis]]);
      for (double& value : by[1][axis]) value /= h[axis];
      for (double& value : by[2][axis]) value /= h[axis] * h[axis];
    }
    const auto add = [&](const int order[3], double by_weight) {
      Eigen::VectorXd row(64);
      for (int local = 0; local < 64; ++local)
        row[local] = by[order[0]][0][static_cast<std::size_t>(local / 16)] *
                     by[order[1]][1][static_cast<std::size_t>(local / 4 % 4)] *
                     by[order[2]][2][static_cast<std::size_t>(local % 4)];
      element += by_weight * row * row.transpose();
    };
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        int order[3] = {0, 0, 0};
        ++order[a];
        ++order[b];
        add(order, weight);
      }
    const int none[3] = {0, 0, 0};
    add(none, weight * std::pow(decay_mm, -4));
  }
  std::map<std::pair<Index, Index>, double> elements;
  for (int x = 0; x < lattice.cells[0]; ++x)
    for (int y = 0; y < lattice.cells[1]; ++y)
      for (int z = 0; z < lattice.cells[2]; ++z) {
        if (still.covered()[lattice.CellIndex(x, y, z)] == 0) continue;
        for (int p = 0; p < 64; ++p)
          for (int q = 0; q < 64; ++q) {
            const Index row = unknown_of[lattice.ControlIndex(x + p / 16, y + p / 4 % 4, z + p % 4)];
            const Index column = unknown_of[lattice.ControlIndex(x + q / 16, y + q / 4 % 4, z + q % 4)];
            if (row >= column) elements[{row, column}] += element(p, q);
          }
      }
  return elements;
}

class Programme : public Ipopt::TNLP {
 public:
  Programme(const FreeFormDeformation& still, const std::vector<DisplacementLimit>& limits, double stiffness,
            double decay_mm)
      : limits_(limits), lattice_(still.lattice()), unknown_of_(lattice_.control_count(), -1) {
    for (int x = 0; x < lattice_.cells[0]; ++x)
      for (int y = 0; y < lattice_.cells[1]; ++y)
        for (int z = 0; z < lattice_.cells[2]; ++z)
          if (still.covered()[lattice_.CellIndex(x, y, z)] != 0)
            for (int p = 0; p < 64; ++p) {
              Index& unknown = unknown_of_[lattice_.ControlIndex(x + p / 16, y + p / 4 % 4, z + p % 4)];
              if (unknown < 0) unknown = controls_++;
            }
    energy_ = EnergyOf(still, unknown_of_, stiffness, decay_mm);
  }
  double slack_mm() const { return slack_mm_; }

  bool get_nlp_info(Index& n, Index& m, Index& nonzeros, Index& hessian, IndexStyleEnum& style) override {
    n = 3 * controls_ + 1;
    m = 0;
    for (const DisplacementLimit& limit : limits_)
      m += (std::isfinite(limit.least_mm) ? 1 : 0) + (std::isfinite(limit.most_mm) ? 1 : 0);
    nonzeros = m * (64 * 3 + 1);
    hessian = 3 * static_cast<Index>(energy_.size());
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index n, Number* low, Number* high, Index m, Number* least, Number* most) override {
    for (Index i = 0; i < n; ++i) low[i] = -1e19, high[i] = 1e19;
    low[n - 1] = 0;
    std::fill(most, most + m, 1e19);
    for (const DisplacementLimit& limit : limits_) {
      if (std::isfinite(limit.least_mm)) *least++ = limit.least_mm;
      if (std::isfinite(limit.most_mm)) *least++ = -limit.most_mm;
    }
    return true;
  }
  bool get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) override {
    std::fill(x, x + n, 0.0);
    x[n - 1] = 1;
    return true;
  }
  bool eval_f(Index n, const Number* x, bool, Number& value) override {
    value = x[n - 1];
    for (const auto& [at, element] : energy_)
      for (Index k = 0; k < 3; ++k)
        value +=
            kEnergyPrice * (at.first == at.second ? 0.5 : 1) * element * x[3 * at.first + k] * x[3 * at.second + k];
    return true;
  }
  bool eval_grad_f(Index n, const Number* x, bool, Number* slope) override {
    std::fill(slope, slope + n, 0.0);
    slope[n - 1] = 1;
    for (const auto& [at, element] : energy_)
      for (Index k = 0; k < 3; ++k) {
        slope[3 * at.first + k] += kEnergyPrice * element * x[3 * at.second + k];
        if (at.first != at.second) slope[3 * at.second + k] += kEnergyPrice * element * x[3 * at.first + k];
      }
    return true;
  }
  template <typename Take>
  void EachElement(const Take& take) const {
    Index count = 0, row = -1;
    for (std::size_t i = 0; i < limits_.size(); ++i)
      for (const double sign : {1.0, -1.0}) {
        if (!std::isfinite(sign > 0 ? limits_[i].least_mm : limits_[i].most_mm)) continue;
        ++row;
        const DisplacementLimit& limit = limits_[i];
        for (int p = 0; p < 64; ++p) {
          const int x = p / 16, y = p / 4 % 4, z = p % 4;
          const Index unknown =
              unknown_of_[lattice_.ControlIndex(limit.at.cell[0] + x, limit.at.cell[1] + y, limit.at.cell[2] + z)];
          for (Index k = 0; k < 3; ++k)
            take(count++, row, 3 * unknown + k, sign * limit.at.Weight(x, y, z) * limit.direction[k]);
        }
        take(count++, row, 3 * controls_, 1.0);
      }
  }
  bool eval_g(Index, const Number* x, bool, Index m, Number* value) override {
    std::fill(value, value + m, 0.0);
    EachElement([&](Index, Index row, Index column, double element) { value[row] += element * x[column]; });
    return true;
  }
  bool eval_jac_g(Index, const Number*, bool, Index, Index, Index* rows, Index* columns, Number* values) override {
    EachElement([&](Index count, Index row, Index column, double element) {
      if (values == nullptr)
        rows[count] = row, columns[count] = column;
      else
        values[count] = element;
    });
    return true;
  }
  bool eval_h(Index, const Number*, bool, Number factor, Index, const Number*, bool, Index, Index* rows, Index* columns,
              Number* values) override {
    Index count = 0;
    for (const auto& [at, element] : energy_)
      for (Index k = 0; k < 3; ++k, ++count) {
        if (values == nullptr)
          rows[count] = 3 * at.first + k, columns[count] = 3 * at.second + k;
        else
          values[count] = factor * kEnergyPrice * element;
      }
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number*, const Number*, Index,
                         const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    slack_mm_ = x[n - 1];
  }

 private:
  const std::vector<DisplacementLimit>& limits_;
  const ControlLattice lattice_;
  std::vector<Index> unknown_of_;
  Index controls_ = 0;
  std::map<std::pair<Index, Index>, double> energy_;
  double slack_mm_ = 0;
};

}  // namespace

std::optional<PeerAnswer> SolveByIpopt(const FreeFormDeformation& still, const std::vector<DisplacementLimit>& limits,
                                       double stiffness, double decay_mm, double longest_s) {
  Ipopt::SmartPtr<Programme> programme = new Programme(still, limits, stiffness, decay_mm);
  Ipopt::SmartPtr<Ipopt::IpoptApplication> solver = new Ipopt::IpoptApplication(false);
  solver->Options()->SetIntegerValue("print_level", 0);
  solver->Options()->SetStringValue("sb", "yes");
  for (const char* constant : {"hessian_constant", "jac_c_constant", "jac_d_constant", "mehrotra_algorithm"})
    solver->Options()->SetStringValue(constant, "yes");
  solver->Options()->SetNumericValue("tol", 1e-6);
  solver->Options()->SetNumericValue("max_cpu_time", longest_s);
  if (solver->Initialize() != Ipopt::Solve_Succeeded) return std::nullopt;
  const Ipopt::SmartPtr<Ipopt::TNLP> as_base = GetRawPtr(programme);
  const Ipopt::ApplicationReturnStatus status = solver->OptimizeTNLP(as_base);
  if (status != Ipopt::Solve_Succeeded && status != Ipopt::Solved_To_Acceptable_Level) return std::nullopt;
  return PeerAnswer{programme->slack_mm(), solver->Statistics()->TotalCPUTime(),
                    solver->Statistics()->IterationCount()};
}

}  // namespace sixpoint::bench

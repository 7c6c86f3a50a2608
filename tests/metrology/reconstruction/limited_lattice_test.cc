// The programme beside closed forms, beside a plain dense solver, and by the conditions that only its answer satisfies.
#include "metrology/reconstruction/limited_lattice.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "metrology/linear_algebra/complementary.h"
#include "metrology/linear_algebra/layered_cholesky.h"
#include "metrology/linear_algebra/least_distance.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

ControlLattice SmallLattice() { return {Vector3d(100, 200, 300), Vector3d(5, 4, 6), {3, 4, 6}}; }

LatticeWeights At(const Vector3d& from_corner_mm) {
  return *FreeFormDeformation::Still(SmallLattice())->WeightsAt(SmallLattice().corner_mm + from_corner_mm);
}

// Held at 0 at its lower end.
LatticeSystem System() {
  LatticeSystem system(SmallLattice(), {});
  system.AddEnergy(1e-2, 20);
  for (double x = 1; x < 15; x += 3)
    for (double y = 1; y < 16; y += 3) system.AddPull(At({x, y, 2}), 1, Vector3d::Zero());
  EXPECT_TRUE(system.Factor());
  return system;
}

// Rows of the limits over all three components, and how the programme's matrix looks when nothing of its structure is used.
struct Dense {
  MatrixXd matrix;  // over controls x 3
  VectorXd right;
};

VectorXd RowOf(const LatticeWeights& at, const Vector3d& direction) {
  VectorXd row = VectorXd::Zero(3 * static_cast<Index>(SmallLattice().control_count()));
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 4; ++z)
        row.segment<3>(3 * static_cast<Index>(SmallLattice().ControlIndex(
                               at.cell[0] + x, at.cell[1] + y, at.cell[2] + z))) = at.Weight(x, y, z) * direction;
  return row;
}

// The energy by sums over points, whatever the product's rule: it is exact for its polynomials too, with eight points a cell and axis.
Dense DenseOf(double stiffness, double decay_mm) {
  const Index size = 3 * static_cast<Index>(SmallLattice().control_count());
  Dense dense{MatrixXd::Zero(size, size), VectorXd::Zero(size)};
  const double nodes[] = {0.0198550717512319, 0.1016667612931866, 0.2372337950418355, 0.4082826787521751,
                          0.5917173212478249, 0.7627662049581645, 0.8983332387068134, 0.9801449282487681};
  const double weights[] = {0.0506142681451881, 0.1111905172266872, 0.1568533229389436, 0.1813418916891810,
                            0.1813418916891810, 0.1568533229389436, 0.1111905172266872, 0.0506142681451881};
  const Vector3d h = SmallLattice().spacing_mm;
  MatrixXd scalar = MatrixXd::Zero(size / 3, size / 3);
  const auto add = [&](const std::array<int, 3>& cell, const std::array<std::array<double, 4>, 3>& by, double weight) {
    VectorXd row = VectorXd::Zero(size / 3);
    for (std::size_t x = 0; x < 4; ++x)
      for (std::size_t y = 0; y < 4; ++y)
        for (std::size_t z = 0; z < 4; ++z)
          row[static_cast<Index>(SmallLattice().ControlIndex(
              cell[0] + static_cast<int>(x), cell[1] + static_cast<int>(y), cell[2] + static_cast<int>(z)))] =
              by[0][x] * by[1][y] * by[2][z];
    scalar.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
  };
  for (int cx = 0; cx < SmallLattice().cells[0]; ++cx)
    for (int cy = 0; cy < SmallLattice().cells[1]; ++cy)
      for (int cz = 0; cz < SmallLattice().cells[2]; ++cz)
        for (int point = 0; point < 512; ++point) {
          const int at[3] = {point / 64, point / 8 % 8, point % 8};
          const double weight = stiffness * h.prod() * weights[at[0]] * weights[at[1]] * weights[at[2]];
          std::array<std::array<std::array<double, 4>, 3>, 3> by;  // [order][axis]
          for (std::size_t axis = 0; axis < 3; ++axis) {
            by[0][axis] = SplineValues(nodes[at[axis]]);
            by[1][axis] = SplineSlopes(nodes[at[axis]]);
            by[2][axis] = SplineBends(nodes[at[axis]]);
            for (double& value : by[1][axis]) value /= h[static_cast<Index>(axis)];
            for (double& value : by[2][axis]) value /= h[static_cast<Index>(axis)] * h[static_cast<Index>(axis)];
          }
          for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t b = 0; b < 3; ++b) {
              std::array<std::size_t, 3> order = {0, 0, 0};
              ++order[a];
              ++order[b];
              add({cx, cy, cz}, {by[order[0]][0], by[order[1]][1], by[order[2]][2]}, weight);
            }
          add({cx, cy, cz}, by[0], weight * std::pow(decay_mm, -4));
        }
  for (Index i = 0; i < scalar.rows(); ++i)
    for (Index j = 0; j <= i; ++j)
      for (Index k = 0; k < 3; ++k)
        dense.matrix(3 * i + k, 3 * j + k) = dense.matrix(3 * j + k, 3 * i + k) = scalar(i, j);
  return dense;
}

Dense DenseSystem() {
  static const Dense kBare = DenseOf(1e-2, 20);
  Dense dense = kBare;
  for (double x = 1; x < 15; x += 3)
    for (double y = 1; y < 16; y += 3)
      for (int axis = 0; axis < 3; ++axis) {
        const VectorXd row = RowOf(At({x, y, 2}), Vector3d::Unit(axis));
        dense.matrix += row * row.transpose();
      }
  return dense;
}

// Walls that slide: the least by the whole matrix over the three components at once.
TEST(LatticeSystem, SlidesAlongItsWallsAsTheWholeMatrixSays) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal(0, 1);
  std::vector<LatticePull> pulls;
  for (int i = 0; i < 400; ++i) {
    LatticePull pull;
    pull.at = At(Vector3d(15 * unit(random), 16 * unit(random), 36 * unit(random)));
    pull.weight = 0.5 + unit(random);
    pull.normal = Vector3d(normal(random), normal(random), normal(random)).normalized();
    pull.wanted_mm = Vector3d(normal(random), normal(random), normal(random));
    pull.slides = i % 4 != 0;
    pulls.push_back(pull);
  }
  LatticeSystem system(SmallLattice(), {});
  system.AddEnergy(1e-2, 20);
  system.AddPulls(pulls);
  ASSERT_TRUE(system.Factor());
  Dense dense = DenseOf(1e-2, 20);
  for (const LatticePull& pull : pulls)
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d along = pull.slides ? pull.normal : Vector3d(Vector3d::Unit(axis));
      if (pull.slides && axis > 0) break;
      const VectorXd row = RowOf(pull.at, along);
      dense.matrix += pull.weight * row * row.transpose();
      dense.right += pull.weight * along.dot(pull.wanted_mm) * row;
    }
  const VectorXd wanted = dense.matrix.ldlt().solve(dense.right);
  const ControlDisplacements slid_mm = system.Slid(pulls, {}, 2);
  const Eigen::Map<const VectorXd> found(slid_mm.data(), wanted.size());
  const VectorXd off = found - wanted;
  // Of the energy that there is to gain, a millionth is left at most: so far the gradients are followed.
  EXPECT_LT(off.dot(dense.matrix * off), 1e-6 * wanted.dot(dense.matrix * wanted));
  // Pulled as vectors it is another shape: walls that stand against each other.
  const ControlDisplacements stiff_mm = system.Moved(MatrixXd::Zero(system.size(), 3));
  const VectorXd other = Eigen::Map<const VectorXd>(stiff_mm.data(), wanted.size()) - wanted;
  EXPECT_GT(other.dot(dense.matrix * other), 1e-2 * wanted.dot(dense.matrix * wanted));
}

SlackRule Firm() {
  SlackRule rule;
  rule.compliance.fill(1e-8);
  return rule;
}

std::vector<DisplacementLimit> RandomLimits(std::uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal(0, 1);
  std::vector<DisplacementLimit> limits;
  for (int i = 0; i < count; ++i) {
    DisplacementLimit limit;
    limit.at = At(Vector3d(15 * unit(random), 16 * unit(random), 10 + 26 * unit(random)));
    limit.direction = Vector3d(normal(random), normal(random), normal(random)).normalized();
    limit.least_mm = -0.4 + 0.5 * unit(random);
    limit.most_mm = limit.least_mm + 0.7;
    limits.push_back(limit);
  }
  return limits;
}

TEST(LayeredCholesky, SolvesAsADenseFactorDoes) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, 1);
  const std::vector<Index> sizes = {3, 0, 5, 2, 4, 1, 6};
  LayeredCholesky layered(sizes, 2);
  MatrixXd dense = MatrixXd::Zero(21, 21);
  std::vector<int> layer_of;
  for (std::size_t layer = 0; layer < sizes.size(); ++layer)
    layer_of.insert(layer_of.end(), static_cast<std::size_t>(sizes[layer]), static_cast<int>(layer));
  for (Index i = 0; i < 21; ++i)
    for (Index j = 0; j <= i; ++j) {
      if (layer_of[static_cast<std::size_t>(i)] - layer_of[static_cast<std::size_t>(j)] > 2) continue;
      const double value = i == j ? 30 : normal(random);
      layered.Add(i, j, value);
      dense(i, j) = dense(j, i) = value;
    }
  MatrixXd right = MatrixXd::Random(21, 4);
  right.topRows(7).setZero();
  const MatrixXd wanted = dense.ldlt().solve(right);
  ASSERT_TRUE(layered.Factor());
  MatrixXd solved = right;
  layered.Solve(&solved);
  EXPECT_LT((solved - wanted).norm(), 1e-13);
  LayeredCholesky indefinite({2}, 1);
  indefinite.Add(0, 0, 1);
  indefinite.Add(1, 1, -1);
  EXPECT_FALSE(indefinite.Factor());
}

// The conditions say all: no other vector keeps them.
TEST(Complementary, KeepsItsConditions) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0, 1);
  for (int draw = 0; draw < 50; ++draw) {
    const Index size = 1 + draw * 3;
    MatrixXd half(size, size + 3);
    VectorXd r(size);
    for (Index i = 0; i < half.size(); ++i) half.data()[i] = normal(random);
    for (Index i = 0; i < size; ++i) r[i] = normal(random);
    const MatrixXd q = half * half.transpose();
    std::vector<bool> positive;
    const auto x = SolveComplementary(q, r, &positive);
    ASSERT_TRUE(x.ok()) << x.status();
    const VectorXd gap = q * *x - r;
    EXPECT_GE(x->minCoeff(), 0);
    EXPECT_GT(gap.minCoeff(), -1e-9);
    EXPECT_LT(x->cwiseProduct(gap).cwiseAbs().maxCoeff(), 1e-8);
    std::vector<bool> wrong_start(static_cast<std::size_t>(size), true);
    EXPECT_LT((*SolveComplementary(q, r, &wrong_start) - *x).norm(), 1e-6 * (1 + x->norm()));
  }
}

TEST(Complementary, SaysSoOfAMatrixThatIsNotDefinite) {
  std::vector<bool> positive;
  EXPECT_FALSE(SolveComplementary(-MatrixXd::Identity(2, 2), VectorXd::Ones(2), &positive).ok());
}

// One limit: the field is the reach of that place, scaled to what is wanted there.
TEST(LimitedLattice, OneLimitMovesByTheReachOfItsPlace) {
  const LatticeSystem system = System();
  DisplacementLimit limit;
  limit.at = At({7, 8, 30});
  limit.direction = Vector3d(1, 2, 2) / 3;
  limit.least_mm = 0.3;
  const auto solved = SolveLimited(system, {limit}, Firm(), {}, 1, nullptr);
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_TRUE(solved->settled);
  const MatrixXd dense = DenseSystem().matrix;
  const VectorXd row = RowOf(limit.at, limit.direction);
  const VectorXd reach = dense.ldlt().solve(row);
  const VectorXd wanted = 0.3 / row.dot(reach) * reach;
  EXPECT_LT((Eigen::Map<const VectorXd>(solved->controls_mm.data(), wanted.size()) - wanted).cwiseAbs().maxCoeff(),
            1e-7);
  ASSERT_EQ(solved->pushes.size(), 1u);
  EXPECT_NEAR(solved->pushes[0].force, 0.3 / row.dot(reach), 1e-6 * solved->pushes[0].force);
}

TEST(LimitedLattice, LimitsThatAreKeptAnywayDoNothing) {
  DisplacementLimit limit;
  limit.at = At({7, 8, 30});
  limit.least_mm = -0.1;
  limit.most_mm = 0.1;
  const auto solved = SolveLimited(System(), {limit}, Firm(), {}, 1, nullptr);
  EXPECT_TRUE(solved->settled);
  EXPECT_TRUE(solved->pushes.empty());
  EXPECT_LT(solved->controls_mm.norm(), 1e-12);
}

// Karush, Kuhn and Tucker, with a matrix that was made without the product's splines' structure: stationary, feasible, and pushing only where
// a limit holds. And the same answer as Lawson and Hanson's least distance over all rows at once.
TEST(LimitedLattice, KeepsTheConditionsOfTheLeast) {
  const LatticeSystem system = System();
  const MatrixXd dense = DenseSystem().matrix;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const auto limits = RandomLimits(seed, 150);
    const auto solved = SolveLimited(system, limits, Firm(), {}, 2, nullptr);
    ASSERT_TRUE(solved.ok()) << solved.status();
    ASSERT_TRUE(solved->settled);
    const Eigen::Map<const VectorXd> c(solved->controls_mm.data(), dense.rows());
    VectorXd pull = dense * c;
    double greatest = 0;
    for (const LimitPush& push : solved->pushes) {
      const DisplacementLimit& limit = limits[push.limit];
      const VectorXd row = RowOf(limit.at, limit.direction);
      pull -= (push.most ? -1 : 1) * push.force * row;
      greatest = std::max(greatest, push.force);
      EXPECT_GT(push.force, 0);
      EXPECT_NEAR(row.dot(c), push.most ? limit.most_mm : limit.least_mm, 1e-4);
    }
    EXPECT_GT(solved->pushes.size(), 5u);
    EXPECT_LT(pull.cwiseAbs().maxCoeff(), 1e-8 * greatest);
    MatrixXd g(300, dense.rows());
    VectorXd h(300);
    for (Index i = 0; i < 150; ++i) {
      const DisplacementLimit& limit = limits[static_cast<std::size_t>(i)];
      const VectorXd row = RowOf(limit.at, limit.direction);
      EXPECT_GT(row.dot(c), limit.least_mm - 1e-4);
      EXPECT_LT(row.dot(c), limit.most_mm + 1e-4);
      g.row(2 * i) = row.transpose();
      g.row(2 * i + 1) = -row.transpose();
      h[2 * i] = limit.least_mm;
      h[2 * i + 1] = -limit.most_mm;
    }
    const Eigen::LLT<MatrixXd> factor(dense);
    const MatrixXd turned = factor.matrixL().solve(g.transpose()).transpose();
    const auto other = SolveLeastDistance(turned, h);
    ASSERT_TRUE(other.ok() && other->feasible);
    const VectorXd plain = factor.matrixU().solve(other->x);
    // Some controls hardly cost anything: what the slack gives moves them by a micrometre.
    EXPECT_LT((plain - c).cwiseAbs().maxCoeff(), 3e-3);
    EXPECT_NEAR(plain.dot(dense * plain), c.dot(dense * c),
                1e-3 * c.dot(dense * c));  // the slack makes it a little cheaper
  }
}

// A place that must move by 0.3 at least and by 0.1 at most lacks 0.2: shared evenly by a slack of both, all by a slack of one.
TEST(LimitedLattice, ContradictionIsProvenAndItsLeastCureKnown) {
  const LatticeSystem system = System();
  std::vector<DisplacementLimit> limits(2);
  limits[0].at = limits[1].at = At({7, 8, 30});
  limits[0].least_mm = 0.3;
  limits[0].least_kind = LimitKind::kTolerance;
  limits[1].most_mm = 0.1;
  limits[1].most_kind = LimitKind::kStock;
  const auto both = SolveLimited(system, limits, Firm(), {}, 1, nullptr);
  ASSERT_TRUE(both.ok()) << both.status();
  EXPECT_NEAR(both->slack_mm[0], 0.1, 1e-5);  // each limit's own compliance takes a ten-thousandth
  ASSERT_EQ(both->pushes.size(), 2u);
  EXPECT_NEAR(both->pushes[0].force / both->pushes[1].force, 1, 1e-4);
  // Half of what is lacking, whatever the controls do up to a kilometre: what balances costs nothing.
  EXPECT_NEAR(ProvenMiss_mm(SmallLattice(), limits, {{0, false, 1}, {1, true, 1}}, 1e6), 0.1, 1e-9);
  EXPECT_GT(ProvenMiss_mm(SmallLattice(), limits, both->pushes, 10), 0.099);
  SlackRule tolerance;
  tolerance.group = {1, 0, 1, 1};
  tolerance.compliance = {1e-4, 1e-8, 0, 0};
  const auto by_tolerance = SolveLimited(system, limits, tolerance, {}, 1, nullptr);
  ASSERT_TRUE(by_tolerance.ok()) << by_tolerance.status();
  EXPECT_NEAR(by_tolerance->slack_mm[0], 0.2, 1e-4);
  EXPECT_LT(by_tolerance->slack_mm[1], 1e-4);
}

// No pushes of limits that can be kept prove anything.
TEST(LimitedLattice, NothingIsProvenOfWhatCanBe) {
  const LatticeSystem system = System();
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto limits = RandomLimits(3, 60);
  const auto solved = SolveLimited(system, limits, Firm(), {}, 1, nullptr);
  ASSERT_LT(solved->slack_mm[0], 1e-3);
  for (int draw = 0; draw < 200; ++draw) {
    std::vector<LimitPush> pushes;
    for (std::size_t i = 0; i < limits.size(); ++i)
      if (unit(random) < 0.1) pushes.push_back({i, unit(random) < 0.5, unit(random)});
    EXPECT_LE(ProvenMiss_mm(SmallLattice(), limits, pushes, 10), solved->slack_mm[0] + 1e-5);
  }
}

// Many places, about a wave that the lattice follows.
TEST(LimitedLattice, SameBitsOnAnyNumberOfThreads) {
  const LatticeSystem system = System();
  auto limits = RandomLimits(5, 6000);
  for (DisplacementLimit& limit : limits) {
    double height = 0;
    for (std::size_t k = 0; k < 4; ++k) height += (limit.at.cell[2] + static_cast<double>(k)) * limit.at.weights[2][k];
    limit.least_mm = 0.3 * std::sin(height) * limit.direction.x() - 0.03;
    limit.most_mm = limit.least_mm + 0.06;
  }
  const auto one = SolveLimited(system, limits, Firm(), {}, 1, nullptr);
  for (const int threads : {2, 5}) {
    const auto other = SolveLimited(system, limits, Firm(), {}, threads, nullptr);
    ASSERT_TRUE(other.ok()) << other.status();
    EXPECT_GT(one->pushes.size(), 20u);
    EXPECT_TRUE(one->controls_mm == other->controls_mm);
    EXPECT_EQ(one->pushes.size(), other->pushes.size());
  }
}

TEST(LimitedLattice, StopsWhenItsCallerIsGone) {
  EXPECT_EQ(SolveLimited(System(), RandomLimits(1, 20), Firm(), {}, 1, [] { return false; }).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace sixpoint::metrology

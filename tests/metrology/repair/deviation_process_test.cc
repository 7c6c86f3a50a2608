// What a process foresees of heights that are known, and by how much what it tells has to grow where it did not.
#include "metrology/repair/deviation_process.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sixpoint::metrology {
namespace {

constexpr int kHeights = 36, kSeries = 12;

std::vector<double> Heights() {
  std::vector<double> z_mm;
  for (int i = 0; i < kHeights; ++i) z_mm.push_back(10 + i);
  return z_mm;
}

// A bend of random size for each, and noise; and what else is added.
template <typename More>
Eigen::MatrixXd SeriesWith(const More& more) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, 1);
  Eigen::MatrixXd series(kHeights, kSeries);
  for (int s = 0; s < kSeries; ++s) {
    const double line = normal(random), bend = normal(random);
    for (int i = 0; i < kHeights; ++i) {
      const double part = static_cast<double>(i) / kHeights;
      series(i, s) = line * part + bend * part * part + 1e-3 * normal(random) + more(i);
    }
  }
  return series;
}

TEST(Foresight, BelievesWhatCameAsTold) {
  const Foresight foresight(Heights(), 55);
  EXPECT_LT(foresight.Growth(SeriesWith([](int) { return 0.0; })), 1.5);
  // Of nothing, nothing else came.
  EXPECT_EQ(foresight.Growth(Eigen::MatrixXd::Zero(kHeights, 1)), 1);
}

TEST(Foresight, GrowsByWhatCameUnforeseen) {
  const Foresight foresight(Heights(), 55);
  const auto grown = [&](double step) {
    return foresight.Growth(SeriesWith([&](int i) { return i < 28 ? 0 : step * (i - 27); }));
  };
  EXPECT_GT(grown(0.1), 3);
  EXPECT_GT(grown(0.2), 2 * grown(0.1)) << "as the square of what came";
  // A kink that lies below, in what both are told from, is known.
  EXPECT_LT(foresight.Growth(SeriesWith([](int i) { return i < 12 ? 0 : 0.1 * (i - 11); })), 3);
}

TEST(Foresight, LooksAsFarAheadAsIsAsked) {
  // A rise over the last five heights is all news to who tells one from the thirty below; less to who tells twenty from sixteen, of which it is
  // unsure anyway.
  const Eigen::MatrixXd series = SeriesWith([](int i) { return i < 31 ? 0 : 0.02 * (i - 30); });
  EXPECT_GT(Foresight(Heights(), 50).Growth(series), Foresight(Heights(), 90).Growth(series));
}

}  // namespace
}  // namespace sixpoint::metrology

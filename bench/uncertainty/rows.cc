#include "bench/uncertainty/rows.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <tuple>
#include <utility>

#include "bench/uncertainty/chain.h"
#include "bench/uncertainty/interim.h"
#include "metrology/calibration/rotation_calibration.h"
#include "metrology/inspection/hole_error.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/distributions.h"
#include "metrology/uncertainty/error_source.h"

namespace sixpoint::bench {
namespace {

Row RowOf(const std::string& name, const std::vector<HoleOutcome>& outcomes) {
  Row row;
  row.name = name;
  row.count = static_cast<int>(outcomes.size());
  std::vector<double> parts, errors, stated;
  int inside = 0;
  for (const HoleOutcome& one : outcomes) {
    inside += one.error_um <= one.expanded_uncertainty_um;
    parts.push_back(one.error_um / one.expanded_uncertainty_um);
    errors.push_back(one.error_um);
    stated.push_back(one.expanded_uncertainty_um);
  }
  const auto at = [](std::vector<double> values, double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
  };
  row.coverage_percent = 100.0 * inside / row.count;
  row.u_over_quantile = 1 / at(parts, 0.95);
  row.median_error_um = at(errors, 0.5);
  row.median_u_um = at(stated, 0.5);
  row.error_95_um = at(errors, 0.95);
  return row;
}

metrology::RotaryAxes TrueAxes() {
  metrology::RotaryAxes axes;  // they do meet: Point C's claim
  axes.a = {Eigen::Vector3d::UnitY(), {26.6, 54.9, -193.3}};
  axes.b = {Eigen::Vector3d::UnitX(), {26.6, 54.9, -193.3}};
  return axes;
}

std::vector<metrology::SpherePose> ProbedPoses(const metrology::RotaryAxes& axes, double noise_mm, int a_count,
                                               int b_count, std::mt19937_64* random) {
  std::normal_distribution<double> noise(0, noise_mm);
  std::vector<metrology::SpherePose> poses;
  const Eigen::Vector3d sphere(86, 60, -150);
  for (int i = 0; i < a_count; ++i)
    for (int k = 0; k < b_count; ++k) {
      metrology::SpherePose pose;
      pose.a_rad = kRadPerDeg * (-60 + 120.0 * i / (a_count - 1));
      pose.b_rad = kRadPerDeg * 360.0 * k / b_count;
      pose.centre_mm = axes.MachineFromZero(pose.a_rad, pose.b_rad) * sphere +
                       Eigen::Vector3d(noise(*random), noise(*random), noise(*random));
      poses.push_back(pose);
    }
  return poses;
}

}  // namespace

std::vector<Row> HoleRows(int draws) {
  WorldErrors noise, touch, own_field, field, arm, axes, all;
  noise.noise_mm = touch.noise_mm = own_field.noise_mm = field.noise_mm = arm.noise_mm = axes.noise_mm = 2e-3;
  touch.touch_offset_mm = 3e-3;
  own_field.field_mm = field.field_mm = 6e-3;
  own_field.field_is_harsh = false;
  arm.arm_mm = 3e-3;
  arm.arm_rad = 1e-4;
  axes.axes_mm = 2e-3;
  axes.axes_rad = 3e-5;
  all = arm;
  all.touch_offset_mm = 6e-4;
  all.field_mm = 2e-3;
  all.axes_mm = 6e-4;
  all.axes_rad = 1e-5;
  std::vector<std::pair<std::string, WorldErrors>> worlds = {{"noise alone", noise},
                                                             {"touch offset", touch},
                                                             {"scanner's field, as modelled", own_field},
                                                             {"scanner's field, waves", field},
                                                             {"arm, its spread known", arm},
                                                             {"axes", axes},
                                                             {"all together", all}};
  WorldErrors scales, square, tool, warm, cold, bounded, everything = all;
  scales.noise_mm = square.noise_mm = tool.noise_mm = warm.noise_mm = cold.noise_mm = bounded.noise_mm = 2e-3;
  scales.scale_ratio = 4e-5;
  square.squareness_ratio = 4e-5;
  tool.tool_offset_mm = 2e-3;
  warm.warmer_k = 5;
  cold.warmer_k = -5;
  warm.thermometer_k = cold.thermometer_k = 0.3;
  warm.coefficient_per_k = cold.coefficient_per_k = bounded.coefficient_per_k = everything.coefficient_per_k = 0.5e-6;
  bounded.half_range_k = 5;
  everything.scale_ratio = everything.squareness_ratio = 1e-5;
  everything.tool_offset_mm = 1e-3;
  everything.warmer_k = 3;
  everything.thermometer_k = 0.3;
  for (const auto& [name, errors] :
       {std::pair("linear axes' scales", scales), std::pair("linear axes' squareness", square),
        std::pair("touch probe to tool", tool), std::pair("5 K warmer, measured", warm),
        std::pair("5 K colder, measured", cold), std::pair("somewhere within 5 K", bounded),
        std::pair("all, and linear axes, tool, warmth", everything)})
    worlds.emplace_back(name, errors);
  for (const int scans : {5, 8, 15}) {
    WorldErrors learnt = arm;
    learnt.arm_scans = scans;
    worlds.emplace_back("arm, learnt from " + std::to_string(scans) + " scans", learnt);
  }
  for (const int freedom : {3, 7, 30, 100}) {
    WorldErrors few = axes;
    few.axes_freedom = freedom;
    worlds.emplace_back("axes, " + std::to_string(freedom) + " degrees of freedom", few);
  }
  WorldErrors learnt = all;
  learnt.arm_scans = 15;
  worlds.emplace_back("all together, arm learnt from 15", learnt);
  std::vector<Row> rows;
  for (std::size_t w = 0; w < worlds.size(); ++w) {
    std::vector<std::vector<HoleOutcome>> drawn(static_cast<std::size_t>(draws));
    metrology::ForEach(drawn.size(), 2,
                       [&](std::size_t i) { drawn[i] = DrawHoles(worlds[w].second, 1'000'003 * (w + 1) + i); });
    // One hole of each draw: those of one blade are off together.
    std::vector<HoleOutcome> outcomes;
    for (std::size_t i = 0; i < drawn.size(); ++i) outcomes.push_back(drawn[i][i % drawn[i].size()]);
    rows.push_back(RowOf(worlds[w].first, outcomes));
    rows.back().is_bounded = worlds[w].second.half_range_k > 0;
  }
  return rows;
}

std::vector<Row> PinRows(int draws) {
  std::vector<Row> rows;
  for (const double ratio : {1.0, 0.5})
    for (const double sigmas : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0}) {
      const double sigma_mm = 2e-3, tilt = 5e-4;
      metrology::NominalPin nominal;
      Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
      covariance.diagonal() << std::pow(sigma_mm, 2), std::pow(ratio * sigma_mm, 2), std::pow(tilt, 2),
          std::pow(ratio * tilt, 2), 1e-8;
      std::mt19937_64 random(static_cast<std::uint64_t>(100 * sigmas + 10 * ratio));
      std::normal_distribution<double> normal;
      metrology::PinFit truth;
      truth.across << Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY();
      truth.offset_mm = Eigen::Vector2d(0.6, 0.8) * sigmas * sigma_mm;
      truth.slope = Eigen::Vector2d(-0.8, 0.6) * sigmas * tilt;
      const metrology::HoleError exact = metrology::HoleErrorOf(nominal, truth, covariance);
      std::vector<HoleOutcome> position, inclination;
      for (int i = 0; i < draws; ++i) {
        metrology::PinFit seen = truth;
        seen.offset_mm += sigma_mm * Eigen::Vector2d(normal(random), ratio * normal(random));
        seen.slope += tilt * Eigen::Vector2d(normal(random), ratio * normal(random));
        const metrology::HoleError error = metrology::HoleErrorOf(nominal, seen, covariance);
        position.push_back({1e3 * std::abs(error.position_mm - exact.position_mm),
                            1e3 * error.position_coverage_factor * error.position_standard_uncertainty_mm});
        inclination.push_back({1e6 * std::abs(error.inclination_rad - exact.inclination_rad),
                               1e6 * error.inclination_coverage_factor * error.inclination_standard_uncertainty_rad});
      }
      char name[80];
      std::snprintf(name, sizeof name, "pin %.1f sigma off, %s: ", sigmas, ratio == 1 ? "round" : "flat");
      rows.push_back(RowOf(std::string(name) + "position", position));
      rows.push_back(RowOf(std::string(name) + "inclination", inclination));
    }
  return rows;
}

std::vector<Row> AxisRows(int draws) {
  std::vector<Row> rows;
  const metrology::RotaryAxes truth = TrueAxes();
  for (const auto& [a_count, b_count] : {std::pair(2, 3), std::pair(3, 3), std::pair(5, 6)}) {
    std::mt19937_64 random(static_cast<std::uint64_t>(17 * a_count + b_count));
    std::vector<HoleOutcome> outcomes;
    double freedom = 0;
    for (int i = 0; i < draws; ++i) {
      metrology::RotationOptions options;
      options.nominal = truth;
      const auto found = metrology::CalibrateRotation(ProbedPoses(truth, 1e-3, a_count, b_count, &random), options);
      if (!found.ok()) {
        std::fprintf(stderr, "bench/run uncertainty: %s\n", std::string(found.status().message()).c_str());
        std::exit(1);
      }
      freedom = found->degrees_of_freedom;
      // Where the B axis stands along Z.
      const Eigen::Vector3d off = found->axes.b.point_mm - truth.b.point_mm;
      const Eigen::Matrix<double, 3, 2> across = metrology::TangentBasis(found->axes.b.direction);
      const Eigen::RowVector2d along = Eigen::RowVector3d::UnitZ() * across;
      const double u_mm = std::sqrt((along * found->covariance.block<2, 2>(6, 6) * along.transpose()).value());
      outcomes.push_back({1e3 * std::abs(off.z()),
                          1e3 * metrology::StudentQuantile(0.975, 1e6) * u_mm * metrology::WideningOf(0.95, freedom)});
    }
    rows.push_back(RowOf("axes by " + std::to_string(a_count * b_count) + " spheres, " +
                             std::to_string(static_cast<int>(freedom)) + " degrees of freedom",
                         outcomes));
  }
  return rows;
}

std::vector<KnockRow> KnockRows(int draws) {
  constexpr double kKnock_mm = 0.02;
  WorldErrors still, swung, thesis;
  still.noise_mm = 2e-3;
  still.field_mm = 6e-3;
  still.arm_mm = 3e-3;
  still.arm_rad = 1e-4;
  still.arm_scans = 15;
  swung = thesis = still;
  swung.arm_mm = 2e-3;
  // As the thesis has its arm: the range of dx over what fifteen normal draws span.
  thesis.arm_mm = 3.5e-3;
  std::vector<KnockRow> rows;
  for (const auto& [name, errors, swings] :
       {std::tuple("arm not swung", still, Swings{1, 0}), std::tuple("arm of 2 um, swung twice", swung, Swings{1, 2}),
        std::tuple("arm of 3.5 um, calibrated over 2, swung 4", thesis, Swings{2, 4})}) {
    KnockRow row{name, draws, 0, 0, 0};
    const auto percent_accepted = [&, errors = errors, swings = swings](Knock knock, std::uint64_t seed) {
      std::vector<char> accepted(static_cast<std::size_t>(draws));
      metrology::ForEach(accepted.size(), 2,
                         [&](std::size_t i) { accepted[i] = Accepts(errors, knock, kKnock_mm, swings, seed + i); });
      return 100.0 * static_cast<double>(std::count(accepted.begin(), accepted.end(), 1)) / draws;
    };
    const std::uint64_t seed = 5'000'017 * (rows.size() + 1);
    row.found_percent = 100 - percent_accepted(Knock::kShift, seed);
    row.found_by_turn_percent = 100 - percent_accepted(Knock::kTurn, seed + 1'000'003);
    row.false_percent = 100 - percent_accepted(Knock::kNone, seed + 2'000'003);
    rows.push_back(row);
  }
  return rows;
}

double PointCVarianceRatio(int draws) {
  const metrology::RotaryAxes truth = TrueAxes();
  double stated = 0, seen = 0;
  std::mt19937_64 random(5);
  for (int i = 0; i < draws; ++i) {
    metrology::RotationOptions options;
    options.nominal = truth;
    const auto found = metrology::CalibratePointC(ProbedPoses(truth, 1e-3, 3, 4, &random), options);
    if (!found.ok()) {
      std::fprintf(stderr, "bench/run uncertainty: %s\n", std::string(found.status().message()).c_str());
      std::exit(1);
    }
    stated += found->point_c_covariance_mm2.trace();
    seen += (found->point_c_mm - truth.a.point_mm).squaredNorm();
  }
  return stated / seen;
}

}  // namespace sixpoint::bench

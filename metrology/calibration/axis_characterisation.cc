#include "metrology/calibration/axis_characterisation.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "metrology/frames/angles.h"
#include "metrology/linear_algebra/least_squares.h"
#include "metrology/statistics/ranks.h"
#include "metrology/statistics/standard_deviation.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr int kLongWaves = 3;
constexpr int kMostExtraHarmonics = 12;

// The way's share of the reversal error.
double Way(Travel travel) { return travel == Travel::kForward ? 0.5 : travel == Travel::kBackward ? -0.5 : 0; }

absl::Status CheckReadings(const std::vector<AxisReading>& run) {
  constexpr double kGreatestErrorRad = 1 * kRadPerDeg, kFarthestRad = 100 * kTurn_rad;
  constexpr size_t kMostAxisReadings = 200'000;
  if (run.size() > kMostAxisReadings) return Refuse("run", std::to_string(run.size()) + " readings", "at most 200000");
  for (size_t i = 0; i < run.size(); ++i) {
    const AxisReading& r = run[i];
    const std::string field = "run[" + std::to_string(i) + "]";
    if (!(std::abs(r.commanded_rad) <= kFarthestRad))
      return Refuse(field + ".commanded_deg", Rounded(r.commanded_rad / kRadPerDeg), "a number within 100 turns");
    if (!(std::abs(r.measured_rad - r.commanded_rad) <= kGreatestErrorRad))
      return Refuse(field + ".measured_deg", Rounded(r.measured_rad / kRadPerDeg),
                    "within 1 deg of the command, " + Rounded(r.commanded_rad / kRadPerDeg) + " deg");
    if (r.travel == Travel::kUnknown) return Refuse(field + ".travel", "unknown", "forward or backward");
  }
  return absl::OkStatus();
}

// Both ways over a turn without gaps. Gives the highest order that the steps resolve.
absl::StatusOr<int> HighestOrder(const std::vector<AxisReading>& run) {
  constexpr double kGreatestGap = 10 * kRadPerDeg, kRounding = 1e-9;
  constexpr size_t kFewest = 72;
  constexpr int kFinest = 2000;
  double coarsest = 0;
  for (const auto& [travel, name] : {std::pair{Travel::kForward, "forward"}, {Travel::kBackward, "backward"}}) {
    std::vector<double> angles;
    for (const AxisReading& r : run)
      if (r.travel == travel) angles.push_back(r.commanded_rad);
    std::sort(angles.begin(), angles.end());
    const double span = angles.empty() ? 0 : angles.back() - angles.front();
    if (span < kTurn_rad - kRounding)
      return absl::FailedPreconditionError(
          std::string("run: ") + name + " it covers " + Rounded(span / kRadPerDeg) +
          " deg, want a whole turn both ways (-10 to 370 deg and back); angles in deg");
    if (angles.size() < kFewest)
      return absl::FailedPreconditionError(std::string("run: ") + std::to_string(angles.size()) + " readings " + name +
                                           ", want at least " + std::to_string(kFewest) + " over the turn");
    std::vector<double> steps;
    for (size_t i = 1; i < angles.size(); ++i) {
      const double step = angles[i] - angles[i - 1];
      if (step > kGreatestGap)
        return absl::FailedPreconditionError(std::string("run: no reading ") + name + " between " +
                                             Rounded(angles[i - 1] / kRadPerDeg) + " and " +
                                             Rounded(angles[i] / kRadPerDeg) + " deg, want gaps of at most " +
                                             Rounded(kGreatestGap / kRadPerDeg) + " deg");
      // Readings at one place again tell nothing of the step.
      if (step > kRounding) steps.push_back(step);
    }
    coarsest = std::max(coarsest, UpperMedian(std::move(steps)));
  }
  // Below half the sampling rate.
  return std::min(kFinest, static_cast<int>(std::ceil(M_PI / coarsest * (1 - 1e-6))) - 1);
}

struct AxisTerms {
  std::vector<int> orders, reversal_orders;
  Eigen::Index count() const { return 2 + 2 * static_cast<Eigen::Index>(orders.size() + reversal_orders.size()); }
};

Eigen::VectorXd TermsAt(const AxisTerms& terms, double angle_rad, Travel travel) {
  Eigen::VectorXd row(terms.count());
  const double way = Way(travel);
  row(0) = 1;
  row(1) = way;
  Eigen::Index column = 2;
  for (const int order : terms.orders) {
    row(column++) = std::cos(order * angle_rad);
    row(column++) = std::sin(order * angle_rad);
  }
  for (const int order : terms.reversal_orders) {
    row(column++) = way * std::cos(order * angle_rad);
    row(column++) = way * std::sin(order * angle_rad);
  }
  return row;
}

struct Fit {
  Eigen::VectorXd values;
  Eigen::MatrixXd inverse;  // of the normal matrix
  Eigen::VectorXd residual;
  double noise_rad = 0;
  double freedom = 0;
};

Fit FitTerms(const std::vector<AxisReading>& run, const AxisTerms& terms) {
  const auto rows = static_cast<Eigen::Index>(run.size());
  Eigen::MatrixXd matrix(rows, terms.count());
  Eigen::VectorXd error(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const AxisReading& r = run[static_cast<size_t>(i)];
    matrix.row(i) = TermsAt(terms, r.commanded_rad, r.travel).transpose();
    error(i) = r.measured_rad - r.commanded_rad;
  }
  Fit fit;
  fit.values = LeastSquares(matrix, error);
  fit.residual = error - matrix * fit.values;
  fit.freedom = static_cast<double>(rows - terms.count());
  fit.noise_rad = std::sqrt(fit.residual.squaredNorm() / fit.freedom);
  const Eigen::MatrixXd inverse_r = InverseTriangle(matrix);
  fit.inverse = inverse_r * inverse_r.transpose();
  return fit;
}

struct Line {
  int order = 0;
  bool of_reversal = false;
  double power = 0;  // |sum|^2 / (sum of squared weights): chi-squared of 2, times the variance, where there is none
};

// The strongest order in what the fit left, of the mean of both ways or of their difference.
Line StrongestLine(const std::vector<AxisReading>& run, const Fit& fit, const AxisTerms& terms, int highest_order) {
  const auto count = static_cast<size_t>(highest_order) + 1;
  std::vector<std::complex<double>> sums(count), differences(count);
  for (size_t i = 0; i < run.size(); ++i) {
    const double residual = fit.residual(static_cast<Eigen::Index>(i));
    const double sign = run[i].travel == Travel::kForward ? 1 : -1;
    const std::complex<double> turn = std::polar(1.0, run[i].commanded_rad);
    std::complex<double> at = residual;
    for (size_t order = 0; order < count; ++order, at *= turn) {
      sums[order] += at;
      differences[order] += sign * at;
    }
  }
  Line strongest;
  const auto known = [](const std::vector<int>& orders, size_t order) {
    return std::find(orders.begin(), orders.end(), static_cast<int>(order)) != orders.end();
  };
  for (size_t order = 1; order < count; ++order) {
    const double scale = 2 / static_cast<double>(run.size());
    const double sum = scale * std::norm(sums[order]), difference = scale * std::norm(differences[order]);
    if (sum > strongest.power && !known(terms.orders, order)) strongest = {static_cast<int>(order), false, sum};
    if (difference > strongest.power && !known(terms.reversal_orders, order))
      strongest = {static_cast<int>(order), true, difference};
  }
  return strongest;
}

// Power that noise alone exceeds at any of the orders once in a thousand runs: n exp(-power / (2 s^2)) = 1e-3.
double PowerThreshold(double noise_rad, int highest_order) {
  return 2 * noise_rad * noise_rad * std::log(1e3 * 2 * highest_order);
}

PeriodicError PeriodicOf(const Harmonic& h, Eigen::Index column, const Eigen::MatrixXd& covariance) {
  const Eigen::Vector2d value(h.cosine_rad, h.sine_rad);
  const double amplitude = value.norm();
  const Eigen::Vector2d along = amplitude > 0 ? Eigen::Vector2d(value / amplitude) : Eigen::Vector2d::UnitX();
  return {h.order, {amplitude, std::sqrt(along.dot(covariance.block<2, 2>(column, column) * along))}};
}

// Standard uncertainty of f(values), by its differences.
template <typename Function>
double Propagated(const Function& f, const Eigen::VectorXd& values, const Eigen::MatrixXd& covariance) {
  Eigen::VectorXd gradient(values.size());
  const double step = 1e-4 * std::max(values.norm(), 1e-12);
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    const Eigen::VectorXd w = step * Eigen::VectorXd::Unit(values.size(), k);
    gradient(k) = (f(values + w) - f(values - w)) / (2 * step);
  }
  return StandardDeviation(gradient.dot(covariance * gradient));
}

// Root mean square of the modelled error over the turn and both ways: harmonics are orthogonal there.
double ModelRms(const Eigen::VectorXd& values, const AxisTerms& terms) {
  const auto plain = 2 * static_cast<Eigen::Index>(terms.orders.size());
  return std::sqrt(values(0) * values(0) + values(1) * values(1) / 4 + values.segment(2, plain).squaredNorm() / 2 +
                   values.tail(values.size() - 2 - plain).squaredNorm() / 8);
}

void MakeTable(const AxisTerms& terms, const Fit& fit, AxisCharacterisation* result) {
  int shortest = kLongWaves;
  for (const int order : terms.orders) shortest = std::max(shortest, order);
  for (const int order : terms.reversal_orders) shortest = std::max(shortest, order);
  // 32 values a period: linear interpolation misses (2 pi / 32)^2 / 8 = 0.5 % of its amplitude.
  constexpr int kValuesAPeriod = 32, kFewest = 360;
  const int count = std::max(kFewest, kValuesAPeriod * shortest);
  double variance = 0;
  for (const Travel travel : {Travel::kForward, Travel::kBackward})
    for (int i = 0; i < count; ++i) {
      const double angle = kTurn_rad * i / count;
      const Eigen::VectorXd row = TermsAt(terms, angle, travel);
      const double error = row.dot(fit.values);
      (travel == Travel::kForward ? result->table.forward_rad : result->table.backward_rad).push_back(error);
      const double own = row.dot(result->covariance_rad2 * row);
      variance += own / (2 * count);
      if (std::abs(error) <= result->greatest_error_rad.value) continue;
      result->greatest_error_rad = {std::abs(error), std::sqrt(own)};
      result->greatest_error_at_rad = angle;
      result->greatest_error_travel = travel;
    }
  result->table_standard_uncertainty_rad = std::sqrt(variance);
}

}  // namespace

absl::StatusOr<std::vector<Travel>> TravelOf(const std::vector<double>& commanded_rad) {
  std::vector<Travel> travel(commanded_rad.size(), Travel::kUnknown);
  for (size_t i = 1; i < travel.size(); ++i) {
    const double step = commanded_rad[i] - commanded_rad[i - 1];
    if (step != 0) travel[i] = step > 0 ? Travel::kForward : Travel::kBackward;
  }
  // The first reading, and one where the axis turned round and is read again, go with the readings after them.
  for (size_t i = travel.size(); i-- > 1;)
    if (travel[i - 1] == Travel::kUnknown) travel[i - 1] = travel[i];
  for (size_t i = 1; i < travel.size(); ++i)
    if (travel[i] == Travel::kUnknown) travel[i] = travel[i - 1];
  if (travel.empty() || travel.front() == Travel::kUnknown)
    return Refuse("run.commanded_deg", "it never changes", "a turn and back");
  return travel;
}

absl::StatusOr<AxisCharacterisation> CharacteriseAxis(const std::vector<AxisReading>& run) {
  if (absl::Status s = CheckReadings(run); !s.ok()) return s;
  const absl::StatusOr<int> highest_order = HighestOrder(run);
  if (!highest_order.ok()) return highest_order.status();
  AxisTerms terms;
  for (int order = 1; order <= kLongWaves; ++order) terms.orders.push_back(order);
  Fit fit = FitTerms(run, terms);
  for (int extra = 0; extra < kMostExtraHarmonics; ++extra) {
    const Line line = StrongestLine(run, fit, terms, *highest_order);
    if (line.order == 0 || line.power <= PowerThreshold(fit.noise_rad, *highest_order)) break;
    // What is left of numbers written with a few decimals is no property of the axis.
    constexpr double kLeastAmplitudeRad = 1e-6 * kRadPerDeg;
    if (std::sqrt(2 * line.power / static_cast<double>(run.size())) < kLeastAmplitudeRad) break;
    (line.of_reversal ? terms.reversal_orders : terms.orders).push_back(line.order);
    fit = FitTerms(run, terms);
  }

  AxisCharacterisation result;
  result.reading_count = static_cast<int>(run.size());
  result.noise_rad = {fit.noise_rad, fit.noise_rad / std::sqrt(2 * fit.freedom)};
  result.covariance_rad2 = fit.noise_rad * fit.noise_rad * fit.inverse;
  const auto sigma = [&](Eigen::Index k) { return std::sqrt(result.covariance_rad2(k, k)); };
  result.mean_rad = {fit.values(0), sigma(0)};
  result.reversal_rad = {fit.values(1), sigma(1)};
  Eigen::Index column = 2;
  for (const int order : terms.orders) {
    const Harmonic& h = result.harmonics.emplace_back(Harmonic{order, fit.values(column), fit.values(column + 1)});
    const PeriodicError error = PeriodicOf(h, column, result.covariance_rad2);
    if (order <= kLongWaves) {
      if (error.amplitude_rad.value > result.long_wave.amplitude_rad.value || result.long_wave.order == 0)
        result.long_wave = error;
    } else if (!result.periodic || error.amplitude_rad.value > result.periodic->amplitude_rad.value) {
      result.periodic = error;
    }
    column += 2;
  }
  for (const int order : terms.reversal_orders) {
    result.reversal_harmonics.push_back({order, fit.values(column), fit.values(column + 1)});
    column += 2;
  }
  result.least_detectable_rad =
      std::sqrt(2 * PowerThreshold(fit.noise_rad, *highest_order) / static_cast<double>(run.size()));
  MakeTable(terms, fit, &result);

  const double rms = ModelRms(fit.values, terms), noise = fit.noise_rad;
  const double model =
      Propagated([&](const Eigen::VectorXd& v) { return ModelRms(v, terms); }, fit.values, result.covariance_rad2);
  const double whole = std::hypot(rms, noise);
  result.standard_uncertainty_rad = {
      whole, whole > 0 ? std::hypot(rms * model, noise * result.noise_rad.standard_uncertainty) / whole : 0};
  result.compensated_standard_uncertainty_rad = {std::hypot(noise, result.table_standard_uncertainty_rad),
                                                 result.noise_rad.standard_uncertainty};
  return result;
}

}  // namespace sixpoint::metrology

#include "metrology/repair/extrapolation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "metrology/linear_algebra/least_squares.h"
#include "metrology/parallel/loops.h"
#include "metrology/repair/deviation_process.h"
#include "metrology/repair/height_polynomial.h"
#include "metrology/repair/section_deviation.h"
#include "metrology/sections/profile.h"
#include "metrology/statistics/legendre.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr int kShapes = 10;  // along the section, beside its mean: Legendre's polynomials up to this order
constexpr double kSameHeight_mm = 1e-6;
constexpr double kFinest_mm = 0.1;  // no outline is measured finer: over so much of it what is left over is averaged
constexpr int kAlongDegree = 3, kHeightDegree = 5, kLeadingDegree = 2, kTrailingDegree = 1;

std::vector<double> HeightsOf(const std::vector<BladeSection>& sections) {
  std::vector<double> z_mm;
  for (const BladeSection& section : sections) z_mm.push_back(section.z_mm);
  return z_mm;
}

// All were measured alike.
double HalfWidthOf(const std::vector<BladeSection>& measured) {
  return measured.empty() ? 0 : measured.back().half_width_mm;
}

absl::Status Check(const std::vector<BladeSection>& measured, const std::vector<BladeSection>& asked) {
  if (asked.empty()) return Refuse("asked", "no sections", "at least one");
  for (std::size_t k = 1; k < measured.size(); ++k)
    if (!(measured[k].z_mm > measured[k - 1].z_mm))
      return Refuse("measured[" + std::to_string(k) + "].z_mm", measured[k].z_mm, "above the section before");
  return CheckEnough(HeightsOf(measured), HalfWidthOf(measured), asked.back().z_mm, "measured", {});
}

// The nominal section of each measured one.
absl::StatusOr<std::vector<BladeSection>> Beside(const std::vector<BladeSection>& measured,
                                                 const std::vector<BladeSection>& nominal) {
  std::vector<BladeSection> beside;
  std::size_t n = 0;
  for (std::size_t k = 0; k < measured.size(); ++k) {
    while (n < nominal.size() && nominal[n].z_mm < measured[k].z_mm - kSameHeight_mm) ++n;
    if (n == nominal.size() || nominal[n].z_mm > measured[k].z_mm + kSameHeight_mm)
      return Refuse("measured[" + std::to_string(k) + "].z_mm", measured[k].z_mm, "the height of a nominal section");
    beside.push_back(nominal[n]);
  }
  return beside;
}

// Of all sections' camber lines: what they turn about.
Vector2d MiddleOf(const std::vector<BladeSection>& sections) {
  Vector2d sum = Vector2d::Zero();
  double count = 0;
  for (const BladeSection& section : sections)
    for (const CamberStation& station : section.profile.stations) sum += station.centre_mm, ++count;
  return sum / count;
}

// The published regression, in a frame whose y is the mean direction from leading to trailing tip.
Extrapolation ByPolynomial(const std::vector<BladeSection>& measured, const std::vector<BladeSection>& asked) {
  Vector2d chord = Vector2d::Zero();
  for (const BladeSection& section : measured)
    chord += (section.profile.trailing.tip_mm - section.profile.leading.tip_mm).normalized();
  chord.normalize();
  const Vector2d across = LeftOf(chord);
  std::vector<PolynomialPlace> places, end_places;
  std::vector<double> camber, radius, leading, trailing;
  for (const BladeSection& section : measured) {
    for (const CamberStation& station : section.profile.stations) {
      places.push_back({chord.dot(station.centre_mm), section.z_mm});
      camber.push_back(across.dot(station.centre_mm));
      radius.push_back(station.radius_mm);
    }
    end_places.push_back({0, section.z_mm});
    leading.push_back(chord.dot(section.profile.leading.tip_mm));
    trailing.push_back(chord.dot(section.profile.trailing.tip_mm));
  }
  const HeightPolynomial camber_of(places, camber, kAlongDegree, kHeightDegree);
  const HeightPolynomial radius_of(places, radius, kAlongDegree, kHeightDegree);
  const HeightPolynomial leading_of(end_places, leading, 0, kLeadingDegree);
  const HeightPolynomial trailing_of(end_places, trailing, 0, kTrailingDegree);
  Extrapolation made;
  made.determination = {camber_of.r_squared(), radius_of.r_squared(), leading_of.r_squared(), trailing_of.r_squared()};
  for (const BladeSection& section : asked) {
    const double z = section.z_mm;
    const PolynomialValue lead = leading_of.At({0, z}), trail = trailing_of.At({0, z});
    // The line is trimmed where its circles reach the ends.
    const auto radius_at = [&](double y) { return std::max(1e-3, radius_of.At({y, z}).value); };
    double from = lead.value, to = trail.value;
    for (int turn = 0; turn < 20; ++turn) from = lead.value + radius_at(from), to = trail.value - radius_at(to);
    std::vector<TargetCircle> circles;
    for (const double place : ChebyshevPlaces(kCamberStations)) {
      const double y = from + place * (to - from);
      const PolynomialValue x = camber_of.At({y, z}), r = radius_of.At({y, z});
      circles.push_back({x.value * across + y * chord, std::max(1e-3, r.value), x.standard, r.standard});
    }
    made.sections.push_back(EnvelopeWithArcs(circles, z, lead.standard, trail.standard));
  }
  return made;
}

// The nominal circles and ends moved by what is predicted of them.
TargetSection InPlace(const BladeSection& nominal, const std::vector<ProcessValue>& camber,
                      const std::vector<ProcessValue>& radius, const ProcessValue& leading,
                      const ProcessValue& trailing) {
  std::vector<TargetCircle> circles;
  for (std::size_t j = 0; j < nominal.profile.stations.size(); ++j) {
    const CamberStation& station = nominal.profile.stations[j];
    circles.push_back({station.centre_mm + camber[j].mean * LeftOf(station.along),
                       std::max(1e-3, station.radius_mm + radius[j].mean), std::sqrt(camber[j].variance),
                       std::sqrt(radius[j].variance)});
  }
  return EnvelopeWithEnds(circles, nominal, {leading.mean, std::sqrt(leading.variance)},
                          {trailing.mean, std::sqrt(trailing.variance)});
}

TargetSection MovedByPrediction(const TargetSection& section, const ProcessValue& turn, const ProcessValue& shift_x,
                                const ProcessValue& shift_y, const Vector2d& pivot_mm) {
  return MovedWhole(section, {turn.mean, {shift_x.mean, shift_y.mean}},
                    {std::sqrt(turn.variance), {std::sqrt(shift_x.variance), std::sqrt(shift_y.variance)}}, pivot_mm);
}

// Of the sections that lie beside their nominal ones; those are kept with them, the others left out.
struct Compared {
  std::vector<SectionDeviation> deviations;
  std::vector<BladeSection> nominal;
  std::vector<LeftOutSection> left_out;
};
Compared DeviationsOf(const std::vector<BladeSection>& measured, std::vector<BladeSection> nominal,
                      const Vector2d& pivot_mm, int thread_count) {
  std::vector<absl::StatusOr<SectionDeviation>> found(measured.size(), absl::InternalError("not compared"));
  ForEach(measured.size(), thread_count,
          [&](std::size_t k) { found[k] = DeviationOf(nominal[k], measured[k], pivot_mm); });
  Compared compared;
  for (std::size_t k = 0; k < measured.size(); ++k)
    if (found[k].ok()) {
      compared.deviations.push_back(*std::move(found[k]));
      compared.nominal.push_back(std::move(nominal[k]));
    } else {
      compared.left_out.push_back({k, measured[k].z_mm, found[k].status()});
    }
  return compared;
}

Extrapolation ByDeviationPolynomial(const std::vector<SectionDeviation>& deviations, const std::vector<double>& z_mm,
                                    const std::vector<BladeSection>& asked, const Vector2d& pivot_mm) {
  const std::vector<double> parts = ChebyshevPlaces(kCamberStations);
  std::vector<PolynomialPlace> places, end_places;
  std::vector<double> camber, radius, leading, trailing, turn, x, y;
  for (std::size_t k = 0; k < deviations.size(); ++k) {
    for (std::size_t j = 0; j < parts.size(); ++j) {
      places.push_back({parts[j], z_mm[k]});
      camber.push_back(deviations[k].camber_mm[static_cast<Eigen::Index>(j)]);
      radius.push_back(deviations[k].radius_mm[static_cast<Eigen::Index>(j)]);
    }
    end_places.push_back({0, z_mm[k]});
    turn.push_back(deviations[k].moved.turn_rad);
    x.push_back(deviations[k].moved.shift_mm.x());
    y.push_back(deviations[k].moved.shift_mm.y());
    leading.push_back(deviations[k].leading_mm);
    trailing.push_back(deviations[k].trailing_mm);
  }
  const HeightPolynomial camber_of(places, camber, kAlongDegree, kHeightDegree);
  const HeightPolynomial radius_of(places, radius, kAlongDegree, kHeightDegree);
  const HeightPolynomial leading_of(end_places, leading, 0, kLeadingDegree);
  const HeightPolynomial trailing_of(end_places, trailing, 0, kTrailingDegree);
  const HeightPolynomial turn_of(end_places, turn, 0, kHeightDegree), x_of(end_places, x, 0, kHeightDegree);
  const HeightPolynomial y_of(end_places, y, 0, kHeightDegree);
  const auto value = [](const HeightPolynomial& of, double along, double z) {
    const PolynomialValue at = of.At({along, z});
    return ProcessValue{at.value, at.standard * at.standard};
  };
  Extrapolation made;
  made.determination = {camber_of.r_squared(), radius_of.r_squared(), leading_of.r_squared(), trailing_of.r_squared()};
  for (const BladeSection& section : asked) {
    const double z = section.z_mm;
    std::vector<ProcessValue> camber_at, radius_at;
    for (const double part : parts) {
      camber_at.push_back(value(camber_of, part, z));
      radius_at.push_back(value(radius_of, part, z));
    }
    made.sections.push_back(
        MovedByPrediction(InPlace(section, camber_at, radius_at, value(leading_of, 0, z), value(trailing_of, 0, z)),
                          value(turn_of, 0, z), value(x_of, 0, z), value(y_of, 0, z), pivot_mm));
  }
  return made;
}

void Grow(double growth, std::vector<std::vector<ProcessValue>>* values) {
  for (std::vector<ProcessValue>& some : *values)
    for (ProcessValue& value : some) value.variance *= growth;
}

// A field over stations, by smooth shapes along the section: an amplitude of each for each height.
struct ShapedField {
  Eigen::MatrixXd shapes;      // stations x shapes
  Eigen::MatrixXd amplitudes;  // heights x shapes

  // values: heights x stations.
  ShapedField(const Eigen::MatrixXd& values, const std::vector<double>& z_mm) {
    const std::vector<double> parts = ChebyshevPlaces(kCamberStations);
    shapes.resize(static_cast<Eigen::Index>(parts.size()), kShapes + 1);
    for (Eigen::Index j = 0; j < shapes.rows(); ++j) {
      const auto row = Legendre<kShapes>(2 * parts[static_cast<std::size_t>(j)] - 1);
      for (Eigen::Index k = 0; k < shapes.cols(); ++k) shapes(j, k) = row[static_cast<std::size_t>(k)];
    }
    amplitudes.resize(values.rows(), shapes.cols());
    for (Eigen::Index h = 0; h < values.rows(); ++h)
      amplitudes.row(h) = LeastSquares(shapes, values.row(h).transpose()).transpose();
    for (Eigen::Index k = 0; k < shapes.cols(); ++k) amplitudes.col(k) = WithoutWild(z_mm, amplitudes.col(k));
  }

  // At a known height: without uncertainty.
  std::vector<ProcessValue> Known(Eigen::Index height) const {
    const Eigen::VectorXd values = shapes * amplitudes.row(height).transpose();
    std::vector<ProcessValue> known;
    for (const double value : values) known.push_back({value, 0});
    return known;
  }

  std::vector<std::vector<ProcessValue>> Predict(const HeightProcess& process, std::size_t asked_count) const {
    std::vector<std::vector<ProcessValue>> field(asked_count,
                                                 std::vector<ProcessValue>(static_cast<std::size_t>(shapes.rows())));
    for (Eigen::Index k = 0; k < shapes.cols(); ++k) {
      const std::vector<ProcessValue> amplitude = process.Predict(amplitudes.col(k));
      for (std::size_t a = 0; a < asked_count; ++a)
        for (Eigen::Index j = 0; j < shapes.rows(); ++j) {
          ProcessValue& value = field[a][static_cast<std::size_t>(j)];
          value.mean += shapes(j, k) * amplitude[a].mean;
          value.variance += shapes(j, k) * shapes(j, k) * amplitude[a].variance;
        }
    }
    return field;
  }
};

// What circles, shapes and ends do not hold of the outlines below: of each node a process of its own. Its scatter from one section to the next is
// those sections' noise, and no uncertainty of a target that holds none of it.
struct LeftOver {
  std::vector<std::vector<ProcessValue>> at_node;  // nodes x heights asked

  LeftOver(const std::vector<TargetSection>& made, const std::vector<SectionDeviation>& deviations,
           const std::vector<double>& z_mm, const HeightProcess& process, const Foresight& foresight, int thread_count)
      : at_node(made[0].outline.size()) {
    Eigen::MatrixXd off_mm(static_cast<Eigen::Index>(made.size()), static_cast<Eigen::Index>(at_node.size()));
    ForEach(at_node.size(), thread_count, [&](std::size_t i) {
      auto off_of = off_mm.col(static_cast<Eigen::Index>(i));
      for (std::size_t k = 0; k < made.size(); ++k)
        off_of[static_cast<Eigen::Index>(k)] =
            -SignedDistance(deviations[k].in_place, made[k].outline.nodes()[i].point_mm, nullptr);
      off_of = WithoutWild(z_mm, off_of);
      at_node[i] = process.Predict(off_of);
    });
    // Neighbours say the same.
    constexpr Eigen::Index kApart = 40;
    Eigen::MatrixXd some(off_mm.rows(), (off_mm.cols() + kApart - 1) / kApart);
    for (Eigen::Index c = 0; c < some.cols(); ++c) some.col(c) = off_mm.col(c * kApart);
    Grow(foresight.Growth(some), &at_node);
  }

  TargetSection AddedTo(TargetSection section, std::size_t asked) const {
    const Outline& outline = section.outline;
    const std::size_t count = outline.size();
    std::vector<double> mean_mm(count), slopes;
    for (std::size_t i = 0; i < count; ++i) {
      double means = 0, variances = 0, all = 0;
      for (std::size_t k = 0; k < count; ++k) {
        const double way_mm = std::remainder(outline.nodes()[k].at_mm - outline.nodes()[i].at_mm, outline.length_mm());
        if (std::abs(way_mm) > 4 * kFinest_mm && k != i) continue;
        const double stands_mm =
            (outline.nodes()[outline.Next(k)].point_mm - outline.nodes()[outline.Previous(k)].point_mm).norm();
        const double weight = std::max(1e-9, stands_mm) * std::exp(-std::pow(way_mm / kFinest_mm, 2) / 2);
        means += weight * at_node[k][asked].mean;
        variances += weight * at_node[k][asked].variance;
        all += weight;
      }
      mean_mm[i] = means / all;
      section.standard_mm[i] = std::sqrt(std::pow(section.standard_mm[i], 2) + variances / all);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t before = outline.Previous(i), next = outline.Next(i);
      const double length_mm = (outline.nodes()[next].point_mm - outline.nodes()[before].point_mm).norm();
      slopes.push_back((mean_mm[next] - mean_mm[before]) / std::max(1e-6, length_mm));
    }
    section.outline = outline.Offset(mean_mm, slopes);
    return section;
  }
};

Extrapolation ByProcess(const std::vector<SectionDeviation>& deviations, const std::vector<BladeSection>& nominal,
                        const std::vector<BladeSection>& asked, const Vector2d& pivot_mm, int thread_count) {
  const auto count = static_cast<Eigen::Index>(deviations.size());
  Eigen::MatrixXd camber(count, kCamberStations), radius(count, kCamberStations), whole(count, 5);
  for (Eigen::Index k = 0; k < count; ++k) {
    const SectionDeviation& deviation = deviations[static_cast<std::size_t>(k)];
    whole.row(k) << deviation.moved.turn_rad, deviation.moved.shift_mm.x(), deviation.moved.shift_mm.y(),
        deviation.leading_mm, deviation.trailing_mm;
    camber.row(k) = deviation.camber_mm.transpose();
    radius.row(k) = deviation.radius_mm.transpose();
  }
  const std::vector<double> z_mm = HeightsOf(nominal);
  const HeightProcess process(z_mm, HeightsOf(asked));
  const Foresight foresight(z_mm, asked.back().z_mm);
  const ShapedField camber_field(camber, z_mm), radius_field(radius, z_mm);
  std::vector<std::vector<ProcessValue>> whole_at;
  for (Eigen::Index c = 0; c < whole.cols(); ++c) {
    whole.col(c) = WithoutWild(z_mm, whole.col(c));
    whole_at.push_back(process.Predict(whole.col(c)));
  }
  Grow(foresight.Growth(whole), &whole_at);
  std::vector<TargetSection> below;
  for (Eigen::Index k = 0; k < count; ++k)
    below.push_back(InPlace(nominal[static_cast<std::size_t>(k)], camber_field.Known(k), radius_field.Known(k),
                            {whole(k, 3), 0}, {whole(k, 4), 0}));
  const LeftOver left(below, deviations, z_mm, process, foresight, thread_count);
  auto camber_at = camber_field.Predict(process, asked.size()), radius_at = radius_field.Predict(process, asked.size());
  Grow(foresight.Growth(camber_field.amplitudes), &camber_at);
  Grow(foresight.Growth(radius_field.amplitudes), &radius_at);
  Extrapolation made;
  for (std::size_t a = 0; a < asked.size(); ++a) {
    const TargetSection in_place = InPlace(asked[a], camber_at[a], radius_at[a], whole_at[3][a], whole_at[4][a]);
    made.sections.push_back(
        MovedByPrediction(left.AddedTo(in_place, a), whole_at[0][a], whole_at[1][a], whole_at[2][a], pivot_mm));
  }
  return made;
}

}  // namespace

absl::StatusOr<Extrapolation> Extrapolate(const std::vector<BladeSection>& measured,
                                          const std::vector<BladeSection>& nominal,
                                          const std::vector<BladeSection>& asked, ExtrapolationMethod method,
                                          int thread_count) {
  if (const absl::Status status = Check(measured, asked); !status.ok()) return status;
  if (method == ExtrapolationMethod::kPolynomial) return ByPolynomial(measured, asked);
  auto beside = Beside(measured, nominal);
  if (!beside.ok()) return beside.status();
  const Vector2d pivot_mm = MiddleOf(nominal);  // whatever is left out
  Compared compared = DeviationsOf(measured, *std::move(beside), pivot_mm, thread_count);
  const std::vector<double> z_mm = HeightsOf(compared.nominal);
  const absl::Status enough =
      CheckEnough(z_mm, HalfWidthOf(measured), asked.back().z_mm, "measured", compared.left_out);
  if (!enough.ok()) return enough;
  Extrapolation made = method == ExtrapolationMethod::kProcessOfDeviation
                           ? ByProcess(compared.deviations, compared.nominal, asked, pivot_mm, thread_count)
                           : ByDeviationPolynomial(compared.deviations, z_mm, asked, pivot_mm);
  made.left_out = std::move(compared.left_out);
  return made;
}

}  // namespace sixpoint::metrology

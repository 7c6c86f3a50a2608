#include "metrology/sections/outline_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "metrology/sections/corners.h"
#include "metrology/statistics/ranks.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr double kMostMeans = 4000;
constexpr double kWidestPart = 0.013;  // of the outline's length: a window's half width at most
constexpr double kSpread = 0.5;        // windows widen so fast along the outline

// A stretch without corner or gap; [from, to] of at_mm. `around`: the whole closed outline.
struct Stretch {
  double from_mm = 0, to_mm = 0;
  bool around = false;
  Join before = Join::kSmooth;
};

class Fitter {
 public:
  Fitter(const PointChain& chain, const std::vector<FitPoint>& points, const OutlineFitOptions& options)
      : chain_(chain), options_(options), points_(points) {}

  absl::StatusOr<FittedOutline> Run() {
    const double clear_mm = options_.exact ? 0.02 * chain_.spacing_mm : 0.5 * chain_.spacing_mm;
    // Of a side's few points robust weights would choose among; what is far off is out already.
    const LocalFit plain(points_, chain_.length_mm, options_.lean_known, false);
    if (!options_.without_corners)
      corners_ = CornersOf(chain_, points_, plain,
                           {options_.noise_mm, options_.exact ? clear_mm : chain_.spacing_mm, options_.exact});
    points_.erase(std::remove_if(points_.begin(), points_.end(),
                                 [&](const FitPoint& point) { return NearCorner(point.at_mm, clear_mm); }),
                  points_.end());
    FindStretches();
    FindWidths();
    const LocalFit fit(points_, chain_.length_mm, options_.lean_known, !options_.exact);
    std::vector<OutlineNode> nodes;
    std::vector<double> variances;
    for (const Stretch& stretch : stretches_) AddNodes(stretch, fit, &nodes, &variances);
    if (nodes.size() < 20)
      return Refuse("points", std::to_string(nodes.size()) + " places of an outline", "at least 20");
    MeetAtCorners(&nodes);
    fitted_.outline = Outline(std::move(nodes));
    fitted_.found_sigma_mm = std::sqrt(Median(std::move(variances)));
    fitted_.sample_sigma_mm = options_.exact ? 0 : std::max(options_.noise_mm, fitted_.found_sigma_mm);
    for (const FitPoint& point : points_) {
      fitted_.mean_sigma_mm.push_back(fitted_.sample_sigma_mm / std::sqrt(point.count));
      fitted_.used_count += static_cast<std::int64_t>(point.count);
    }
    return std::move(fitted_);
  }

 private:
  bool NearCorner(double at_mm, double clear_mm) const {
    return std::any_of(corners_.begin(), corners_.end(), [&](const OutlineCorner& corner) {
      return std::abs(std::remainder(at_mm - corner.at_mm, chain_.length_mm)) <= clear_mm;
    });
  }

  void FindStretches() {
    struct Break {
      double end_mm, begin_mm;
      Join join;
    };
    std::vector<Break> breaks;
    const std::size_t n = chain_.points_mm.size();
    for (std::size_t i = 0; i < n; ++i)
      if (chain_.gap_before[i]) breaks.push_back({chain_.at_mm[(i + n - 1) % n], chain_.at_mm[i], Join::kGap});
    // Of a corner in a gap nothing was seen: the gap stands for it.
    const auto ahead = [&](double from_mm, double to_mm) {
      return to_mm - from_mm - chain_.length_mm * std::floor((to_mm - from_mm) / chain_.length_mm);
    };
    const std::size_t gaps = breaks.size();
    for (const OutlineCorner& corner : corners_)
      if (std::none_of(breaks.begin(), breaks.begin() + static_cast<std::ptrdiff_t>(gaps), [&](const Break& gap) {
            return ahead(gap.end_mm, corner.at_mm) <= ahead(gap.end_mm, gap.begin_mm);
          }))
        breaks.push_back({corner.at_mm, corner.at_mm, Join::kCorner});
    std::sort(breaks.begin(), breaks.end(), [](const Break& a, const Break& b) { return a.begin_mm < b.begin_mm; });
    if (breaks.empty()) stretches_.push_back({0, chain_.length_mm, true, Join::kSmooth});
    for (std::size_t k = 0; k < breaks.size(); ++k) {
      const Break& next = breaks[(k + 1) % breaks.size()];
      double to = next.end_mm;
      if (to <= breaks[k].begin_mm) to += chain_.length_mm;
      stretches_.push_back({breaks[k].begin_mm, to, false, breaks[k].join});
    }
  }

  FitWindow WindowIn(const Stretch& stretch, double at_mm, double half_mm) const {
    FitWindow window{at_mm, half_mm, half_mm, 4};
    if (stretch.around) return window;
    window.below_mm = std::min(half_mm, at_mm - stretch.from_mm);
    window.above_mm = std::min(half_mm, stretch.to_mm - at_mm);
    // At an end a high degree would swing.
    if (std::min(window.below_mm, window.above_mm) < 0.5 * half_mm) window.degree = 2;
    constexpr double kBeyond = 1e-9;  // the last point itself
    window.below_mm += kBeyond;
    window.above_mm += kBeyond;
    return window;
  }

  std::pair<Vector2d, Vector2d> StartAt(double at_mm) const {
    at_mm -= chain_.length_mm * std::floor(at_mm / chain_.length_mm);
    const auto after = std::upper_bound(chain_.at_mm.begin(), chain_.at_mm.end(), at_mm);
    const std::size_t i = static_cast<std::size_t>(after - chain_.at_mm.begin()) - 1, n = chain_.points_mm.size();
    Vector2d along = chain_.points_mm[(i + 1) % n] - chain_.points_mm[i];
    const double x = (at_mm - chain_.at_mm[i]) / along.norm();
    return {chain_.points_mm[i] + x * along, along};
  }

  // Where points are sparse a window is as wide as some of them need.
  double LeastWidth(const LocalFit& fit, const Stretch& stretch, double at_mm, double narrowest) const {
    const std::size_t wanted = options_.exact ? 6 : 14;
    double width = narrowest;
    const double most = (stretch.to_mm - stretch.from_mm) / 4;
    while (width < most && fit.WindowOf(WindowIn(stretch, at_mm, width)).count < wanted) width *= 1.2;
    return width;
  }

  // A window's half width at stations along each stretch: 0.45 of the radius of curvature, no narrower than some points.
  void FindWidths() {
    const double widest = kWidestPart * chain_.length_mm, part = options_.exact && !options_.as_measured ? 0.25 : 0.45;
    const double least = std::max(chain_.length_mm / static_cast<double>(points_.size()), 0.5 * chain_.spacing_mm);
    const double narrowest = (options_.exact ? 3.6 : 8) * least;
    const LocalFit fit(points_, chain_.length_mm, options_.lean_known, !options_.exact);
    for (Stretch& stretch : stretches_) {
      const double length = stretch.to_mm - stretch.from_mm;
      const auto count = static_cast<std::size_t>(std::clamp(length / (0.4 * narrowest), 2.0, 1500.0));
      const double step = length / static_cast<double>(count);
      std::vector<double> least_widths, widths;
      for (std::size_t i = 0; i <= count; ++i) {
        least_widths.push_back(LeastWidth(fit, stretch, stretch.from_mm + step * static_cast<double>(i), narrowest));
        widths.push_back(std::max(least_widths[i], options_.exact ? 0 : 6 * chain_.spacing_mm));
      }
      for (int turn = 0; turn < 3; ++turn) {
        std::vector<double> next = widths;
        for (std::size_t i = 0; i <= count; ++i) {
          const double at = stretch.from_mm + step * static_cast<double>(i);
          FitWindow window = WindowIn(stretch, at, widths[i]);
          if (turn == 0) window.degree = 2;
          const auto [start, along] = StartAt(at);
          const auto curve = fit.At(window, start, along);
          if (curve)
            next[i] = std::clamp(part / std::max(1e-9, std::abs(curve->curvature_per_mm)), least_widths[i],
                                 std::max(least_widths[i], widest));
        }
        for (int sweep = 0; sweep < (stretch.around ? 2 : 1); ++sweep) {
          for (std::size_t i = 1; i <= count; ++i) next[i] = std::min(next[i], next[i - 1] + kSpread * step);
          for (std::size_t i = count; i-- > 0;) next[i] = std::min(next[i], next[i + 1] + kSpread * step);
          if (stretch.around) next[0] = next[count] = std::min(next[0], next[count]);
        }
        widths = next;
      }
      widths_.push_back(std::move(widths));
    }
  }

  double WidthAt(std::size_t stretch, double at_mm) const {
    const std::vector<double>& widths = widths_[stretch];
    const double length = stretches_[stretch].to_mm - stretches_[stretch].from_mm;
    const double x = (at_mm - stretches_[stretch].from_mm) / length * static_cast<double>(widths.size() - 1);
    const auto i = static_cast<std::size_t>(std::clamp(x, 0.0, static_cast<double>(widths.size() - 2)));
    const double part = x - static_cast<double>(i);
    return (1 - part) * widths[i] + part * widths[i + 1];
  }

  void AddNodes(const Stretch& stretch, const LocalFit& fit, std::vector<OutlineNode>* nodes,
                std::vector<double>* variances) {
    const auto index = static_cast<std::size_t>(&stretch - stretches_.data());
    const double length = stretch.to_mm - stretch.from_mm;
    // Places at equal steps of the sum of d(at) / distance wanted.
    constexpr std::size_t kParts = 2000;
    std::vector<double> sums{0};
    for (std::size_t i = 0; i < kParts; ++i) {
      const double at = stretch.from_mm + length * (static_cast<double>(i) + 0.5) / kParts;
      sums.push_back(sums.back() + length / kParts / (0.45 * WidthAt(index, at)));
    }
    const auto count = static_cast<std::size_t>(std::max(3.0, std::ceil(sums.back())));
    bool first = true;
    for (std::size_t k = 0; k < count + (stretch.around ? 0 : 1); ++k) {
      const double wanted = sums.back() * static_cast<double>(k) / static_cast<double>(count);
      auto above = static_cast<std::size_t>(std::lower_bound(sums.begin(), sums.end(), wanted) - sums.begin());
      above = std::clamp<std::size_t>(above, 1, kParts);
      const double part = (wanted - sums[above - 1]) / (sums[above] - sums[above - 1]);
      const double at = stretch.from_mm + length * (static_cast<double>(above - 1) + part) / kParts;
      const auto [start, along] = StartAt(std::min(at, stretch.to_mm - 1e-9));
      FitWindow window = WindowIn(stretch, at, WidthAt(index, at));
      auto curve = fit.At(window, start, along);
      if (!curve) continue;
      OutlineNode node;
      node.point_mm = curve->point_mm;
      node.normal = curve->normal;
      node.lean = curve->lean + curve->normal.dot(options_.lean.At(curve->point_mm));
      node.before = first ? stretch.before : Join::kSmooth;
      first = false;
      nodes->push_back(node);
      fitted_.noise.push_back({curve->first, std::move(curve->by_offset), std::move(curve->by_slope)});
      if (curve->freedom > 0) variances->push_back(curve->sample_variance_mm2);
    }
  }

  // The curves from both sides end where they meet.
  static void MeetAtCorners(std::vector<OutlineNode>* nodes) {
    for (std::size_t i = 0; i < nodes->size(); ++i) {
      OutlineNode& node = (*nodes)[i];
      OutlineNode& last = (*nodes)[i == 0 ? nodes->size() - 1 : i - 1];
      if (node.before != Join::kCorner) continue;
      Eigen::Matrix2d normals;
      normals << last.normal.transpose(), node.normal.transpose();
      const double across = normals.determinant();
      if (std::abs(across) < 0.1) continue;
      const Vector2d wanted(last.normal.dot(last.point_mm), node.normal.dot(node.point_mm));
      node.point_mm = last.point_mm = Vector2d(normals(1, 1) * wanted[0] - normals(0, 1) * wanted[1],
                                               normals(0, 0) * wanted[1] - normals(1, 0) * wanted[0]) /
                                      across;
    }
  }

  const PointChain& chain_;
  const OutlineFitOptions& options_;
  std::vector<FitPoint> points_;
  std::vector<OutlineCorner> corners_;
  std::vector<Stretch> stretches_;
  std::vector<std::vector<double>> widths_;
  FittedOutline fitted_;
};

// Which are far from a line in place and height beyond the plane through their neighbours.
std::vector<bool> Outlying(const std::vector<SectionSample>& samples, const std::vector<ChainedSample>& chained,
                           double least_mm, bool lean_known) {
  constexpr std::size_t kStep = 20, kAround = 25;
  std::vector<bool> outlying(chained.size(), false);
  for (std::size_t begin = 0; begin < chained.size(); begin += kStep) {
    const std::size_t end = std::min(chained.size(), begin + kStep);
    const std::size_t from = begin < kAround ? 0 : begin - kAround, to = std::min(chained.size(), end + kAround);
    const auto beyond = [&](std::size_t i) { return lean_known ? 0 : samples[chained[i].sample].beyond_mm; };
    std::vector<double> weights(to - from, 1), off(to - from);
    double scale = 0;
    for (int turn = 0; turn < 4; ++turn) {
      Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      const auto row = [&](std::size_t i) {
        return Eigen::Vector3d(1, chained[i].at_mm - chained[begin].at_mm, beyond(i));
      };
      for (std::size_t i = from; i < to; ++i) {
        normal += weights[i - from] * row(i) * row(i).transpose();
        right += weights[i - from] * chained[i].height_mm * row(i);
      }
      const Eigen::Vector3d line = normal.ldlt().solve(right);
      for (std::size_t i = from; i < to; ++i) off[i - from] = std::abs(chained[i].height_mm - row(i).dot(line));
      scale = RobustSigmaOfMagnitudes(off);
      for (std::size_t i = 0; i < off.size(); ++i) {
        const double ratio = scale > 0 ? off[i] / (4.685 * scale) : 0;
        weights[i] = ratio < 1 ? std::pow(1 - ratio * ratio, 2) : 0;
      }
    }
    for (std::size_t i = begin; i < end; ++i) outlying[i] = off[i - from] > std::max(5 * scale, least_mm);
  }
  return outlying;
}

}  // namespace

std::vector<FitPoint> FitPointsOf(const std::vector<SectionSample>& samples, const std::vector<ChainedSample>& chained,
                                  const PointChain& chain, bool lean_known, std::int64_t* outliers) {
  const std::vector<bool> outlying = Outlying(samples, chained, 0.2 * chain.spacing_mm, lean_known);
  const double width_mm = chain.length_mm / kMostMeans;
  const bool few = static_cast<double>(chained.size()) < kMostMeans;
  std::vector<FitPoint> points;
  double cell = -1;
  for (std::size_t i = 0; i < chained.size(); ++i) {
    if (outlying[i]) {
      ++*outliers;
      continue;
    }
    const SectionSample& sample = samples[chained[i].sample];
    const FitPoint one{sample.point_mm, chained[i].at_mm, sample.beyond_mm, sample.lean, 1};
    const double in = std::floor(one.at_mm / width_mm);
    if (few || in != cell) {
      points.push_back(one);
      cell = in;
      continue;
    }
    FitPoint& mean = points.back();
    const double part = 1 / ++mean.count;
    mean.point_mm += part * (one.point_mm - mean.point_mm);
    mean.at_mm += part * (one.at_mm - mean.at_mm);
    mean.beyond_mm += part * (one.beyond_mm - mean.beyond_mm);
    mean.lean += part * (one.lean - mean.lean);
  }
  return points;
}

absl::StatusOr<FittedOutline> FitOutline(const PointChain& chain, const std::vector<FitPoint>& points,
                                         const OutlineFitOptions& options) {
  return Fitter(chain, points, options).Run();
}

}  // namespace sixpoint::metrology

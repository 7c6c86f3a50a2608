#include "metrology/sections/point_chain.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "metrology/statistics/ranks.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kLeastChainPoints = 20;
constexpr double kSparse = 0.1;      // of the usual number of samples about a point: a stray has fewer
constexpr double kGreatPiece = 0.2;  // of the longest piece's length
constexpr double kLeastPiece = 0.02;

// Points by square cells.
class Cells {
 public:
  explicit Cells(double width_mm) : width_mm_(width_mm) {}
  void Add(const Vector2d& p, std::uint32_t index) { cells_[KeyOf(Cell(p.x()), Cell(p.y()))].push_back(index); }
  template <typename Visit>
  void Near(const Vector2d& p, int rings, const Visit& visit) const {
    const std::int64_t x = Cell(p.x()), y = Cell(p.y());
    for (std::int64_t i = x - rings; i <= x + rings; ++i)
      for (std::int64_t j = y - rings; j <= y + rings; ++j)
        if (const auto found = cells_.find(KeyOf(i, j)); found != cells_.end())
          for (const std::uint32_t index : found->second) visit(index);
  }

 private:
  std::int64_t Cell(double v) const { return static_cast<std::int64_t>(std::floor(v / width_mm_)); }
  static std::uint64_t KeyOf(std::int64_t i, std::int64_t j) {
    return static_cast<std::uint64_t>(i) << 32 ^ (static_cast<std::uint64_t>(j) & 0xffffffffu);
  }
  double width_mm_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

// Points none of which is nearer to another than the spacing, and none that stands nearly alone.
struct ThinPoint {
  Vector2d point_mm;
  double count = 0;  // of samples about it
};

std::vector<ThinPoint> Thinned(const std::vector<SectionSample>& samples, double spacing_mm) {
  Cells cells(spacing_mm);
  std::vector<Vector2d> taken;
  std::vector<double> counts;
  for (const SectionSample& sample : samples) {
    double nearest = spacing_mm * spacing_mm;
    std::size_t of = taken.size();
    cells.Near(sample.point_mm, 1, [&](std::uint32_t i) {
      const double squared = (taken[i] - sample.point_mm).squaredNorm();
      if (squared < nearest) nearest = squared, of = i;
    });
    if (of == taken.size()) {
      cells.Add(sample.point_mm, static_cast<std::uint32_t>(of));
      taken.push_back(sample.point_mm);
      counts.push_back(0);
    }
    ++counts[of];
  }
  const double usual = UpperMedian(counts);
  std::vector<ThinPoint> kept;
  for (std::size_t i = 0; i < taken.size(); ++i)
    if (usual < 8 || counts[i] >= kSparse * usual) kept.push_back({taken[i], counts[i]});
  return kept;
}

// Samples at random places leave gaps of up to their mean distance times the logarithm of their number, and beyond that by chance: seven
// times the distance more in one of a thousand outlines.
double ChanceGap(double distance_mm, double sample_count) { return distance_mm * (std::log(sample_count) + 7); }

// How far points may be joined: over the gaps that the mean distance leaves, and over those of the sparser parts.
double JoinReach(const std::vector<ThinPoint>& points, std::size_t sample_count, double spacing_mm) {
  constexpr double kUsualStep = 1.4;                 // of thinned points: spacings from one to the next
  constexpr double kSparser = 0.9, kSparseStep = 5;  // of points; of their distance to their second neighbour
  const auto samples = static_cast<double>(sample_count);
  const double mean_mm = kUsualStep * spacing_mm * static_cast<double>(points.size()) / samples;
  const double reach_mm = std::max(4 * spacing_mm, ChanceGap(mean_mm, samples));
  Cells cells(reach_mm);
  for (std::size_t i = 0; i < points.size(); ++i) cells.Add(points[i].point_mm, static_cast<std::uint32_t>(i));
  std::vector<double> seconds;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double first = reach_mm, second = reach_mm;
    cells.Near(points[i].point_mm, 1, [&](std::uint32_t j) {
      if (j == i) return;
      const double distance = (points[j].point_mm - points[i].point_mm).norm();
      if (distance < first)
        second = std::exchange(first, distance);
      else
        second = std::min(second, distance);
    });
    seconds.push_back(second);
  }
  const auto rank = static_cast<std::size_t>(kSparser * static_cast<double>(seconds.size() - 1));
  return std::max(reach_mm, kSparseStep * AtRank(rank, &seconds));
}

struct ChainPiece {
  std::vector<std::uint32_t> points;
  bool closed = false;
  double length_mm = 0;
};

class Joiner {
 public:
  explicit Joiner(const std::vector<ThinPoint>& points)
      : points_(points), next_(points.size()), root_(points.size()), sizes_(points.size(), 1) {
    std::iota(root_.begin(), root_.end(), 0u);
  }

  void Join(double gap_mm) {
    Cells cells(gap_mm);
    for (std::size_t i = 0; i < points_.size(); ++i) cells.Add(points_[i].point_mm, static_cast<std::uint32_t>(i));
    std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> joints;
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      cells.Near(points_[i].point_mm, 1, [&](std::uint32_t j) {
        const double length = (points_[i].point_mm - points_[j].point_mm).norm();
        if (j > i && length <= gap_mm) joints.emplace_back(length, i, j);
      });
    std::sort(joints.begin(), joints.end());
    for (const auto& [length, i, j] : joints) {
      if (next_[i].size() == 2 || next_[j].size() == 2) continue;
      const std::uint32_t a = RootOf(i), b = RootOf(j);
      constexpr std::uint32_t kLeastLoop = 12;
      if (a == b && sizes_[a] < kLeastLoop) continue;
      if (a != b) root_[b] = a, sizes_[a] += sizes_[b];
      next_[i].push_back(j);
      next_[j].push_back(i);
    }
  }

  // Longest first.
  std::vector<ChainPiece> Pieces() const {
    std::vector<ChainPiece> pieces;
    std::vector<bool> seen(points_.size(), false);
    const auto walk = [&](std::uint32_t from) {
      ChainPiece piece;
      for (std::uint32_t at = from;;) {
        seen[at] = true;
        piece.points.push_back(at);
        const auto next = std::find_if(next_[at].begin(), next_[at].end(), [&](std::uint32_t n) { return !seen[n]; });
        if (next == next_[at].end()) {
          piece.closed = piece.points.size() > 2 && next_[at].size() == 2;
          break;
        }
        piece.length_mm += (points_[*next].point_mm - points_[at].point_mm).norm();
        at = *next;
      }
      pieces.push_back(std::move(piece));
    };
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      if (!seen[i] && next_[i].size() < 2) walk(i);
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      if (!seen[i]) walk(i);
    std::stable_sort(pieces.begin(), pieces.end(),
                     [](const ChainPiece& a, const ChainPiece& b) { return a.length_mm > b.length_mm; });
    return pieces;
  }

 private:
  std::uint32_t RootOf(std::uint32_t i) {
    while (root_[i] != i) i = root_[i] = root_[root_[i]];
    return i;
  }
  const std::vector<ThinPoint>& points_;
  std::vector<std::vector<std::uint32_t>> next_;
  std::vector<std::uint32_t> root_, sizes_;
};

// Where the way to up to three points and back is twice as long as past them, outliers stand beside the outline. No corner of a measured
// blade is that acute.
void DropSpikes(std::vector<ThinPoint>* points) {
  constexpr double kDetour = 2;
  const std::size_t n = points->size();
  const auto at = [&](std::size_t i) -> const Vector2d& { return (*points)[i % n].point_mm; };
  std::vector<bool> dropped(n, false);
  for (std::size_t i = 0; i < n; ++i) {
    double way = (at(i + 1) - at(i)).norm();
    for (std::size_t skipped = 1; skipped <= 3 && !dropped[i]; ++skipped) {
      way += (at(i + skipped + 1) - at(i + skipped)).norm();
      if (way < kDetour * (at(i + skipped + 1) - at(i)).norm()) continue;
      for (std::size_t k = 1; k <= skipped; ++k) dropped[(i + k) % n] = true;
      break;
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (!dropped[i]) (*points)[kept++] = (*points)[i];
  points->resize(kept);
}

// Whether each step to a point is longer than chance makes it among the samples about it.
std::vector<bool> GapsBefore(const std::vector<ThinPoint>& points, double spacing_mm, double stated_gap_mm,
                             std::size_t sample_count) {
  constexpr std::size_t kAbout = 15;
  const std::size_t n = points.size();
  const auto step = [&](std::size_t i) { return (points[i % n].point_mm - points[(i + n - 1) % n].point_mm).norm(); };
  std::vector<bool> gaps;
  for (std::size_t i = 0; i < n; ++i) {
    double way = 0, count = 0;
    for (std::size_t k = 1; k <= kAbout; ++k) {
      way += step(i + k) + step(i + n - k);
      count += points[(i + k) % n].count + points[(i + n - k) % n].count;
    }
    const double chance_mm = ChanceGap(way / count, static_cast<double>(sample_count));
    gaps.push_back(step(i) > (stated_gap_mm > 0 ? stated_gap_mm : std::max(4 * spacing_mm, chance_mm)));
  }
  return gaps;
}

// Pieces one after the other, each by its end that is nearer to where the last one ended.
std::vector<ThinPoint> Strung(const std::vector<ThinPoint>& points, std::vector<ChainPiece> pieces) {
  std::vector<ThinPoint> strung;
  const auto take = [&](const ChainPiece& piece) {
    for (const std::uint32_t i : piece.points) strung.push_back(points[i]);
  };
  take(pieces.front());
  pieces.erase(pieces.begin());
  while (!pieces.empty()) {
    const Vector2d end = strung.back().point_mm;
    const auto to = [&](std::uint32_t i) { return (points[i].point_mm - end).norm(); };
    const auto distance = [&](const ChainPiece& piece) {
      return std::min(to(piece.points.front()), to(piece.points.back()));
    };
    const auto next = std::min_element(pieces.begin(), pieces.end(), [&](const ChainPiece& a, const ChainPiece& b) {
      return distance(a) < distance(b);
    });
    if (to(next->points.back()) < to(next->points.front())) std::reverse(next->points.begin(), next->points.end());
    take(*next);
    pieces.erase(next);
  }
  DropSpikes(&strung);
  return strung;
}

void TurnCounterClockwise(PointChain* chain) {
  const auto& p = chain->points_mm;
  double area = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vector2d a = p[i] - p[0], b = p[(i + 1) % p.size()] - p[0];
    area += a.x() * b.y() - a.y() * b.x();
  }
  if (area >= 0) return;
  std::reverse(chain->points_mm.begin(), chain->points_mm.end());
  std::reverse(chain->gap_before.begin(), chain->gap_before.end());
  // What was before a point is after it now.
  std::rotate(chain->gap_before.begin(), chain->gap_before.end() - 1, chain->gap_before.end());
}

void Measure(PointChain* chain) {
  chain->at_mm.clear();
  chain->length_mm = 0;
  for (std::size_t i = 0; i < chain->points_mm.size(); ++i) {
    chain->at_mm.push_back(chain->length_mm);
    chain->length_mm += (chain->points_mm[(i + 1) % chain->points_mm.size()] - chain->points_mm[i]).norm();
  }
}

}  // namespace

absl::StatusOr<PointChain> ChainOf(const std::vector<SectionSample>& samples, const ChainOptions& options) {
  const std::vector<ThinPoint> points = Thinned(samples, options.spacing_mm);
  if (points.size() < kLeastChainPoints)
    return Refuse("points", std::to_string(points.size()) + " apart in the section",
                  "at least " + std::to_string(kLeastChainPoints) + ": does the plane meet the part?");
  Joiner joiner(points);
  joiner.Join(options.gap_mm > 0 ? options.gap_mm : JoinReach(points, samples.size(), options.spacing_mm));
  std::vector<ChainPiece> pieces = joiner.Pieces();
  const double longest_mm = pieces.front().length_mm;
  const auto shorter = [&](double share) {
    return std::find_if(pieces.begin(), pieces.end(),
                        [&](const ChainPiece& piece) { return piece.length_mm < share * longest_mm; });
  };
  const auto great = shorter(kGreatPiece);
  const auto closed = std::find_if(pieces.begin(), great, [](const ChainPiece& piece) { return piece.closed; });
  if (closed != great) {
    if (great - pieces.begin() > 1)
      return Refuse("points", std::to_string(great - pieces.begin()) + " outlines in the section",
                    "one, or a nominal outline that says which");
    pieces.resize(1);
  } else {
    pieces.erase(shorter(kLeastPiece), pieces.end());
  }
  const std::vector<ThinPoint> strung = Strung(points, std::move(pieces));
  PointChain chain;
  chain.spacing_mm = options.spacing_mm;
  for (const ThinPoint& point : strung) chain.points_mm.push_back(point.point_mm);
  chain.gap_before = GapsBefore(strung, options.spacing_mm, options.gap_mm, samples.size());
  TurnCounterClockwise(&chain);
  Measure(&chain);
  return chain;
}

absl::StatusOr<PointChain> ChainOfLoop(const std::vector<Vector2d>& loop_mm) {
  PointChain chain;
  std::vector<double> steps;
  for (const Vector2d& p : loop_mm) {
    if (!p.allFinite()) return Refuse("outline", "a point that is not finite", "finite points");
    if (!chain.points_mm.empty() && (p - chain.points_mm.back()).norm() < 1e-6) continue;
    if (!chain.points_mm.empty()) steps.push_back((p - chain.points_mm.back()).norm());
    chain.points_mm.push_back(p);
  }
  while (chain.points_mm.size() > 1 && (chain.points_mm.back() - chain.points_mm.front()).norm() < 1e-6)
    chain.points_mm.pop_back();
  if (chain.points_mm.size() < kLeastChainPoints)
    return Refuse("outline", std::to_string(chain.points_mm.size()) + " points",
                  "at least " + std::to_string(kLeastChainPoints));
  chain.gap_before.assign(chain.points_mm.size(), false);
  chain.spacing_mm = UpperMedian(steps);
  TurnCounterClockwise(&chain);
  Measure(&chain);
  return chain;
}

void Settle(const std::vector<ChainedSample>& chained, PointChain* chain) {
  const std::size_t n = chain->points_mm.size();
  std::vector<Vector2d> moved = chain->points_mm;
  std::vector<double> heights;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = i == 0 ? n - 1 : i - 1, after = (i + 1) % n;
    if (chain->gap_before[i] || chain->gap_before[after]) continue;
    const double from = chain->at_mm[i] - (chain->points_mm[i] - chain->points_mm[before]).norm();
    const double to = chain->at_mm[i] + (chain->points_mm[after] - chain->points_mm[i]).norm();
    heights.clear();
    auto at = std::lower_bound(chained.begin(), chained.end(), from,
                               [](const ChainedSample& sample, double value) { return sample.at_mm < value; });
    for (; at != chained.end() && at->at_mm <= to; ++at) heights.push_back(at->height_mm);
    const Vector2d along = (chain->points_mm[after] - chain->points_mm[before]).normalized();
    moved[i] += Median(heights) * Vector2d(along.y(), -along.x());
  }
  chain->points_mm = std::move(moved);
  Measure(chain);
}

std::vector<ChainedSample> Chained(const std::vector<SectionSample>& samples, const PointChain& chain, double reach_mm,
                                   std::int64_t* strays) {
  const std::size_t n = chain.points_mm.size();
  Cells cells(3 * chain.spacing_mm);
  for (std::size_t i = 0; i < n; ++i) cells.Add(chain.points_mm[i], static_cast<std::uint32_t>(i));
  std::vector<ChainedSample> chained;
  for (std::uint32_t k = 0; k < samples.size(); ++k) {
    const Vector2d& p = samples[k].point_mm;
    std::size_t nearest = n;
    double least = INFINITY;
    cells.Near(p, 1, [&](std::uint32_t i) {
      const double squared = (chain.points_mm[i] - p).squaredNorm();
      if (squared < least || (squared == least && i < nearest)) least = squared, nearest = i;
    });
    ChainedSample found;
    double best = reach_mm;
    for (const std::size_t from : {nearest == 0 ? n - 1 : nearest - 1, nearest}) {
      if (nearest == n) break;
      const std::size_t to = (from + 1) % n;
      const Vector2d along = chain.points_mm[to] - chain.points_mm[from], off = p - chain.points_mm[from];
      const double length = along.norm();
      double x = off.dot(along) / length;
      // Over a gap nothing is known but that points lie near its ends.
      if (chain.gap_before[to]) x = from == nearest ? std::min(x, 0.0) : std::max(x, length);
      x = std::clamp(x, 0.0, length);
      const double distance = (off - x / length * along).norm();
      if (distance >= best) continue;
      best = distance;
      const double outward = (off.x() * along.y() - off.y() * along.x()) / length;
      found = {chain.at_mm[from] + x, outward, k};
    }
    if (best < reach_mm)
      chained.push_back(found);
    else
      ++*strays;
  }
  std::sort(chained.begin(), chained.end(), [](const ChainedSample& a, const ChainedSample& b) {
    return std::make_tuple(a.at_mm, a.sample) < std::make_tuple(b.at_mm, b.sample);
  });
  return chained;
}

}  // namespace sixpoint::metrology

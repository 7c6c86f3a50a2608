#include "metrology/calibration/hole_search.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

constexpr double kCellMm = 0.25;
constexpr int kGapCells = 5;  // what missing profiles or columns may cut out of a hole
constexpr size_t kMostRegions = 24;

// Cells of the face: most of its readings lie below the face; on it; none were read.
class CellMap {
 public:
  CellMap(const std::vector<FacePoint>& seen, double deepest_mm) {
    Eigen::Vector2d maximum = Eigen::Vector2d::Constant(-1e9);
    for (const FacePoint& s : seen) {
      if (s.depth < kBelowMm || s.depth > deepest_mm) continue;
      minimum_ = minimum_.cwiseMin(s.at);
      maximum = maximum.cwiseMax(s.at);
    }
    if (maximum.x() < minimum_.x()) return;
    columns_ = static_cast<int>((maximum.x() - minimum_.x()) / kCellMm) + 3;
    rows_ = static_cast<int>((maximum.y() - minimum_.y()) / kCellMm) + 3;
    std::vector<int> balance(size(), 0);
    label_.assign(size(), kEmpty);
    for (const FacePoint& s : seen) {
      const int cell = CellOf(s.at);
      if (cell < 0 || s.depth < -kBelowMm || s.depth > deepest_mm) continue;
      balance[cell] += s.depth < kBelowMm ? -1 : 1;
      label_[cell] = balance[cell] > 0 ? kLow : kUpper;
    }
    Bridge(1, columns_, rows_, columns_);
    Bridge(columns_, rows_, columns_, 1);
    Connect();
  }
  int regions() const { return regions_; }
  // Of a place; negative where there is none.
  int RegionAt(const Eigen::Vector2d& at) const {
    const int cell = CellOf(at);
    return cell < 0 ? kEmpty : label_[cell];
  }

 private:
  static constexpr int kEmpty = -1, kLow = -2, kUpper = -3;
  size_t size() const { return static_cast<size_t>(columns_) * static_cast<size_t>(rows_); }
  int CellOf(const Eigen::Vector2d& at) const {
    const int x = 1 + static_cast<int>(std::floor((at.x() - minimum_.x()) / kCellMm));
    const int y = 1 + static_cast<int>(std::floor((at.y() - minimum_.y()) / kCellMm));
    return x < 1 || y < 1 || x > columns_ - 2 || y > rows_ - 2 ? -1 : y * columns_ + x;
  }
  // Missing profiles or columns cut a hole in two: low cells on both sides of a short run without readings.
  void Bridge(int step, int length, int lines, int line_step) {
    for (int line = 0; line < lines; ++line)
      for (int i = 0, last = -kGapCells - 2; i < length; ++i) {
        const int cell = line * line_step + i * step;
        if (label_[cell] == kUpper) last = -kGapCells - 2;
        if (label_[cell] != kLow) continue;
        if (i - last <= kGapCells + 1)
          for (int k = last + 1; k < i; ++k) label_[line * line_step + k * step] = kLow;
        last = i;
      }
  }
  void Connect() {
    std::vector<int> stack;
    for (int start = 0; start < static_cast<int>(label_.size()); ++start) {
      if (label_[start] != kLow) continue;
      label_[start] = regions_;
      stack.push_back(start);
      while (!stack.empty()) {
        const int cell = stack.back();
        stack.pop_back();
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const int next = cell + dy * columns_ + dx;
            if (label_[next] != kLow) continue;
            label_[next] = regions_;
            stack.push_back(next);
          }
      }
      ++regions_;
    }
  }

  Eigen::Vector2d minimum_ = Eigen::Vector2d::Constant(1e9);
  int columns_ = 0, rows_ = 0, regions_ = 0;
  std::vector<int> label_;
};

}  // namespace

std::vector<Recess> HolesBelow(const std::vector<FacePoint>& seen, const Artefact& artefact) {
  const double deepest = std::max(artefact.ConeDepth(), artefact.slot_depth_mm) + 0.2;
  const CellMap map(seen, deepest);
  struct Sums {
    Eigen::Vector2d minimum = Eigen::Vector2d::Constant(1e9), maximum = Eigen::Vector2d::Constant(-1e9);
    size_t count = 0, floor = 0;
  };
  std::vector<Sums> sums(map.regions());
  if (sums.empty()) return {};
  for (const FacePoint& l : seen) {
    if (l.depth < kBelowMm || l.depth > deepest) continue;
    const int region = map.RegionAt(l.at);
    if (region < 0) continue;
    Sums& s = sums[region];
    s.minimum = s.minimum.cwiseMin(l.at);
    s.maximum = s.maximum.cwiseMax(l.at);
    ++s.count;
    s.floor += std::abs(l.depth - artefact.slot_depth_mm) < 0.05;
  }
  const double widest = 2 * std::max(artefact.cone_top_radius_mm, artefact.slot_width_mm) + 1;
  std::vector<Recess> found;
  for (const Sums& s : sums) {
    const Eigen::Vector2d extent = s.maximum - s.minimum;
    if (s.count < 20 || extent.maxCoeff() > widest || extent.minCoeff() < 0.5) continue;
    found.push_back({(s.minimum + s.maximum) / 2, s.count, 2 * s.floor > s.count});
  }
  std::stable_sort(found.begin(), found.end(), [](const Recess& a, const Recess& b) { return a.count > b.count; });
  if (found.size() > kMostRegions) found.resize(kMostRegions);
  return found;
}

}  // namespace sixpoint::metrology

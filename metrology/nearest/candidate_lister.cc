#include "metrology/nearest/candidate_lister.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace sixpoint::metrology {
namespace {

constexpr double kRoundedUp = 1 + 1e-6, kRoundedDown = 1 - 1e-6;  // what single precision may add or take
constexpr float kWellKnown = 1e-3f;                               // of the distance up to which triangles are listed
constexpr std::uint32_t kSteps = 64;                              // of distance, to which candidates are put in order

}  // namespace

std::uint32_t CandidateLister::List(const Eigen::Vector3d* centres_mm, std::size_t count, double radius_mm,
                                    double band_mm, CandidateLists* lists) {
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < count; ++i) box.extend(centres_mm[i]);
  const Eigen::Vector3d middle_mm = box.center();
  const double width_mm = 0.5 * box.diagonal().norm(), most_mm = (band_mm + width_mm) * kRoundedUp;
  const NearestTriangle nearest = tree_.Find(middle_mm, most_mm * most_mm, hint_);
  if (nearest.triangle == NearestTriangle::kNone) return 0;
  hint_ = nearest.triangle;
  // Whoever is nearest to a point of a cell is no farther from its centre than the surface, and twice the cell's radius.
  const double farthest_mm = std::min(std::sqrt(nearest.distance_squared) + width_mm, band_mm);
  tree_.FindAbout(box, (farthest_mm + 2 * radius_mm) * kRoundedUp, &items_);
  Measure(centres_mm, count, middle_mm, width_mm);
  std::uint32_t have_one = 0;
  for (std::size_t lane = 0; lane < count; ++lane) {
    const double distance_mm = FarthestOf(lane, centres_mm[lane], band_mm);
    if (distance_mm > band_mm) continue;
    ListOne(lane, centres_mm[lane], distance_mm + 2 * radius_mm, lists);
    have_one |= std::uint32_t{1} << lane;
  }
  return have_one;
}

void CandidateLister::Measure(const Eigen::Vector3d* centres_mm, std::size_t count, const Eigen::Vector3d& middle_mm,
                              double width_mm) {
  for (std::size_t i = 0; i < kMostCells; ++i) {
    const Eigen::Vector3f q = (centres_mm[std::min(i, count - 1)] - middle_mm).cast<float>();
    lanes_.Set(i, q.x(), q.y(), q.z());
  }
  const MeasureTriangle measure = MeasureOf(UsedLaneWidth());
  tolerances_mm_.resize(items_.size());
  squared_.resize(items_.size());
  greatest_tolerance_mm_ = 0;
  for (std::uint32_t k = 0; k < items_.size(); ++k) {
    const TriangleShape& shape = shapes_[items_[k]];
    const Eigen::Vector3f a = (tree_.corner(tree_.items()[items_[k]], 0) - middle_mm).cast<float>();
    tolerances_mm_[k] = ToleranceOf(shape, a, static_cast<float>(width_mm));
    greatest_tolerance_mm_ = std::max(greatest_tolerance_mm_, tolerances_mm_[k]);
    measure(shape, a.x(), a.y(), a.z(), k, kMostCells, &lanes_, &squared_[k]);
  }
}

double CandidateLister::FarthestOf(std::size_t lane, const Eigen::Vector3d& centre_mm, double band_mm) const {
  constexpr double kTooFar = std::numeric_limits<double>::infinity();
  if (items_.empty()) return kTooFar;
  const double least_mm = std::sqrt(static_cast<double>(lanes_.least[lane]));
  const double most_mm = (least_mm + static_cast<double>(tolerances_mm_[lanes_.nearest[lane]])) * kRoundedUp;
  if (most_mm <= band_mm) return most_mm;
  if (least_mm * kRoundedDown - static_cast<double>(greatest_tolerance_mm_) > band_mm) return kTooFar;
  return tree_.Find(centre_mm, band_mm * band_mm, hint_).triangle == NearestTriangle::kNone ? kTooFar : band_mm;
}

float CandidateLister::DistanceOf(std::uint32_t item, const Eigen::Vector3d& centre_mm) const {
  NearestTriangle nearest;
  TakeNearer(tree_.vertices(), tree_.items()[item], centre_mm, &nearest);
  return static_cast<float>(std::sqrt(nearest.distance_squared));
}

void CandidateLister::ListOne(std::size_t lane, const Eigen::Vector3d& centre_mm, double reach_mm,
                              CandidateLists* lists) {
  const auto reach = static_cast<float>(reach_mm * kRoundedUp);
  const float steps_per_mm = static_cast<float>(kSteps) / (reach * static_cast<float>(kRoundedUp));
  listed_.clear();
  std::array<std::uint32_t, kSteps> next{};  // how many are of the step, then where its next one stands
  for (std::uint32_t k = 0; k < items_.size(); ++k) {
    const float limit = reach + tolerances_mm_[k], squared = squared_[k].at[lane];
    if (!(squared <= limit * limit)) continue;
    // A sliver's is not known well enough to stand among the others.
    const float known = tolerances_mm_[k] <= kWellKnown * reach ? std::sqrt(squared) - tolerances_mm_[k]
                                                                : DistanceOf(items_[k], centre_mm);
    const float at_least = std::max(known * static_cast<float>(kRoundedDown), 0.f);
    if (at_least > reach) continue;
    const std::uint32_t step = std::min(static_cast<std::uint32_t>(at_least * steps_per_mm), kSteps - 1);
    ++next[step];
    listed_.push_back({items_[k], step, at_least});
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& of_step : next) sum += std::exchange(of_step, sum);
  const std::size_t group_count = (listed_.size() + kCandidateGroup - 1) / kCandidateGroup;
  in_order_.assign(kCandidateGroup * group_count, listed_.front().item);
  group_distance_mm_.assign(group_count, reach);
  for (const ListedItem& listed : listed_) {
    const std::uint32_t at = next[listed.step]++;
    in_order_[at] = listed.item;
    float& distance_mm = group_distance_mm_[at / kCandidateGroup];
    distance_mm = std::min(distance_mm, listed.at_least_mm);
  }
  // Those of one step stand in no order.
  for (std::size_t group = group_count - 1; group > 0; --group)
    group_distance_mm_[group - 1] = std::min(group_distance_mm_[group - 1], group_distance_mm_[group]);
  lists->Add(in_order_, group_distance_mm_);
}

}  // namespace sixpoint::metrology

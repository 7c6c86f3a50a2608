#include "metrology/measuring_plan/travel_order.h"

#include <algorithm>
#include <limits>

namespace sixpoint::metrology {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostExact = 12;
// From each start some n changes are looked for among some n^2: together no more than that, a few seconds.
constexpr int kMostStarts = 32;
constexpr double kMostChangesLookedAt = 3.2e7;
constexpr double kWorthwhile = 1e-9;  // less is rounding, and would go on for ever

// Held and Karp: the best way through each set of places that ends at each of them.
std::vector<int> BestOrder(const Eigen::MatrixXd& cost) {
  const int count = static_cast<int>(cost.rows());
  const std::size_t sets = std::size_t{1} << count;
  const auto at = [&](std::size_t set, int last) { return set * static_cast<std::size_t>(count) + last; };
  std::vector<double> least(sets * static_cast<std::size_t>(count), kInfinity);
  std::vector<int> before(least.size(), -1);
  for (int i = 0; i < count; ++i) least[at(std::size_t{1} << i, i)] = 0;
  for (std::size_t set = 1; set < sets; ++set)
    for (int last = 0; last < count; ++last) {
      const double so_far = least[at(set, last)];
      if (!(so_far < kInfinity)) continue;
      for (int next = 0; next < count; ++next) {
        if ((set >> next & 1) != 0) continue;
        const std::size_t with = at(set | std::size_t{1} << next, next);
        if (!(so_far + cost(last, next) < least[with])) continue;
        least[with] = so_far + cost(last, next);
        before[with] = last;
      }
    }
  int last = 0;
  for (int i = 1; i < count; ++i)
    if (least[at(sets - 1, i)] < least[at(sets - 1, last)]) last = i;
  std::vector<int> order;
  for (std::size_t set = sets - 1; last >= 0;) {
    order.push_back(last);
    const int previous = before[at(set, last)];
    set &= ~(std::size_t{1} << last);
    last = previous;
  }
  std::reverse(order.begin(), order.end());
  return order;
}

std::vector<int> NearestNeighbours(int start, const Eigen::MatrixXd& cost) {
  const int count = static_cast<int>(cost.rows());
  std::vector<bool> visited(static_cast<std::size_t>(count), false);
  std::vector<int> order = {start};
  visited[static_cast<std::size_t>(start)] = true;
  while (static_cast<int>(order.size()) < count) {
    int nearest = -1;
    for (int i = 0; i < count; ++i)
      if (!visited[static_cast<std::size_t>(i)] && (nearest < 0 || cost(order.back(), i) < cost(order.back(), nearest)))
        nearest = i;
    order.push_back(nearest);
    visited[static_cast<std::size_t>(nearest)] = true;
  }
  return order;
}

// The way into and out of a piece of an order, what stands there now or would.
class Pieces {
 public:
  Pieces(const std::vector<int>& order, const Eigen::MatrixXd& cost) : order_(order), cost_(cost) {
    forward_.assign(order.size(), 0);
    backward_.assign(order.size(), 0);
    for (std::size_t i = 1; i < order.size(); ++i) {
      forward_[i] = forward_[i - 1] + cost(order[i - 1], order[i]);
      backward_[i] = backward_[i - 1] + cost(order[i], order[i - 1]);
    }
  }
  // What is won where [first, last] is turned round.
  double WonByTurning(int first, int last) const {
    const double now = Way(first - 1, first) + Within(forward_, first, last) + Way(last, last + 1);
    return now - (Way(first - 1, last) + Within(backward_, first, last) + Way(first, last + 1));
  }
  // What is won where [first, last] comes to stand behind `behind` (-1: at the begin), which is none of them.
  double WonByMoving(int first, int last, int behind) const {
    const double now = Way(first - 1, first) + Way(last, last + 1) + Way(behind, behind + 1);
    return now - (Way(first - 1, last + 1) + Way(behind, first) + Way(last, behind + 1));
  }

 private:
  // 0 before the first and behind the last.
  double Way(int from, int to) const {
    const int count = static_cast<int>(order_.size());
    return from < 0 || to >= count
               ? 0
               : cost_(order_[static_cast<std::size_t>(from)], order_[static_cast<std::size_t>(to)]);
  }
  static double Within(const std::vector<double>& sums, int first, int last) {
    return sums[static_cast<std::size_t>(last)] - sums[static_cast<std::size_t>(first)];
  }
  const std::vector<int>& order_;
  const Eigen::MatrixXd& cost_;
  std::vector<double> forward_, backward_;
};

// The change that wins most; false where none does.
bool Improve(const Eigen::MatrixXd& cost, std::vector<int>* order) {
  constexpr int kLongestMoved = 3;
  const int count = static_cast<int>(order->size());
  const Pieces pieces(*order, cost);
  double most = kWorthwhile;
  int best_first = -1, best_last = 0, best_behind = -2;
  for (int first = 0; first < count; ++first) {
    for (int last = first + 1; last < count; ++last)
      if (const double won = pieces.WonByTurning(first, last); won > most)
        most = won, best_first = first, best_last = last, best_behind = -2;
    for (int last = first; last < std::min(count, first + kLongestMoved); ++last)
      for (int behind = -1; behind < count; ++behind) {
        if (behind >= first - 1 && behind <= last) continue;
        if (const double won = pieces.WonByMoving(first, last, behind); won > most)
          most = won, best_first = first, best_last = last, best_behind = behind;
      }
  }
  if (best_first < 0) return false;
  const auto begin = order->begin();
  if (best_behind == -2)
    std::reverse(begin + best_first, begin + best_last + 1);
  else if (best_behind < best_first)
    std::rotate(begin + best_behind + 1, begin + best_first, begin + best_last + 1);
  else
    std::rotate(begin + best_first, begin + best_last + 1, begin + best_behind + 1);
  return true;
}

}  // namespace

double TravelOf(const std::vector<int>& order, const Eigen::MatrixXd& cost) {
  double sum = 0;
  for (std::size_t i = 1; i < order.size(); ++i) sum += cost(order[i - 1], order[i]);
  return sum;
}

std::vector<int> ShortOrder(const Eigen::MatrixXd& cost, const std::function<bool()>& keep_going) {
  const int count = static_cast<int>(cost.rows());
  if (count <= 1) return std::vector<int>(static_cast<std::size_t>(count), 0);
  if (count <= kMostExact) return BestOrder(cost);
  std::vector<int> best;
  double least = kInfinity;
  const auto going = [&] { return !keep_going || keep_going(); };
  const int starts = std::clamp(static_cast<int>(kMostChangesLookedAt / (1.0 * count * count * count)), 1,
                                std::min(count, kMostStarts));
  for (int k = 0; k < starts && (k == 0 || going()); ++k) {
    std::vector<int> order = NearestNeighbours(k * count / starts, cost);
    while (going() && Improve(cost, &order)) {
    }
    if (const double travel = TravelOf(order, cost); travel < least) least = travel, best = std::move(order);
  }
  return best;
}

}  // namespace sixpoint::metrology

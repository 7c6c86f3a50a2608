#include "metrology/inspection/instrument_bias.h"

#include <cmath>
#include <map>
#include <utility>

#include "metrology/statistics/distributions.h"
#include "metrology/statistics/spread.h"

namespace sixpoint::metrology {
namespace {

constexpr double kTwoSided95 = 0.975;

// Root mean square of those that are stated; 0 of none.
class Stated {
 public:
  void Add(const std::optional<double>& expanded) {
    if (!expanded) return;
    squares_ += *expanded * *expanded;
    ++count_;
  }
  double square() const { return count_ == 0 ? 0 : squares_ / count_; }
  bool none() const { return count_ == 0; }

 private:
  double squares_ = 0;
  int count_ = 0;
};

InstrumentBias BiasOf(const std::vector<const ValuePair*>& pairs) {
  InstrumentBias bias;
  bias.characteristic = pairs.front()->characteristic;
  bias.feature = pairs.front()->feature;
  std::vector<double> differences;
  Stated ours, theirs;
  for (const ValuePair* pair : pairs) {
    differences.push_back(pair->ours - pair->theirs);
    ours.Add(pair->ours_expanded);
    theirs.Add(pair->theirs_expanded);
    if (!pair->ours_expanded || !pair->theirs_expanded) ++bias.unstated_count;
  }
  const Spread spread = SpreadOf(differences);
  bias.pair_count = spread.count;
  bias.bias = spread.mean;
  double square = ours.square() + theirs.square();
  if (bias.pair_count > 1) {
    bias.standard_deviation = spread.standard_deviation;
    const double of_mean = StudentQuantile(kTwoSided95, bias.pair_count - 1) * spread.mean_standard_uncertainty;
    square += of_mean * of_mean;
  }
  if (bias.pair_count > 1 || !ours.none() || !theirs.none()) bias.expanded_uncertainty = std::sqrt(square);
  // What is not stated only adds to it.
  if (bias.expanded_uncertainty && std::abs(bias.bias) <= *bias.expanded_uncertainty)
    bias.verdict = BiasVerdict::kNotSignificant;
  else if (bias.unstated_count == 0)
    bias.verdict = BiasVerdict::kSignificant;
  return bias;
}

}  // namespace

std::vector<InstrumentBias> BiasesOf(const std::vector<ValuePair>& pairs) {
  std::map<std::pair<std::string, std::string>, std::size_t> place_of;
  std::vector<std::vector<const ValuePair*>> groups;
  for (const ValuePair& pair : pairs) {
    const auto [place, is_new] = place_of.emplace(std::pair(pair.characteristic, pair.feature), groups.size());
    if (is_new) groups.emplace_back();
    groups[place->second].push_back(&pair);
  }
  std::vector<InstrumentBias> biases;
  for (const auto& group : groups) biases.push_back(BiasOf(group));
  return biases;
}

}  // namespace sixpoint::metrology

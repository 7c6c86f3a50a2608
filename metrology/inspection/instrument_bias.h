// Our values beside another instrument's of the same blades: how far ours are off, and with what uncertainty
// (docs/methods/inspection.md, bias to another instrument).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace sixpoint::metrology {

// Of one blade, both in one unit. Of each characteristic and feature a blade has one.
struct ValuePair {
  std::string characteristic, feature, blade;
  double ours = 0, theirs = 0;
  std::optional<double> ours_expanded, theirs_expanded;  // 95 %; none: not stated
};

enum class BiasVerdict {
  kNotSignificant,  // |bias| <= its expanded uncertainty
  kSignificant,     // greater
  kUndecidable      // greater than what is known of its uncertainty, of which a part is not stated
};

// Of one characteristic at one feature, in its unit.
struct InstrumentBias {
  std::string characteristic, feature;
  int pair_count = 0;
  double bias = 0;  // mean of ours - theirs
  // Of the differences, of pair_count - 1 degrees of freedom. None of one pair.
  std::optional<double> standard_deviation;
  // 95 %: of the mean by Student's quantile, and of both instruments the root mean square of what they state, whole: what blades have in
  // common does not show in their scatter. None of one pair of which nothing is stated.
  std::optional<double> expanded_uncertainty;
  int unstated_count = 0;  // pairs of which either instrument states no uncertainty
  BiasVerdict verdict = BiasVerdict::kUndecidable;
};

// In the order in which characteristics and features first stand in the pairs. Values are finite.
std::vector<InstrumentBias> BiasesOf(const std::vector<ValuePair>& pairs);

}  // namespace sixpoint::metrology

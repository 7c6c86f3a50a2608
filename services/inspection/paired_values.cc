#include "services/inspection/paired_values.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "services/inspection/unit_conversion.h"

namespace sixpoint::inspection {
namespace {

using Key = std::tuple<std::string, std::string, std::string>;  // blade, characteristic, feature

std::optional<double> In(plant::v1::CharacteristicUnit unit, const std::string& from,
                         const std::optional<double>& number) {
  const auto conversion = ConversionTo(unit, from);
  return number && conversion ? std::optional<double>(conversion->Of(*number)) : std::nullopt;
}

}  // namespace

std::vector<metrology::ValuePair> PairedValues(const plant::v1::Drawing& drawing, const std::vector<OurValue>& ours,
                                               const std::vector<storage::MeasurementRow>& theirs) {
  std::map<std::string, int> place_of;
  for (int i = 0; i < drawing.characteristics_size(); ++i)
    place_of.emplace(drawing.characteristics(i).characteristic(), i);
  std::map<Key, const OurValue*> newest;
  for (const OurValue& value : ours)
    newest.emplace(Key(value.blade_serial, value.characteristic, value.feature), &value);
  std::map<Key, bool> seen;
  std::vector<std::pair<int, metrology::ValuePair>> pairs;
  for (const storage::MeasurementRow& measurement : theirs)
    for (const storage::MeasuredValueRow& value : measurement.values) {
      if (!value.value) continue;
      const Key key(measurement.blade_serial, value.characteristic, value.feature);
      const auto place = place_of.find(value.characteristic);
      const auto found = newest.find(key);
      if (place == place_of.end() || found == newest.end() || !seen.emplace(key, true).second) continue;
      const auto unit = drawing.characteristics(place->second).unit();
      const OurValue& our = *found->second;
      const auto our_value = In(unit, our.unit, our.value), their_value = In(unit, value.unit, value.value);
      if (!our_value || !their_value) continue;
      pairs.push_back(
          {place->second,
           {value.characteristic, value.feature, measurement.blade_serial,
            value.zone == "HALF_WIDTH" ? std::abs(*our_value) : *our_value, *their_value,
            In(unit, our.unit, our.expanded_uncertainty), In(unit, value.unit, value.expanded_uncertainty)}});
    }
  std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<metrology::ValuePair> ordered;
  for (auto& [place, pair] : pairs) ordered.push_back(std::move(pair));
  return ordered;
}

}  // namespace sixpoint::inspection

#include "services/inspection/compare_measurements.h"

#include <map>
#include <string>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

constexpr std::size_t kMostPairs = 20000;

v1::BiasVerdict BiasVerdictOf(metrology::BiasVerdict verdict) {
  switch (verdict) {
    case metrology::BiasVerdict::kNotSignificant:
      return v1::BIAS_VERDICT_NOT_SIGNIFICANT;
    case metrology::BiasVerdict::kSignificant:
      return v1::BIAS_VERDICT_SIGNIFICANT;
    case metrology::BiasVerdict::kUndecidable:
      break;
  }
  return v1::BIAS_VERDICT_UNDECIDABLE;
}

void Fill(const metrology::ValuePair& pair, v1::ComparedValue* out) {
  out->set_blade(runtime::NameOf("blades", pair.blade));
  out->set_ours(pair.ours);
  out->set_theirs(pair.theirs);
  if (pair.ours_expanded) out->set_ours_expanded_uncertainty(*pair.ours_expanded);
  if (pair.theirs_expanded) out->set_theirs_expanded_uncertainty(*pair.theirs_expanded);
}

void Fill(const metrology::InstrumentBias& bias, const plant::v1::Characteristic& drawn, v1::InstrumentBias* out) {
  out->set_characteristic(bias.characteristic);
  out->set_feature(bias.feature);
  out->set_name(drawn.name());
  out->set_unit(drawn.unit());
  out->set_bias(bias.bias);
  if (bias.expanded_uncertainty) out->set_expanded_uncertainty(*bias.expanded_uncertainty);
  if (bias.standard_deviation) out->set_standard_deviation(*bias.standard_deviation);
  out->set_verdict(BiasVerdictOf(bias.verdict));
  out->set_unstated_count(bias.unstated_count);
}

}  // namespace

absl::StatusOr<v1::CompareMeasurementsResponse> ComparedMeasurements(
    const plant::v1::Drawing& drawing, const std::vector<OurValue>& ours,
    const std::vector<storage::MeasurementRow>& theirs) {
  const std::vector<metrology::ValuePair> pairs = PairedValues(drawing, ours, theirs);
  if (pairs.size() > kMostPairs)
    return runtime::Refuse("recorded", std::to_string(pairs.size()) + " pairs",
                           "an instrument or a time with at most " + std::to_string(kMostPairs));
  std::map<std::string, const plant::v1::Characteristic*> drawn;
  for (const plant::v1::Characteristic& one : drawing.characteristics()) drawn.emplace(one.characteristic(), &one);
  v1::CompareMeasurementsResponse response;
  response.set_drawing(runtime::RevisedName("drawings", runtime::LastSegment(drawing.name()), drawing.revision()));
  std::map<std::pair<std::string, std::string>, v1::InstrumentBias*> out_of;
  for (const metrology::InstrumentBias& bias : metrology::BiasesOf(pairs)) {
    v1::InstrumentBias* const out = response.add_biases();
    Fill(bias, *drawn.at(bias.characteristic), out);
    out_of[{bias.characteristic, bias.feature}] = out;
  }
  for (const metrology::ValuePair& pair : pairs)
    Fill(pair, out_of.at({pair.characteristic, pair.feature})->add_pairs());
  return response;
}

}  // namespace sixpoint::inspection

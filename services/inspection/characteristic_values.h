// What a recorded result has of a drawing's characteristics, in the characteristic's unit: pure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "services/inspection/drawing_orders.h"
#include "sixpoint/inspection/v1/deviation.pb.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/inspection/v1/measurement.pb.h"
#include "sixpoint/inspection/v1/section.pb.h"
#include "sixpoint/plant/v1/part.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::inspection {

// A result and the registration that it rests on.
struct AssessedResult {
  std::variant<v1::Inspection, v1::DeviationMap, v1::SectionMeasurement, v1::Measurement> result;
  registration::v1::Registration registration;  // of another instrument's measurement: unset
  // Where in the result a hole ("group/hole"), a pitch ("group/from to to") or a measured characteristic ("balloon/feature") stands.
  std::map<std::string, int> places = {};

  // Once the result is set.
  void IndexPlaces();
  const std::string& name() const;
  const std::string& blade() const;
  registration::v1::Method method() const;  // unspecified of another instrument's measurement
};

// Where a characteristic is measured: once, or at each hole of its group.
struct Feature {
  std::string feature = {};  // "h3", "h3 to h4"; empty: at one place
  std::string hole = {}, to_hole = {};
  // How much longer a way on the surface is than across the axis, at the hole and at the other one.
  double slant = 1, to_slant = 1;
};
std::vector<Feature> FeaturesOf(const plant::v1::Characteristic& characteristic, const plant::v1::Part& part);

struct ValueWithUncertainty {
  double value = 0;
  std::optional<double> expanded_uncertainty = {};  // none: its instrument states none
};

// What a result has of a characteristic at one feature.
struct FoundValue {
  std::optional<double> nominal;
  std::vector<ValueWithUncertainty> values;  // of a profile the least and the greatest; empty: not measured, see reason
  std::string reason;
  // Where the result judged it already, by the same rule and more than these values: patch by patch.
  std::optional<v1::Verdict> verdict;
  // How far the value may be off beyond its uncertainty, and why: a verdict that this could change is none.
  double open_by = 0;
  std::string open_reason;
};

// None where the result has no such thing: it is of another kind, or was ordered otherwise.
std::optional<FoundValue> ValueIn(const AssessedResult& result, const plant::v1::Drawing& drawing,
                                  const plant::v1::Characteristic& characteristic, const Feature& feature,
                                  const plant::v1::Part& part);

// Of each kind of result, for the above.
std::optional<FoundValue> HoleValueIn(const AssessedResult& inspection, const plant::v1::Characteristic& characteristic,
                                      const Feature& feature, const plant::v1::Part& part);
std::optional<FoundValue> ProfileIn(const v1::DeviationMap& map, const plant::v1::Drawing& drawing,
                                    const plant::v1::Characteristic& characteristic);
std::optional<FoundValue> SectionValueIn(const v1::SectionMeasurement& sections, const plant::v1::Drawing& drawing,
                                         const plant::v1::Characteristic& characteristic);

std::optional<FoundValue> MeasuredValueIn(const AssessedResult& measurement,
                                          const plant::v1::Characteristic& characteristic, const Feature& feature);

// Units of the characteristic in a millimetre; of an angle or a ratio 1.
double PerMillimetre(const plant::v1::Characteristic& characteristic);

// Whether a result is positioned as a datum system wants it; none where no fit makes that.
bool IsOf(const AssessedResult& result, const DatumFit& fit);

}  // namespace sixpoint::inspection

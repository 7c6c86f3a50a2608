// A drawing's characteristics at their features, and which of them a name in another instrument's file means.
#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sixpoint/plant/v1/drawing.pb.h"
#include "sixpoint/plant/v1/part.pb.h"

namespace sixpoint::inspection {

// One characteristic at one feature.
struct DrawnPlace {
  int characteristic = 0;         // index in the drawing
  std::size_t feature_index = 0;  // in the order of the part's holes
  std::string feature;            // "h3"; "h3 to h4" of a pitch; empty: it is at one place

  friend bool operator<(const DrawnPlace& a, const DrawnPlace& b) {
    return a.characteristic != b.characteristic ? a.characteristic < b.characteristic
                                                : a.feature_index < b.feature_index;
  }
};

class DrawnCharacteristics {
 public:
  // The drawing lives longer. parts: the revisions that it is valid for; a hole of any of them is a feature.
  DrawnCharacteristics(const plant::v1::Drawing& drawing, const std::vector<plant::v1::Part>& parts);

  // By its balloon's number or, of MEASURED_ELSEWHERE, its name, with the feature beside it, behind a slash ("17/h3") or, where there is one,
  // nowhere; or as our exports call holes' values ("G1/h3/position"). None: the drawing has no such characteristic. INVALID_ARGUMENT: it has,
  // but not at such a feature, or several are meant.
  absl::StatusOr<std::optional<DrawnPlace>> Find(const std::string& name, const std::string& feature) const;

  const plant::v1::Characteristic& At(const DrawnPlace& place) const {
    return drawing_.characteristics(place.characteristic);
  }

 private:
  // In the part's order, each with its place there.
  using Features = std::map<std::string, std::size_t>;

  const Features* GroupOf(const plant::v1::Characteristic& one) const;
  std::optional<DrawnPlace> PlaceAt(int characteristic, const std::string& feature) const;
  absl::StatusOr<DrawnPlace> OnlyPlaceOf(int characteristic) const;
  std::vector<int> Named(const std::string& name) const;
  absl::StatusOr<std::optional<DrawnPlace>> FindExported(const std::string& name) const;

  const plant::v1::Drawing& drawing_;
  std::map<std::string, int> by_balloon_, by_name_;
  std::map<std::string, Features> holes_, pitches_;  // by group
};

}  // namespace sixpoint::inspection

#include "services/inspection/drawn_characteristics.h"

#include <utility>

#include "refusal/refusal.h"

namespace sixpoint::inspection {
namespace {

using plant::v1::Characteristic;

// A name of a characteristic and two holes; what is longer is none.
constexpr std::size_t kMostDrawnNameBytes = 400;

bool IsPitch(const Characteristic& one) {
  return one.quantity() == plant::v1::CHARACTERISTIC_QUANTITY_HOLE_PITCH ||
         one.quantity() == plant::v1::CHARACTERISTIC_QUANTITY_HOLE_PITCH_OVER_DIAMETER;
}

std::string PairText(const std::string& hole, const std::string& to_hole) { return hole + " to " + to_hole; }

// The one feature of a characteristic that says it itself; none: it is at each of its group.
std::optional<std::string> OwnFeature(const Characteristic& one) {
  if (one.hole_group().empty()) return "";
  if (one.hole().empty()) return std::nullopt;
  return IsPitch(one) ? PairText(one.hole(), one.to_hole()) : one.hole();
}

}  // namespace

DrawnCharacteristics::DrawnCharacteristics(const plant::v1::Drawing& drawing, const std::vector<plant::v1::Part>& parts)
    : drawing_(drawing) {
  for (int i = 0; i < drawing.characteristics_size(); ++i) {
    const Characteristic& one = drawing.characteristics(i);
    by_balloon_.emplace(one.characteristic(), i);
    if (one.quantity() == plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE) by_name_.emplace(one.name(), i);
  }
  for (const plant::v1::Part& part : parts)
    for (const plant::v1::HoleGroup& group : part.hole_groups()) {
      Features &holes = holes_[group.group()], &pitches = pitches_[group.group()];
      for (int i = 0; i < group.holes_size(); ++i) {
        holes.emplace(group.holes(i).hole(), holes.size());
        if (i > 0) pitches.emplace(PairText(group.holes(i - 1).hole(), group.holes(i).hole()), pitches.size());
      }
    }
}

const DrawnCharacteristics::Features* DrawnCharacteristics::GroupOf(const Characteristic& one) const {
  const auto& groups = IsPitch(one) ? pitches_ : holes_;
  const auto found = groups.find(one.hole_group());
  return found == groups.end() ? nullptr : &found->second;
}

std::optional<DrawnPlace> DrawnCharacteristics::PlaceAt(int characteristic, const std::string& feature) const {
  const Characteristic& one = drawing_.characteristics(characteristic);
  if (const auto own = OwnFeature(one))
    return *own == feature ? std::optional<DrawnPlace>({characteristic, 0, feature}) : std::nullopt;
  const Features* const all = GroupOf(one);
  if (all == nullptr) return std::nullopt;
  const auto found = all->find(feature);
  if (found == all->end()) return std::nullopt;
  return DrawnPlace{characteristic, found->second, feature};
}

absl::StatusOr<DrawnPlace> DrawnCharacteristics::OnlyPlaceOf(int characteristic) const {
  const Characteristic& one = drawing_.characteristics(characteristic);
  if (const auto own = OwnFeature(one)) return DrawnPlace{characteristic, 0, *own};
  const Features* const all = GroupOf(one);
  if (all != nullptr && all->size() == 1) return DrawnPlace{characteristic, 0, all->begin()->first};
  return Refuse("feature", "", (IsPitch(one) ? "two neighbours, \"h1 to h2\", of " : "a hole of ") + one.hole_group());
}

// By its balloon's number, and by what its import calls it.
std::vector<int> DrawnCharacteristics::Named(const std::string& name) const {
  std::vector<int> found;
  for (const auto* names : {&by_balloon_, &by_name_})
    if (const auto one = names->find(name); one != names->end() && (found.empty() || found.front() != one->second))
      found.push_back(one->second);
  return found;
}

absl::StatusOr<std::optional<DrawnPlace>> DrawnCharacteristics::FindExported(const std::string& name) const {
  const std::size_t last = name.rfind('/'), first = name.find('/');
  if (last == std::string::npos || first == last) return std::optional<DrawnPlace>();
  const std::string what = name.substr(last + 1);
  plant::v1::CharacteristicQuantity quantity = plant::v1::CHARACTERISTIC_QUANTITY_UNSPECIFIED;
  if (what == "position") quantity = plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION;
  if (what == "inclination") quantity = plant::v1::CHARACTERISTIC_QUANTITY_HOLE_INCLINATION;
  if (quantity == plant::v1::CHARACTERISTIC_QUANTITY_UNSPECIFIED) return std::optional<DrawnPlace>();
  const std::string group = name.substr(0, first), hole = name.substr(first + 1, last - first - 1);
  std::optional<DrawnPlace> found;
  for (int i = 0; i < drawing_.characteristics_size(); ++i) {
    const Characteristic& one = drawing_.characteristics(i);
    if (one.quantity() != quantity || one.hole_group() != group) continue;
    const auto place = PlaceAt(i, hole);
    if (place && found)
      return Refuse("characteristic", name,
                    "a balloon's number: it may be " + At(*found).characteristic() + " or " + one.characteristic());
    if (place) found = place;
  }
  return found;
}

absl::StatusOr<std::optional<DrawnPlace>> DrawnCharacteristics::Find(const std::string& name,
                                                                     const std::string& feature) const {
  if (name.size() > kMostDrawnNameBytes) return std::optional<DrawnPlace>();
  const std::vector<int> named = Named(name);
  if (named.size() > 1)
    return Refuse("characteristic", name,
                  "what one alone is called: " + drawing_.characteristics(named[0]).characteristic() + " and " +
                      drawing_.characteristics(named[1]).characteristic() + " are");
  if (!named.empty() && feature.empty()) {
    absl::StatusOr<DrawnPlace> place = OnlyPlaceOf(named.front());
    if (!place.ok()) return place.status();
    return std::optional<DrawnPlace>(*std::move(place));
  }
  if (!named.empty()) {
    std::optional<DrawnPlace> place = PlaceAt(named.front(), feature);
    if (place) return place;
    const auto only = OnlyPlaceOf(named.front());
    const std::string wanted = !only.ok()              ? ViolationsOf(only.status()).front().wanted
                               : only->feature.empty() ? "none: it is at one place"
                                                       : only->feature;
    return Refuse("feature", feature, wanted);
  }
  if (!feature.empty()) return std::optional<DrawnPlace>();
  for (std::size_t slash = name.rfind('/'); slash != std::string::npos && slash > 0; slash = name.rfind('/', slash - 1))
    for (const int one : Named(name.substr(0, slash)))
      if (auto place = PlaceAt(one, name.substr(slash + 1))) return place;
  return FindExported(name);
}

}  // namespace sixpoint::inspection

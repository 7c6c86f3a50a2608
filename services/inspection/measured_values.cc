#include "services/inspection/measured_values.h"

#include <absl/strings/ascii.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "refusal/message_text.h"
#include "refusal/refusal.h"
#include "services/inspection/unit_conversion.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

using exchange::MeasuredRow;
using plant::v1::Characteristic;
using storage::MeasuredValueRow;

constexpr double kGreatestValue = 1e9;
constexpr std::size_t kMostLeftOut = 200, kMostNameBytes = 200, kMostReasonBytes = 1000;

const char* WantedOf(plant::v1::CharacteristicUnit unit) {
  return unit == plant::v1::CHARACTERISTIC_UNIT_DEG     ? "deg"
         : unit == plant::v1::CHARACTERISTIC_UNIT_RATIO ? "ratio"
                                                        : "mm or um";
}

// What a value of that quantity is the size of.
enum class ZoneKind { kNone, kRound, kWide, kAsItIs };
ZoneKind ZoneKindOf(const Characteristic& one) {
  switch (one.quantity()) {
    case plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION:
      return ZoneKind::kRound;
    case plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM:
    case plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION:
    case plant::v1::CHARACTERISTIC_QUANTITY_SECTION_PROFILE_FORM:
    case plant::v1::CHARACTERISTIC_QUANTITY_SECTION_PROFILE_FORM_AND_LOCATION:
      return ZoneKind::kWide;
    case plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE:
      return ZoneKind::kAsItIs;
    default:
      return ZoneKind::kNone;
  }
}

struct StatedZone {
  std::string kept;       // RADIUS, HALF_WIDTH, BORDERS; empty: no zone's
  bool is_whole = false;  // value and uncertainty are halved
};

absl::StatusOr<StatedZone> ZoneOf(const Characteristic& one, const std::string& written,
                                  const FileStatement& statement) {
  const std::string told = absl::AsciiStrToUpper(written);  // people write radius
  const ZoneKind kind = ZoneKindOf(one);
  if (kind == ZoneKind::kAsItIs) return StatedZone();
  if (kind == ZoneKind::kNone) {
    if (told.empty()) return StatedZone();
    return Refuse("zone", told, "none: " + one.characteristic() + " has no zone");
  }
  const bool round = kind == ZoneKind::kRound;
  const std::string& zone = told.empty() ? (round ? statement.position_zone : statement.profile_zone) : told;
  if (round && zone == "DIAMETER") return StatedZone{"RADIUS", true};
  if (round && zone == "RADIUS") return StatedZone{zone, false};
  if (!round && zone == "WIDTH") return StatedZone{"HALF_WIDTH", true};
  if (!round && (zone == "HALF_WIDTH" || zone == "BORDERS")) return StatedZone{zone, false};
  return Refuse("zone", zone,
                round ? "DIAMETER or RADIUS, in the file or as position_zone: half or whole is not guessed"
                      : "WIDTH, HALF_WIDTH or BORDERS, in the file or as profile_zone: half or whole is not guessed");
}

std::optional<double> StatedFor(plant::v1::CharacteristicUnit unit, const FileStatement& statement) {
  if (unit == plant::v1::CHARACTERISTIC_UNIT_DEG) return statement.angles_expanded_uncertainty_deg;
  if (!statement.lengths_expanded_uncertainty_um) return std::nullopt;
  if (unit == plant::v1::CHARACTERISTIC_UNIT_UM) return statement.lengths_expanded_uncertainty_um;
  if (unit == plant::v1::CHARACTERISTIC_UNIT_MM) return *statement.lengths_expanded_uncertainty_um / 1000;
  return std::nullopt;
}

absl::StatusOr<MeasuredValueRow> ValueOf(const MeasuredRow& row, const Characteristic& one, const std::string& feature,
                                         const FileStatement& statement) {
  const auto conversion = ConversionTo(one.unit(), row.unit);
  const auto zone = ZoneOf(one, row.zone, statement);
  Refusals refusals;
  if (!conversion) refusals.Add(Refuse("unit", row.unit, WantedOf(one.unit())));
  refusals.Add(zone.status());
  if (!refusals.status().ok()) return refusals.status();
  MeasuredValueRow value;
  value.characteristic = one.characteristic();
  value.feature = feature;
  value.unit = plant::v1::CharacteristicUnit_Name(one.unit()).substr(std::string("CHARACTERISTIC_UNIT_").size());
  value.zone = zone->kept;
  value.reason = Tame(row.reason, kMostReasonBytes);
  if (!row.value) return value;
  const double half = zone->is_whole ? 0.5 : 1;
  value.value = conversion->Of(*row.value) * half;
  if (row.expanded_uncertainty) value.expanded_uncertainty = conversion->Of(*row.expanded_uncertainty) * half;
  if (!value.expanded_uncertainty) value.expanded_uncertainty = StatedFor(one.unit(), statement);
  const bool never_negative = zone->kept == "RADIUS" || zone->kept == "HALF_WIDTH";
  if (!(std::abs(*value.value) < kGreatestValue) || (never_negative && *value.value < 0))
    refusals.Add(Refuse("value", *row.value, never_negative ? "0 or more, below 1e9" : "less than 1e9 either way"));
  if (value.expanded_uncertainty && !(*value.expanded_uncertainty >= 0 && *value.expanded_uncertainty < kGreatestValue))
    refusals.Add(Refuse("expanded_uncertainty", *value.expanded_uncertainty, "0 or more, below 1e9"));
  if (!refusals.status().ok()) return refusals.status();
  return value;
}

// The measurements while a file is read.
class Blades {
 public:
  Blades(const DrawnCharacteristics& drawn, const FileStatement& statement) : drawn_(drawn), statement_(statement) {}

  absl::Status Add(const MeasuredRow& row) {
    const std::string& serial = row.serial.empty() ? statement_.serial : row.serial;
    if (serial.empty()) return Refuse("serial", "", "a serial number in the file, or `blade`");
    if (!statement_.serial.empty() && serial != statement_.serial)
      return Refuse("serial", serial, statement_.serial + ", the `blade` that was stated");
    if (const absl::Status is_id = runtime::CheckId("serial", serial); !is_id.ok()) return is_id;
    const auto place = drawn_.Find(row.characteristic, row.feature);
    if (!place.ok()) return place.status();
    if (!place->has_value() && !statement_.only_drawn)
      return Refuse("characteristic", row.feature.empty() ? row.characteristic : row.characteristic + " " + row.feature,
                    "one of the drawing, or only_drawn to leave it out");
    const auto blade = BladeOf(serial);
    if (!blade.ok()) return blade.status();
    if (const auto& at = row.measured_at; at && (!(*blade)->measured_at || *(*blade)->measured_at < *at))
      (*blade)->measured_at = at;
    if (!place->has_value()) {
      LeaveOut(row, *blade);
      return absl::OkStatus();
    }
    auto value = ValueOf(row, drawn_.At(**place), (*place)->feature, statement_);
    if (!value.ok()) return value.status();
    if ((*blade)->values.size() >= kMostValuesOfBlade)
      return Refuse("values", "more", "at most " + std::to_string(kMostValuesOfBlade) + " of a blade");
    if (!(*blade)->values.emplace(**place, *std::move(value)).second)
      return Refuse("characteristic", row.characteristic + (row.feature.empty() ? "" : " " + row.feature),
                    "each once of " + serial);
    return absl::OkStatus();
  }

  absl::StatusOr<std::vector<storage::MeasurementRow>> Take() {
    std::vector<storage::MeasurementRow> rows;
    Refusals refusals;
    for (Blade& blade : blades_) {
      storage::MeasurementRow row;
      row.blade_serial = blade.serial;
      const auto measured_at = blade.measured_at ? blade.measured_at : statement_.measured_at;
      if (!measured_at)
        refusals.Add(Refuse("measured_at", "", "when " + blade.serial + " was measured: the file does not tell"));
      if (blade.values.empty())
        refusals.Add(Refuse("content", "no value of " + blade.serial, "at least one that the drawing asks for"));
      row.measured_at = measured_at.value_or(std::chrono::system_clock::time_point());
      for (auto& [place, value] : blade.values) row.values.push_back(std::move(value));
      storage::CountValues(&row);
      row.left_out = std::move(blade.left_out);
      row.left_out_count = blade.left_out_count;
      rows.push_back(std::move(row));
    }
    if (!refusals.status().ok()) return refusals.status();
    return rows;
  }

 private:
  struct Blade {
    std::string serial;
    std::optional<std::chrono::system_clock::time_point> measured_at;
    std::map<DrawnPlace, MeasuredValueRow> values;
    std::vector<std::string> left_out;
    int left_out_count = 0;
  };

  absl::StatusOr<Blade*> BladeOf(const std::string& serial) {
    const auto [known, is_new] = by_serial_.emplace(serial, blades_.size());
    if (is_new) {
      if (blades_.size() >= kMostBladesOfFile)
        return Refuse("serial", serial, "at most " + std::to_string(kMostBladesOfFile) + " blades in a file");
      blades_.emplace_back().serial = serial;
    }
    return &blades_[known->second];
  }

  static void LeaveOut(const MeasuredRow& row, Blade* blade) {
    ++blade->left_out_count;
    std::string name = Tame(row.characteristic + (row.feature.empty() ? "" : " " + row.feature), kMostNameBytes);
    if (blade->left_out.size() < kMostLeftOut) blade->left_out.push_back(std::move(name));
  }

  const DrawnCharacteristics& drawn_;
  const FileStatement& statement_;
  std::vector<Blade> blades_;
  std::map<std::string, std::size_t> by_serial_;
};

}  // namespace

absl::StatusOr<std::vector<storage::MeasurementRow>> MeasuredBlades(const std::vector<MeasuredRow>& rows,
                                                                    const DrawnCharacteristics& drawn,
                                                                    const FileStatement& statement) {
  Blades blades(drawn, statement);
  Refusals refusals;
  for (const MeasuredRow& row : rows) refusals.Add(Under(row.at + ": ", blades.Add(row)));
  if (!refusals.status().ok()) return refusals.status();
  return blades.Take();
}

}  // namespace sixpoint::inspection

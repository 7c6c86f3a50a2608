#include "exchange/measured_file.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "exchange/aqdef.h"
#include "exchange/csv.h"
#include "exchange/csv_rows.h"
#include "exchange/qif.h"
#include "exchange/text.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {
namespace {

using std::chrono::system_clock;

// A file tells each of its values once for all of its parts: what they take is bounded, not the file alone.
constexpr std::size_t kMostCells = 5 * kMostMeasuredRows;
constexpr char kNumberWithPoint[] = "a finite number with a decimal point";
constexpr char kNoValue[] = "the file has no value";
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

struct MeasuredColumn {
  enum Index { kSerial, kCharacteristic, kFeature, kValue, kUnit, kUncertainty, kMeasuredAt, kZone, kReason, kColumns };
};
constexpr std::array<const char*, MeasuredColumn::kColumns> kNames = {
    "serial", "characteristic", "feature", "value", "unit", "expanded_uncertainty", "measured_at", "zone", "reason"};

absl::Status TooManyRows() { return Refuse("file", "more values", "at most " + std::to_string(kMostMeasuredRows)); }

// Where each column stands in a row.
class Head {
 public:
  static absl::StatusOr<Head> Read(const std::vector<std::string>& cells) {
    std::string all;
    for (const char* name : kNames) all += (all.empty() ? "" : ", ") + std::string(name);
    if (cells.size() == 1 && cells.front().find_first_of(";\t") != std::string::npos)
      return Refuse("head", cells.front(), "columns parted by commas, numbers with decimal points");
    Head head;
    head.count_ = cells.size();
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string_view name = Trimmed(cells[i]);
      const auto known = std::find(kNames.begin(), kNames.end(), name);
      if (known == kNames.end()) return Refuse("head", std::string(name), "columns named " + all);
      std::optional<std::size_t>& place = head.places_[static_cast<std::size_t>(known - kNames.begin())];
      if (place) return Refuse("head", std::string(name), "each column once");
      place = i;
    }
    for (const MeasuredColumn::Index needed :
         {MeasuredColumn::kCharacteristic, MeasuredColumn::kValue, MeasuredColumn::kUnit})
      if (!head.places_[needed]) return Refuse("head", "", std::string("the column ") + kNames[needed]);
    return head;
  }
  std::size_t count() const { return count_; }
  std::string Text(const std::vector<std::string>& cells, MeasuredColumn::Index column) const {
    return places_[column] ? std::string(Trimmed(Unguarded(cells[*places_[column]]))) : "";
  }

 private:
  std::size_t count_ = 0;
  std::array<std::optional<std::size_t>, MeasuredColumn::kColumns> places_;
};

absl::StatusOr<MeasuredRow> RowOf(const Head& head, const std::vector<std::string>& cells) {
  MeasuredRow row;
  Refusals refusals;
  for (int column = 0; column < MeasuredColumn::kColumns; ++column)
    if (const std::string text = head.Text(cells, static_cast<MeasuredColumn::Index>(column)); !IsPlainText(text))
      refusals.Add(Refuse(kNames[static_cast<std::size_t>(column)], text, "UTF-8 without control characters"));
  row.serial = head.Text(cells, MeasuredColumn::kSerial);
  row.characteristic = head.Text(cells, MeasuredColumn::kCharacteristic);
  row.feature = head.Text(cells, MeasuredColumn::kFeature);
  row.unit = head.Text(cells, MeasuredColumn::kUnit);
  row.zone = head.Text(cells, MeasuredColumn::kZone);
  row.reason = head.Text(cells, MeasuredColumn::kReason);
  if (row.characteristic.empty()) refusals.Add(Refuse("characteristic", "", "what the value is of"));
  // What stands in a cell with a sign before it is a number, and no formula.
  refusals.Add(ReadNumber("value", head.Text(cells, MeasuredColumn::kValue), kNumberWithPoint, &row.value));
  refusals.Add(ReadNumber("expanded_uncertainty", head.Text(cells, MeasuredColumn::kUncertainty), kNumberWithPoint,
                          &row.expanded_uncertainty));
  if (row.expanded_uncertainty && !(*row.expanded_uncertainty >= 0))
    refusals.Add(Refuse("expanded_uncertainty", *row.expanded_uncertainty, ">= 0"));
  if (const std::string text = head.Text(cells, MeasuredColumn::kMeasuredAt); !text.empty()) {
    row.measured_at = TimeOf(text);
    if (!row.measured_at) refusals.Add(Refuse("measured_at", text, "a time by RFC 3339"));
  }
  if (row.value && !row.reason.empty()) refusals.Add(Refuse("reason", row.reason, "none beside a value"));
  if (!row.value) row.expanded_uncertainty = std::nullopt;
  if (!row.value && row.reason.empty()) row.reason = kNoValue;
  if (!refusals.status().ok()) return refusals.status();
  return row;
}

absl::StatusOr<std::vector<MeasuredRow>> ReadCsvRows(std::string_view file) {
  const auto first = NextCsvRow(&file, 2 * MeasuredColumn::kColumns);
  if (!first.ok()) return Under("head: ", first.status());
  const auto head = Head::Read(*first);
  if (!head.ok()) return head.status();
  std::vector<MeasuredRow> rows;
  for (std::size_t line = 1; !file.empty(); ++line) {
    const std::string at = "row " + std::to_string(line);
    if (rows.size() == kMostMeasuredRows) return TooManyRows();
    const auto cells = NextCsvRow(&file, 4 * MeasuredColumn::kColumns);
    if (!cells.ok()) return Under(at + ": ", cells.status());
    if (cells->size() == 1 && Trimmed(cells->front()).empty() && head->count() > 1) continue;  // an empty line
    if (cells->size() != head->count())
      return Under(at + ": ", Refuse("cells", std::to_string(cells->size()),
                                     std::to_string(head->count()) +
                                         " of them, as the head has; numbers have decimal points, and no commas"));
    auto row = RowOf(*head, *cells);
    if (!row.ok()) return Under(at + ": ", row.status());
    row->at = at;
    rows.push_back(*std::move(row));
  }
  return rows;
}

// Of our own exports, positions are distances, and so are profiles about the CAD. QIF's are the whole of a zone, which its reader halves.
void SetZone(const Characteristic& c, bool is_qif, MeasuredRow* row) {
  const bool between_limits = c.lower && c.upper && *c.lower != -*c.upper;
  if (c.kind != Characteristic::Kind::kPosition && c.kind != Characteristic::Kind::kProfile) return;
  const bool position = c.kind == Characteristic::Kind::kPosition;
  row->zone =
      position ? (is_qif ? "DIAMETER" : "RADIUS") : (between_limits ? "BORDERS" : (is_qif ? "WIDTH" : "HALF_WIDTH"));
  if (!is_qif || row->zone == "BORDERS") return;
  for (std::optional<double>* number : {&row->value, &row->expanded_uncertainty})
    if (*number) *number = 2 * **number;
}

MeasuredRow RowOf(const InspectedPart& part, std::size_t i, bool is_qif) {
  const Characteristic& c = part.characteristics[i];
  const MeasuredValue& v = part.values[i];
  MeasuredRow row;
  row.at = part.serial.empty() ? c.name : part.serial + ": " + c.name;
  row.serial = part.serial;
  row.characteristic = c.name;
  row.unit = c.unit;
  row.value = v.value;
  row.expanded_uncertainty = v.expanded_uncertainty;
  SetZone(c, is_qif, &row);
  if (part.recorded_at != system_clock::time_point()) row.measured_at = part.recorded_at;
  if (row.value && v.does_not_count) {
    row.reason = v.reason + ": the value " + NumberText(*row.value) + " does not count";
    row.value = row.expanded_uncertainty = std::nullopt;
  } else if (!row.value) {
    row.reason = v.reason.empty() ? kNoValue : v.reason;
  }
  return row;
}

// only_said: of AQDEF each moment is a part of its own, whose other characteristics the file does not speak of.
absl::StatusOr<std::vector<MeasuredRow>> RowsOf(const std::vector<InspectedPart>& parts, bool is_qif,
                                                bool only_said = false) {
  std::vector<MeasuredRow> rows;
  for (const InspectedPart& part : parts)
    for (std::size_t i = 0; i < part.values.size(); ++i) {
      if (only_said && !part.values[i].value && part.values[i].reason.empty()) continue;
      if (rows.size() == kMostMeasuredRows) return TooManyRows();
      rows.push_back(RowOf(part, i, is_qif));
    }
  return rows;
}

absl::StatusOr<std::vector<MeasuredRow>> ReadRows(MeasuredFormat format, std::string_view file) {
  if (format == MeasuredFormat::kQif) {
    auto part = FromQif(file);
    if (!part.ok()) return part.status();
    return RowsOf({*std::move(part)}, true);
  }
  if (format == MeasuredFormat::kAqdef) {
    const auto parts = FromAqdef(file, kMostCells);
    if (!parts.ok()) return parts.status();
    return RowsOf(*parts, false, true);
  }
  if (file.substr(0, kByteOrderMark.size()) == kByteOrderMark) file.remove_prefix(kByteOrderMark.size());
  const std::string ours = CsvHead();
  const std::string_view names = std::string_view(ours).substr(0, ours.size() - 2);
  if (file.substr(0, names.size()) != names) return ReadCsvRows(file);
  const auto parts = FromCsv(file, kMostMeasuredRows);
  if (!parts.ok()) return parts.status();
  return RowsOf(*parts, false);
}

}  // namespace

absl::StatusOr<std::vector<MeasuredRow>> ReadMeasuredFile(MeasuredFormat format, std::string_view file) {
  if (file.empty() || file.size() > kMostMeasuredBytes)
    return Refuse("file", std::to_string(file.size()) + " bytes", "1 to " + std::to_string(kMostMeasuredBytes));
  auto rows = ReadRows(format, file);
  if (rows.ok() && rows->empty()) return Refuse("file", "no value", "at least one");
  return rows;
}

}  // namespace sixpoint::exchange

#include <algorithm>
#include <cstdio>
#include <set>
#include <utility>

#include "exchange/aqdef.h"
#include "exchange/aqdef_keys.h"
#include "exchange/text.h"
#include "exchange/verdicts.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {
namespace {

using aqdef::Key;
constexpr char kDecimalsShown[] = "4";  // 0.1 um; the values keep all that they have

absl::Status CheckTogether(const std::vector<InspectedPart>& parts) {
  if (parts.empty()) return Refuse("parts", "", "one or more");
  const InspectedPart& first = parts.front();
  std::set<std::pair<std::string, std::string>> seen;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const std::string at = "parts[" + std::to_string(p) + "].";
    const InspectedPart& part = parts[p];
    if (const absl::Status status = Check(part); !status.ok()) return Under(at, status);
    if (part.part != first.part || part.part_revision != first.part_revision)
      return Refuse(at + "part", part.part + " revision " + std::to_string(part.part_revision),
                    first.part + " revision " + std::to_string(first.part_revision) + " as the first");
    if (!SameCharacteristics(part, first)) return Refuse(at + "characteristics", "others", "the same as of the first");
    if (!seen.emplace(part.serial, DottedTimeText(part.recorded_at)).second)
      return Refuse(at + "serial", part.serial, "each serial number once a second");
  }
  return absl::OkStatus();
}

class Writer {
 public:
  void Count(std::size_t count) { Append("K0100 " + std::to_string(count)); }

  // Nothing where the text is empty.
  void Text(const Key& key, std::size_t index, const std::string& text) {
    if (text.empty()) return;
    const bool one_line = std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
    if (!one_line || text.front() == ' ' || text.back() == ' ')
      refusals_.Add(Refuse(Name(key), text, "ASCII on one line, no blank before or after it"));
    else if (key.longest > 0 && text.size() > key.longest)
      refusals_.Add(Refuse(Name(key), text, "at most " + std::to_string(key.longest) + " characters"));
    Append(Name(key) + "/" + std::to_string(index) + " " + text);
  }
  // What a value does not need: left out where it is longer than its field.
  void TextIfItFits(const Key& key, std::size_t index, const std::string& text) {
    if (text.size() <= key.longest) Text(key, index, text);
  }
  void Number(const Key& key, std::size_t index, const std::optional<double>& number) {
    if (number) Text(key, index, DecimalText(*number));
  }

  absl::StatusOr<std::string> Take() {
    if (const absl::Status status = refusals_.status(); !status.ok()) return status;
    return std::move(file_);
  }

 private:
  static std::string Name(const Key& key) {
    char name[16];
    std::snprintf(name, sizeof name, "K%04d", key.number);
    return name;
  }
  void Append(const std::string& line) { file_ += line + "\r\n"; }

  std::string file_;
  Refusals refusals_;
};

void WriteCharacteristic(Writer* writer, const Characteristic& c, std::size_t number_in_part, std::size_t index) {
  writer->Text({2000, 0}, index, std::to_string(number_in_part));
  writer->Text(aqdef::kNumber, index, std::to_string(number_in_part));
  writer->Text(aqdef::kName, index, c.name);
  writer->Text(aqdef::kType, index, "0");
  writer->Text(aqdef::kDecimals, index, kDecimalsShown);
  writer->Number(aqdef::kNominal, index, c.nominal);
  writer->Number(aqdef::kLower, index, c.lower);
  writer->Number(aqdef::kUpper, index, c.upper);
  // Sources differ on whether 1 is a limit or a deviation from nominal: said where both are the same.
  if (c.nominal == 0 && c.lower) writer->Text(aqdef::kLowerKind, index, "1");
  if (c.nominal == 0 && c.upper) writer->Text(aqdef::kUpperKind, index, "1");
  writer->Text(aqdef::kUnit, index, c.unit);
  writer->Text(aqdef::kRemark, index, std::string(KindName(c.kind)));
}

std::string TextOf(const MeasuredValue& v, const std::string& unit) {
  std::string text(VerdictName(v.verdict));
  const std::pair<const char*, std::optional<double>> numbers[] = {{aqdef::kUncertainty, v.expanded_uncertainty},
                                                                   {aqdef::kLeast, v.worst_negative},
                                                                   {aqdef::kGreatest, v.worst_positive}};
  for (const auto& [name, number] : numbers)
    if (number) text += name + DecimalText(*number) + " " + unit;
  return v.reason.empty() ? text : text + aqdef::kReason + v.reason;
}

void WriteValue(Writer* writer, const InspectedPart& part, std::size_t i, std::size_t index) {
  const MeasuredValue& v = part.values[i];
  if (!v.value) return;
  writer->Number(aqdef::kValue, index, v.value);
  writer->Text(aqdef::kTime, index, DottedTimeText(part.recorded_at));
  writer->Text(aqdef::kText, index, TextOf(v, part.characteristics[i].unit));
  writer->Text(aqdef::kSerial, index, part.serial);
  writer->Text(aqdef::kOrder, index, part.work_order);
}

}  // namespace

absl::StatusOr<std::string> ToAqdef(const std::vector<InspectedPart>& parts) {
  if (const absl::Status status = CheckTogether(parts); !status.ok()) return status;
  // Blocks in the order of their first parts. K0008 and K0010 could say it value by value, but hold numbers of the reader's catalogues.
  using BlockName = std::tuple<std::string, std::string, std::string>;
  std::vector<std::pair<BlockName, std::vector<const InspectedPart*>>> blocks;
  for (const InspectedPart& part : parts) {
    const BlockName name(part.machine, part.operation, part.requested_by);
    auto block = std::find_if(blocks.begin(), blocks.end(), [&](const auto& b) { return b.first == name; });
    if (block == blocks.end()) block = blocks.insert(blocks.end(), {name, {}});
    block->second.push_back(&part);
  }
  const std::size_t count = parts.front().characteristics.size();
  Writer writer;
  writer.Count(count * blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const InspectedPart& first = *blocks[b].second.front();
    writer.Text({1000, 0}, b + 1, std::to_string(b + 1));
    writer.Text(aqdef::kPartNumber, b + 1, first.part);
    writer.Text(aqdef::kPartTitle, b + 1, first.part);
    writer.Text(aqdef::kPartRevision, b + 1, std::to_string(first.part_revision));
    writer.Text(aqdef::kMachine, b + 1, first.machine);
    writer.TextIfItFits(aqdef::kOperation, b + 1, first.operation);
    writer.TextIfItFits(aqdef::kOperator, b + 1, first.requested_by);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t index = b * count + i + 1;
      WriteCharacteristic(&writer, first.characteristics[i], i + 1, index);
      for (const InspectedPart* part : blocks[b].second) WriteValue(&writer, *part, i, index);
    }
  }
  return writer.Take();
}

}  // namespace sixpoint::exchange

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "exchange/aqdef.h"
#include "exchange/aqdef_keys.h"
#include "exchange/text.h"
#include "exchange/verdicts.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {
namespace {

// Of the compact form: between characteristics, and between the fields of one.
constexpr char kNextCharacteristic = 0x0f, kNextField = 0x14;
constexpr int kCompactKeys[] = {1, 2, 4, 5, 6, 7, 8, 10, 11, 12};
constexpr char kNoVerdict[] = "the file tells no verdict";

// Views into the file, by the number of their key.
using Fields = std::map<int, std::string_view>;
using Record = std::vector<std::pair<int, std::string_view>>;

struct Block {
  Fields fields;
  std::vector<int> characteristics;  // their indices
};
struct Column {
  Fields fields;
  std::vector<Record> records;
};

std::string_view Find(const Fields& fields, const aqdef::Key& key) {
  const auto found = fields.find(key.number);
  return found == fields.end() ? std::string_view() : found->second;
}
std::string_view Find(const Record& record, const aqdef::Key& key) {
  for (const auto& [number, text] : record)
    if (number == key.number) return text;
  return {};
}
// The first of two that says something.
std::string Or(std::string_view first, std::string_view second) { return std::string(first.empty() ? second : first); }

std::string_view CutBefore(std::string_view* text, std::string_view end) {
  const std::size_t at = text->find(end);
  const std::string_view piece = text->substr(0, at);
  text->remove_prefix(at == std::string_view::npos ? text->size() : at + end.size());
  return piece;
}

class AqdefReader {
 public:
  explicit AqdefReader(std::size_t most_values) : most_values_(most_values) {}

  absl::StatusOr<std::vector<InspectedPart>> Read(std::string_view file) {
    for (std::size_t number = 1; !file.empty(); ++number) {
      std::string_view line = CutBefore(&file, "\n");
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      if (line.empty()) continue;
      if (const absl::Status status = ReadLine(line); !status.ok())
        return Under("line " + std::to_string(number) + ": ", status);
    }
    if (count_ && static_cast<std::size_t>(*count_) != columns_.size())
      return Refuse("K0100", std::to_string(*count_),
                    std::to_string(columns_.size()) + ", as many as characteristics follow");
    if (!count_) return Refuse("K0100", "", "the number of characteristics");
    std::vector<InspectedPart> parts;
    for (const int block : block_order_)
      if (const absl::Status status = ReadBlock(blocks_[block], &parts); !status.ok()) return status;
    return parts;
  }

 private:
  absl::Status ReadLine(std::string_view line) {
    if (line.front() != 'K') return ReadCompact(line);
    std::string_view text = line.substr(1);
    std::string_view name = CutBefore(&text, " ");
    const std::string_view key = CutBefore(&name, "/");
    const auto number = WholeNumberOf(key);
    if (key.size() != 4 || !number || *number < 0) return Refuse("key", std::string(line), "K and four digits");
    const auto index = name.empty() ? std::optional<int>(1) : WholeNumberOf(name);
    text = Trimmed(text);
    if (!IsPlainText(text))
      return Refuse(std::string(line.substr(0, 5)), std::string(text), "UTF-8 without control characters");
    if (*number == aqdef::kCount) return ReadCount(text);
    if (*number >= 3000) return absl::OkStatus();
    if (!index || *index < 1) return Refuse(std::string(line.substr(0, 5)), std::string(name), "an index of 1 or more");
    if (*number >= 2000) return ReadCharacteristicField(*number, *index, text);
    if (*number >= 1000) return ReadPartField(*number, *index, text);
    const auto column = columns_.find(*index);
    if (column == columns_.end())
      return Refuse(std::string(line.substr(0, 5)), std::to_string(*index), "a characteristic that stands before");
    std::vector<Record>& records = column->second.records;
    const auto is_there = [&](const Record& r) {
      return std::any_of(r.begin(), r.end(), [&](const auto& f) { return f.first == *number; });
    };
    if (records.empty() || is_there(records.back())) records.emplace_back();
    records.back().emplace_back(*number, text);
    return absl::OkStatus();
  }

  absl::Status ReadCount(std::string_view text) {
    count_ = WholeNumberOf(text);
    return count_ && *count_ >= 0 ? absl::OkStatus()
                                  : Refuse("K0100", std::string(text), "a number of characteristics");
  }

  absl::Status ReadPartField(int number, int index, std::string_view text) {
    if (blocks_.count(index) == 0) {
      if (blocks_.size() >= kMostAqdefCharacteristics)
        return Refuse("parts", "more", "at most " + std::to_string(kMostAqdefCharacteristics));
      block_order_.push_back(index);
    }
    block_ = index;
    if (!blocks_[index].fields.emplace(number, text).second)
      return Refuse("K" + std::to_string(number), std::string(text), "once for each part");
    return absl::OkStatus();
  }

  absl::Status ReadCharacteristicField(int number, int index, std::string_view text) {
    if (block_ == 0) return Refuse("K" + std::to_string(number), std::string(text), "a part, K1001, before it");
    if (columns_.count(index) == 0) {
      if (columns_.size() >= kMostAqdefCharacteristics)
        return Refuse("characteristics", "more", "at most " + std::to_string(kMostAqdefCharacteristics));
      blocks_[block_].characteristics.push_back(index);
    }
    if (!columns_[index].fields.emplace(number, text).second)
      return Refuse("K" + std::to_string(number), std::string(text), "once for each characteristic");
    return absl::OkStatus();
  }

  absl::Status ReadCompact(std::string_view line) {
    auto column = columns_.begin();
    while (!line.empty()) {
      std::string_view cell = CutBefore(&line, std::string_view(&kNextCharacteristic, 1));
      if (column == columns_.end()) return Refuse("values", "more", "no more than characteristics");
      Record record;
      for (const int key : kCompactKeys) {
        const std::string_view text = Trimmed(CutBefore(&cell, std::string_view(&kNextField, 1)));
        if (!IsPlainText(text)) return Refuse("values", std::string(text), "UTF-8 without control characters");
        if (!text.empty()) record.emplace_back(key, text);
        if (cell.empty()) break;
      }
      if (!cell.empty()) return Refuse("values", std::string(cell), "at most 10 fields of a value");
      if (!record.empty()) {
        if (record.front().first == 1 && !NumberOf(record.front().second))
          return Refuse("line", std::string(record.front().second), "a K-field or values");
        column->second.records.push_back(std::move(record));
      }
      ++column;
    }
    return absl::OkStatus();
  }

  absl::StatusOr<Characteristic> ReadCharacteristic(const Fields& fields) {
    Characteristic c;
    c.name = Or(Find(fields, aqdef::kName), Find(fields, aqdef::kNumber));
    c.unit = std::string(Find(fields, aqdef::kUnit));
    c.kind = KindNamed(Find(fields, aqdef::kRemark)).value_or(Characteristic::Kind::kOther);
    std::optional<double> nominal, lower_by, upper_by;
    const std::pair<int, std::optional<double>*> numbers[] = {{aqdef::kNominal.number, &nominal},
                                                              {aqdef::kLower.number, &c.lower},
                                                              {aqdef::kUpper.number, &c.upper},
                                                              {2112, &lower_by},
                                                              {2113, &upper_by}};
    for (const auto& [key, number] : numbers) {
      const std::string_view text = Find(fields, {key, 0});
      if (text.empty()) continue;
      *number = NumberOf(text);
      if (!*number) return Refuse("K" + std::to_string(key), std::string(text), "a number");
    }
    c.nominal = nominal.value_or(0);
    if (!c.lower && lower_by) c.lower = c.nominal + *lower_by;
    if (!c.upper && upper_by) c.upper = c.nominal + *upper_by;
    return c;
  }

  // Ours; false where the text is another's.
  static bool ReadText(std::string_view text, const std::string& unit, MeasuredValue* value) {
    MeasuredValue read = *value;
    const std::size_t reason = text.find(aqdef::kReason);
    std::string_view before = text.substr(0, reason);
    if (reason != std::string_view::npos) read.reason = text.substr(reason + std::string_view(aqdef::kReason).size());
    const auto verdict = VerdictNamed(before.substr(0, before.find(';')));
    if (!verdict || *verdict == Verdict::kNotMeasured) return false;
    read.verdict = *verdict;
    before.remove_prefix(VerdictName(*verdict).size());
    const std::pair<std::string_view, std::optional<double>*> numbers[] = {
        {aqdef::kUncertainty, &read.expanded_uncertainty},
        {aqdef::kLeast, &read.worst_negative},
        {aqdef::kGreatest, &read.worst_positive}};
    for (const auto& [name, number] : numbers) {
      if (before.substr(0, name.size()) != name) continue;
      before.remove_prefix(name.size());
      *number = NumberOf(CutBefore(&before, " "));
      if (!*number || before.substr(0, unit.size()) != unit) return false;
      before.remove_prefix(unit.size());
    }
    if (!before.empty()) return false;
    *value = std::move(read);
    return true;
  }

  absl::StatusOr<MeasuredValue> ReadValue(const Record& record, const std::string& unit) {
    MeasuredValue value;
    const std::string_view number = Find(record, aqdef::kValue);
    const std::string_view text = Find(record, aqdef::kText), attribute = Find(record, aqdef::kAttribute);
    if (number.empty()) {
      // Counts of good and bad, and the like: no value that was measured.
      for (const auto& [key, field] : record)
        if (key == 20 || key == 21)
          value.reason += (value.reason.empty() ? "K00" : "; K00") + std::to_string(key) + " " + std::string(field);
      return value;
    }
    value.value = NumberOf(number);
    if (!value.value) return Refuse("K0001", std::string(number), "a number");
    const bool valid = attribute.empty() || attribute == "0";
    if (valid && ReadText(text, unit, &value)) return value;
    value.verdict = Verdict::kUndecidable;
    value.does_not_count = !valid;
    value.reason = !valid ? "K0002 " + std::string(attribute) : Or(text, kNoVerdict);
    return value;
  }

  absl::Status ReadBlock(const Block& block, std::vector<InspectedPart>* parts) {
    InspectedPart bare;
    bare.part = Or(Find(block.fields, aqdef::kPartNumber), Find(block.fields, aqdef::kPartTitle));
    bare.part_revision = WholeNumberOf(Find(block.fields, aqdef::kPartRevision)).value_or(0);
    bare.machine = std::string(Find(block.fields, aqdef::kMachine));
    bare.operation = std::string(Find(block.fields, aqdef::kOperation));
    bare.requested_by = std::string(Find(block.fields, aqdef::kOperator));
    for (const int index : block.characteristics) {
      auto c = ReadCharacteristic(columns_[index].fields);
      if (!c.ok()) return Under("characteristic " + std::to_string(index) + ": ", c.status());
      bare.characteristics.push_back(*std::move(c));
    }
    bare.values.resize(bare.characteristics.size());
    const std::size_t first = parts->size();
    // A part by serial number, time, and how often the characteristic had these before.
    std::map<std::tuple<std::string_view, std::string_view, int>, std::size_t> part_of;
    for (std::size_t i = 0; i < block.characteristics.size(); ++i) {
      std::map<std::pair<std::string_view, std::string_view>, int> times;
      for (const Record& record : columns_[block.characteristics[i]].records) {
        const std::string_view serial = Find(record, aqdef::kSerial), time = Find(record, aqdef::kTime);
        const auto [place, is_new] =
            part_of.emplace(std::make_tuple(serial, time, times[{serial, time}]++), parts->size());
        if (is_new) {
          if (cells_ += bare.values.size(); cells_ > most_values_)
            return Refuse("values", "more",
                          "at most " + std::to_string(most_values_) + " characteristics of all parts");
          parts->push_back(bare);
        }
        if (const absl::Status status = ReadRecord(record, i, &(*parts)[place->second]); !status.ok())
          return Under("characteristic " + std::to_string(block.characteristics[i]) + ": ", status);
      }
    }
    if (parts->size() == first) parts->push_back(bare);
    for (std::size_t p = first; p < parts->size(); ++p) (*parts)[p].verdict = WorstOf((*parts)[p].values);
    return absl::OkStatus();
  }

  absl::Status ReadRecord(const Record& record, std::size_t i, InspectedPart* part) {
    auto value = ReadValue(record, part->characteristics[i].unit);
    if (!value.ok()) return value.status();
    part->values[i] = *std::move(value);
    part->serial = std::string(Find(record, aqdef::kSerial));
    if (part->work_order.empty()) part->work_order = std::string(Find(record, aqdef::kOrder));
    if (part->machine.empty()) part->machine = std::string(Find(record, aqdef::kMachineNumber));
    if (part->requested_by.empty()) part->requested_by = std::string(Find(record, aqdef::kOperatorNumber));
    const std::string_view time = Find(record, aqdef::kTime);
    if (time.empty()) return absl::OkStatus();
    const auto recorded_at = DottedTimeOf(time);
    if (!recorded_at) return Refuse("K0004", std::string(time), "dd.MM.yyyy/HH:mm:ss");
    part->recorded_at = *recorded_at;
    return absl::OkStatus();
  }

  const std::size_t most_values_;
  std::optional<int> count_;
  int block_ = 0;  // whose characteristics follow
  std::map<int, Block> blocks_;
  std::vector<int> block_order_;
  std::map<int, Column> columns_;
  std::size_t cells_ = 0;
};

}  // namespace

absl::StatusOr<std::vector<InspectedPart>> FromAqdef(std::string_view file, std::size_t most_values) {
  if (file.size() > kMostAqdefBytes)
    return Refuse("file", std::to_string(file.size()) + " bytes", "at most " + std::to_string(kMostAqdefBytes));
  return AqdefReader(most_values).Read(file);
}

}  // namespace sixpoint::exchange

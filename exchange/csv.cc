#include "exchange/csv.h"

#include <iterator>

#include "exchange/csv_rows.h"
#include "exchange/text.h"
#include "exchange/verdicts.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {
namespace {

constexpr char kHead[] =
    "serial,part,revision,machine,result,recorded_at,characteristic,kind,unit,nominal,lower,upper,value,"
    "expanded_uncertainty,verdict,reason,work_order,operation,method\r\n";
struct ResultColumn {
  enum Index {
    kSerial,
    kPart,
    kRevision,
    kMachine,
    kResult,
    kRecordedAt,
    kCharacteristic,
    kKind,
    kUnit,
    kNominal,
    kLower,
    kUpper,
    kValue,
    kUncertainty,
    kVerdict,
    kReason,
    kWorkOrder,
    kOperation,
    kMethod,
    kColumns
  };
};

constexpr char kNumber[] = "a number";

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + "\"";
}
std::string CellText(const std::string& text) { return Quoted(IsGuarded(text) ? "'" + text : text); }
std::string Number(const std::optional<double>& number) { return number ? NumberText(*number) : ""; }

absl::Status ReadCharacteristic(const std::vector<std::string>& cells, InspectedPart* part) {
  Characteristic c;
  MeasuredValue v;
  c.name = Unguarded(cells[ResultColumn::kCharacteristic]);
  c.unit = Unguarded(cells[ResultColumn::kUnit]);
  const auto kind = KindNamed(cells[ResultColumn::kKind]);
  if (!kind) return Refuse("kind", cells[ResultColumn::kKind], "position, inclination, profile or other");
  const auto verdict = VerdictNamed(cells[ResultColumn::kVerdict]);
  if (!verdict)
    return Refuse("verdict", cells[ResultColumn::kVerdict], "CONFORM, NOT_CONFORM, UNDECIDABLE or NOT_MEASURED");
  c.kind = *kind;
  v.verdict = *verdict;
  v.reason = Unguarded(cells[ResultColumn::kReason]);
  std::optional<double> nominal;
  Refusals refusals;
  refusals.Add(ReadNumber("nominal", cells[ResultColumn::kNominal], kNumber, &nominal))
      .Add(ReadNumber("lower", cells[ResultColumn::kLower], kNumber, &c.lower));
  refusals.Add(ReadNumber("upper", cells[ResultColumn::kUpper], kNumber, &c.upper))
      .Add(ReadNumber("value", cells[ResultColumn::kValue], kNumber, &v.value));
  refusals.Add(ReadNumber("expanded_uncertainty", cells[ResultColumn::kUncertainty], kNumber, &v.expanded_uncertainty));
  if (!nominal) refusals.Add(Refuse("nominal", cells[ResultColumn::kNominal], kNumber));
  c.nominal = nominal.value_or(0);
  part->characteristics.push_back(std::move(c));
  part->values.push_back(std::move(v));
  return refusals.status();
}

absl::StatusOr<InspectedPart> ReadPart(const std::vector<std::string>& cells) {
  InspectedPart part;
  const std::pair<ResultColumn::Index, std::string*> texts[] = {
      {ResultColumn::kSerial, &part.serial},        {ResultColumn::kPart, &part.part},
      {ResultColumn::kMachine, &part.machine},      {ResultColumn::kResult, &part.result},
      {ResultColumn::kWorkOrder, &part.work_order}, {ResultColumn::kOperation, &part.operation},
      {ResultColumn::kMethod, &part.method}};
  for (const auto& [column, text] : texts) *text = Unguarded(cells[column]);
  const auto revision = WholeNumberOf(cells[ResultColumn::kRevision]);
  if (!revision) return Refuse("revision", cells[ResultColumn::kRevision], "a whole number");
  part.part_revision = *revision;
  const auto recorded_at = TimeOf(cells[ResultColumn::kRecordedAt]);
  if (!recorded_at) return Refuse("recorded_at", cells[ResultColumn::kRecordedAt], "a time by RFC 3339");
  part.recorded_at = *recorded_at;
  return part;
}

bool IsSamePart(const InspectedPart& a, const InspectedPart& b) {
  return a.result == b.result && a.serial == b.serial && a.recorded_at == b.recorded_at;
}

}  // namespace

std::string CsvHead() { return kHead; }

std::string ToCsv(const InspectedPart& part) {
  const std::string before = CellText(part.serial) + "," + CellText(part.part) + "," +
                             std::to_string(part.part_revision) + "," + CellText(part.machine) + "," +
                             CellText(part.result) + "," + TimeText(part.recorded_at) + ",";
  const std::string after =
      "," + CellText(part.work_order) + "," + CellText(part.operation) + "," + CellText(part.method) + "\r\n";
  std::string rows;
  for (std::size_t i = 0; i < part.characteristics.size() && i < part.values.size(); ++i) {
    const Characteristic& c = part.characteristics[i];
    const MeasuredValue& v = part.values[i];
    rows += before + CellText(c.name) + "," + std::string(KindName(c.kind)) + "," + CellText(c.unit) + "," +
            Number(c.nominal);
    for (const auto& number : {c.lower, c.upper, v.value, v.expanded_uncertainty}) rows += "," + Number(number);
    rows += "," + std::string(VerdictName(v.verdict)) + "," + CellText(v.reason) + after;
  }
  return rows;
}

absl::StatusOr<std::vector<InspectedPart>> FromCsv(std::string_view file, std::size_t most_rows) {
  if (file.size() > kMostCsvBytes)
    return Refuse("file", std::to_string(file.size()) + " bytes", "at most " + std::to_string(kMostCsvBytes));
  const std::string_view head = std::string_view(kHead).substr(0, sizeof kHead - 3);
  if (file.substr(0, head.size()) != head) return Refuse("head", std::string(file.substr(0, 60)), std::string(head));
  const std::size_t end_of_head = file.find('\n');
  file.remove_prefix(end_of_head == std::string_view::npos ? file.size() : end_of_head + 1);
  std::vector<InspectedPart> parts;
  for (std::size_t row = 1; !file.empty(); ++row) {
    const std::string at = "row " + std::to_string(row) + ": ";
    if (row > most_rows) return Refuse("file", "more rows", "at most " + std::to_string(most_rows));
    const auto cells = NextCsvRow(&file, ResultColumn::kColumns);
    if (!cells.ok()) return Under(at, cells.status());
    if (cells->size() != ResultColumn::kColumns)
      return Under(at,
                   Refuse("cells", std::to_string(cells->size()), std::to_string(ResultColumn::kColumns) + " of them"));
    auto part = ReadPart(*cells);
    if (!part.ok()) return Under(at, part.status());
    if (parts.empty() || !IsSamePart(parts.back(), *part)) parts.push_back(*std::move(part));
    if (const absl::Status status = ReadCharacteristic(*cells, &parts.back()); !status.ok()) return Under(at, status);
  }
  for (InspectedPart& part : parts) part.verdict = WorstOf(part.values);
  return parts;
}

}  // namespace sixpoint::exchange

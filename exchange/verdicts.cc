#include "exchange/verdicts.h"

#include <iterator>

namespace sixpoint::exchange {
namespace {

struct Row {
  Verdict verdict;
  std::string_view name, qif, qif_inspection;
};
constexpr Row kRows[] = {
    {Verdict::kConform, "CONFORM", "PASS", "PASS"},
    {Verdict::kNotConform, "NOT_CONFORM", "FAIL", "FAIL"},
    {Verdict::kUndecidable, "UNDECIDABLE", "INDETERMINATE", "UNKNOWN"},
    {Verdict::kNotMeasured, "NOT_MEASURED", "NOT_ANALYZED", "NOT_MEASURED"},
};
constexpr std::string_view kRework = "REWORK";
constexpr std::string_view kKinds[] = {"position", "inclination", "profile", "other", "length", "angle", "ratio"};

const Row& RowOf(Verdict verdict) { return kRows[static_cast<int>(verdict)]; }

std::optional<Verdict> VerdictWith(std::string_view Row::*column, std::string_view text) {
  for (const Row& row : kRows)
    if (row.*column == text) return row.verdict;
  return std::nullopt;
}

}  // namespace

std::string_view VerdictName(Verdict verdict) { return RowOf(verdict).name; }
std::optional<Verdict> VerdictNamed(std::string_view name) { return VerdictWith(&Row::name, name); }

std::string_view QifStatus(Verdict verdict) { return RowOf(verdict).qif; }
std::optional<Verdict> VerdictOfQifStatus(std::string_view status) {
  return status == kRework ? Verdict::kNotConform : VerdictWith(&Row::qif, status);
}

std::string_view QifInspectionStatus(Verdict verdict) { return RowOf(verdict).qif_inspection; }
std::optional<Verdict> VerdictOfQifInspectionStatus(std::string_view status) {
  return status == kRework ? Verdict::kNotConform : VerdictWith(&Row::qif_inspection, status);
}

std::string_view KindName(Characteristic::Kind kind) { return kKinds[static_cast<int>(kind)]; }
std::optional<Characteristic::Kind> KindNamed(std::string_view name) {
  for (std::size_t i = 0; i < std::size(kKinds); ++i)
    if (kKinds[i] == name) return static_cast<Characteristic::Kind>(i);
  return std::nullopt;
}

}  // namespace sixpoint::exchange

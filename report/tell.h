// What a report tells, as a document: its first page is the one to read, the others are to file.
#pragma once

#include <absl/status/statusor.h>

#include "report/document.h"
#include "report/report.h"

namespace sixpoint::report {

// INVALID_ARGUMENT as Check.
absl::StatusOr<Document> Tell(const Report& report);

// Mark and word: "✓ conform".
std::string MarkOf(Verdict verdict);
std::string WordOf(Verdict verdict);
Cell VerdictCell(Verdict verdict, bool judged = true);

// "0.0523 mm, U 0.0061 mm", or "not measured: " with its reason.
std::string ResultText(const Characteristic& characteristic);

// One of Tell's pages each.
void TellFirstPage(const Report& report, Document* document);
void TellTables(const Report& report, Document* document);
void TellTraceability(const Report& report, Document* document);

// A map seen from its sides, as wide as a page.
Figure DeviationFigure(const DeviationPicture& picture);

// The rows of characteristics, with the columns that they need.
Table CharacteristicTable(const std::string& caption, const std::vector<Characteristic>& characteristics);

}  // namespace sixpoint::report

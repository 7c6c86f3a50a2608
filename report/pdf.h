// A document as PDF by libharu: A4, texts in embedded DejaVu, "page i of n" on every page, tables whose heads are repeated.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "report/document.h"
#include "report/report.h"

namespace sixpoint::report {

struct PdfOptions {
  std::string font_folder = "/usr/share/fonts/truetype/dejavu";  // of fonts-dejavu-core
};

// FAILED_PRECONDITION where the fonts are missing; RESOURCE_EXHAUSTED beyond kMostPages, or where libharu gave up. The same document and the
// same fonts, the same bytes: its dates are the document's. What the fonts lack is told by its number, "[U+4E2D]".
inline constexpr std::size_t kMostPages = 3000;
absl::StatusOr<std::string> ToPdf(const Document& document, const PdfOptions& options = {});

// INVALID_ARGUMENT as Check, besides.
absl::StatusOr<std::string> WritePdf(const Report& report, const PdfOptions& options = {});

}  // namespace sixpoint::report

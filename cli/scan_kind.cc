#include "cli/scan_kind.h"

#include "cli/output.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {

std::string ScanKindText(ingest::v1::ScanKind kind) { return EnumText(ScanKind_Name(kind), "SCAN_KIND_"); }

absl::StatusOr<ingest::v1::ScanKind> ScanKindOf(const std::string& option, const std::string& text) {
  for (int i = 1; i < ingest::v1::ScanKind_ARRAYSIZE; ++i) {
    const auto kind = static_cast<ingest::v1::ScanKind>(i);
    if (ScanKindText(kind) == text) return kind;
  }
  return runtime::Refuse(option, text, kScanKinds);
}

}  // namespace sixpoint::cli

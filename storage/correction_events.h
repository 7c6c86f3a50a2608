// What becomes of corrections after they were made: a person's decisions, programs that left, holes that were cut. Rows are appended,
// each with its journal entry; what a correction is now follows from them (storage/corrections.h: state). Thread-safe. No call holds a
// connection after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/corrections.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

// Whether it may be done, asked of the correction as it is then, with the journal's lock held: nothing can come between. Nothing where
// there is none of that id.
using CorrectionCheck = std::function<absl::Status(const std::optional<CorrectionRow>& correction)>;

struct CorrectionDecision {
  std::string correction_id;
  std::string event;  // RELEASED, REFUSED
  std::string reason, requested_by, software_version;
  CorrectionCheck check;
};

struct NamedHole {
  std::string group_name, hole_name;
};
struct CutReport {
  std::string correction_id;
  std::vector<NamedHole> holes;  // of the correction
  std::optional<Instant> cut_at;
  std::string requested_by, software_version;
  CorrectionCheck check;
};

// A program that left, exactly as it did.
struct ProgramFetchRow {
  std::string fetch_id;
  std::string correction_id;
  std::string nc_program;
  std::string program_sha256;  // read only
  int hole_count = 0;          // that it cuts
  int cut_count = 0;           // left out of it
  ProgramProofRow proof;
  std::string requested_by, software_version;
};

// A hole that a program of another correction was reported to have cut.
struct CutHoleRow {
  std::string correction_id;
  NamedHole hole;
  std::int64_t record_sequence = 0;  // of the report
};

class CorrectionEventStore {
 public:
  virtual ~CorrectionEventStore() = default;
  // The correction after it. ABORTED, with a reason: another call decided the same meanwhile.
  virtual absl::StatusOr<CorrectionRow> Decide(const RecordedRequest& request, const CorrectionDecision& decision,
                                               Deadline deadline) = 0;
  // All of the holes or none. ABORTED, with a reason: another call reported one of them meanwhile.
  virtual absl::StatusOr<CorrectionRow> ReportCut(const RecordedRequest& request, const CutReport& report,
                                                  Deadline deadline) = 0;
  // What this request fetched before.
  virtual absl::StatusOr<std::optional<ProgramFetchRow>> FindFetch(const RecordedRequest& request,
                                                                   Deadline deadline) const = 0;
  virtual absl::StatusOr<ProgramFetchRow> RecordFetch(const RecordedRequest& request, const ProgramFetchRow& fetch,
                                                      const CorrectionCheck& check, Deadline deadline) = 0;
  // Of a blade, whatever the correction.
  virtual absl::StatusOr<std::vector<CutHoleRow>> CutHoles(const std::string& blade_serial,
                                                           Deadline deadline) const = 0;
  // The template that a correction was asked with; empty: none.
  virtual absl::StatusOr<std::string> TemplateOf(const CorrectionRow& correction, Deadline deadline) const = 0;
  // Name of the disposition, or of the assessment of the blank, by which the blade is scrap; none: it is not.
  virtual absl::StatusOr<std::optional<std::string>> ScrappedBy(const std::string& blade_serial,
                                                                Deadline deadline) const = 0;
  // The same of a released correction's blade, where who released it was not told so; none: its program may leave.
  virtual absl::StatusOr<std::optional<std::string>> ScrappedAgainst(const std::string& correction_id,
                                                                     Deadline deadline) const = 0;
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<CorrectionEventStore> CorrectionEventsIn(Database* database);

}  // namespace sixpoint::storage

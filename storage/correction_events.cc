#include "storage/correction_events.h"

#include <nlohmann/json.hpp>

#include "storage/blobs.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertCorrectionEvent[] =
    "INSERT INTO correction_events (correction_id, event, reason, requested_by, software_version, record_id) "
    "VALUES ($1, $2, $3, $4, $5, $6)";
constexpr char kInsertCuts[] =
    "INSERT INTO correction_cuts (correction_id, group_name, hole_name, cut_at, record_id) "
    "SELECT $1::uuid, hole_group, hole, $4::timestamptz, $5::uuid FROM unnest($2::text[], $3::text[]) AS holes "
    "(hole_group, hole)";
constexpr char kSelectReported[] = "SELECT correction_id FROM correction_cuts WHERE record_id = $1 LIMIT 1";
constexpr char kInsertFetch[] =
    "INSERT INTO program_fetches (fetch_id, correction_id, program_sha256, hole_count, cut_count, nc_reader_version, "
    "nc_pose_count, nc_greatest_difference_um, nc_greatest_tilt_deg, requested_by, software_version) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11)";
constexpr char kSelectFetch[] =
    "SELECT correction_id, program_sha256, hole_count, cut_count, nc_reader_version, nc_pose_count, "
    "nc_greatest_difference_um, nc_greatest_tilt_deg, name_of(requested_by), software_version FROM program_fetches "
    "WHERE "
    "fetch_id = $1";
constexpr char kSelectScrapped[] = "SELECT (SELECT name FROM record_names WHERE record_id = scrapped_by($1))";
constexpr char kSelectScrappedAgainst[] =
    "SELECT (SELECT name FROM record_names WHERE record_id = scrapped_against($1))";
constexpr char kSelectCutHoles[] =
    "SELECT k.correction_id, k.group_name, k.hole_name, n.record_sequence FROM corrections c "
    "JOIN correction_cuts k USING (correction_id) JOIN record_names n ON n.record_id = k.record_id WHERE "
    "c.blade_serial = $1 ORDER BY k.correction_id, k.group_name, k.hole_name";
// The pseudonym first, for who waits for one must not hold the lock. Taken before the state is read, not only with the entry: a decision that comes meanwhile waits, or was there before.
constexpr char kLockJournal[] = "SELECT pseudonym_of($1), pg_advisory_xact_lock(6021, 1)";

using FoundCorrection = absl::StatusOr<std::optional<CorrectionRow>>;

FoundCorrection FindOfDecision(Transaction& transaction, const std::string& name) {
  return FindCorrection(transaction, IdOfName(name).id);
}

FoundCorrection FindOfReport(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectReported, Params().Uuid(IdOfName(name).id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  const std::string id = rows->Text(0, 0);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  return FindCorrection(transaction, id);
}

// As it is with the journal's lock held, and if it may be done.
absl::StatusOr<CorrectionRow> FindChecked(Transaction& transaction, const std::string& id,
                                          const std::string& requested_by, const CorrectionCheck& check) {
  const auto locked = transaction.Execute(kLockJournal, Params().Text(requested_by));
  if (!locked.ok()) return locked.status();
  FoundCorrection found = FindCorrection(transaction, id);
  if (!found.ok()) return found.status();
  if (absl::Status status = check(*found); !status.ok()) return status;
  if (!found->has_value()) return absl::InternalError("correction " + id + ": let pass, and not stored");
  return **std::move(found);
}

absl::StatusOr<CorrectionRow> ReadCorrectionAgain(Transaction& transaction, const std::string& id) {
  FoundCorrection found = FindCorrection(transaction, id);
  if (!found.ok()) return found.status();
  if (!found->has_value()) return absl::DataLossError("correction " + id + ": not stored");
  return **std::move(found);
}

// The lock is held, so that only what PostgreSQL's own clock of commits allows comes between.
absl::Status Meanwhile(const absl::Status& status, const std::string& id) {
  if (!absl::IsAlreadyExists(status)) return status;
  return WithReason(absl::AbortedError("correction " + id +
                                       ": decided or reported by another call meanwhile; look at it and try again"),
                    kCorrectionDecidedMeanwhile);
}

RecordEntry EntryOf(const std::string& kind, const std::string& name, const CorrectionRow& correction,
                    const std::string& requested_by, const std::string& software_version, const nlohmann::json& summary,
                    const RecordedRequest& request) {
  RecordEntry entry;
  entry.kind = kind;
  entry.name = name;
  entry.inputs = {"corrections/" + correction.correction_id};
  entry.blade = correction.blade_serial;
  entry.machine = correction.machine_id;
  entry.software_version = software_version;
  entry.requested_by = requested_by;
  entry.summary_json = summary.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  entry.request = KeptRequestOf(request);
  return entry;
}

absl::StatusOr<std::optional<ProgramFetchRow>> FindFetchNamed(Transaction& transaction, const std::string& name) {
  ProgramFetchRow fetch;
  fetch.fetch_id = IdOfName(name).id;
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectFetch, Params().Uuid(fetch.fetch_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  fetch.correction_id = rows->Text(0, 0);
  fetch.program_sha256 = rows->Digest(0, 1);
  fetch.hole_count = static_cast<int>(rows->Int(0, 2));
  fetch.cut_count = static_cast<int>(rows->Int(0, 3));
  fetch.proof = {rows->Text(0, 4), static_cast<int>(rows->Int(0, 5)), rows->Real(0, 6), rows->Real(0, 7)};
  fetch.requested_by = rows->Text(0, 8);
  fetch.software_version = rows->Text(0, 9);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  absl::StatusOr<std::string> program = GetBlob(transaction, fetch.program_sha256);
  if (!program.ok()) return program.status();
  fetch.nc_program = *std::move(program);
  return fetch;
}

class PostgresCorrectionEvents final : public CorrectionEventStore {
 public:
  explicit PostgresCorrectionEvents(Database* database) : database_(database) {}

  absl::StatusOr<CorrectionRow> Decide(const RecordedRequest& request, const CorrectionDecision& decision,
                                       Deadline deadline) override {
    const auto decide = [&](Transaction& transaction) -> absl::StatusOr<CorrectionRow> {
      const std::string& id = decision.correction_id;
      const auto correction = FindChecked(transaction, id, decision.requested_by, decision.check);
      if (!correction.ok()) return correction.status();
      const std::string record_id = NewUuid();
      const auto inserted = transaction.Execute(kInsertCorrectionEvent, Params()
                                                                            .Uuid(id)
                                                                            .Text(decision.event)
                                                                            .Text(decision.reason)
                                                                            .Text(decision.requested_by)
                                                                            .Text(decision.software_version)
                                                                            .Uuid(record_id));
      if (!inserted.ok()) return Meanwhile(inserted.status(), id);
      const std::string kind = decision.event == "RELEASED" ? "release" : "refusal";
      const auto recorded = AppendRecord(transaction, record_id,
                                         EntryOf(kind, kind + "s/" + id, *correction, decision.requested_by,
                                                 decision.software_version, {{"reason", decision.reason}}, request));
      if (!recorded.ok()) return recorded.status();
      return ReadCorrectionAgain(transaction, id);
    };
    return RecordOnce<CorrectionRow>(*database_, request, deadline, FindOfDecision, decide);
  }

  absl::StatusOr<CorrectionRow> ReportCut(const RecordedRequest& request, const CutReport& report,
                                          Deadline deadline) override {
    const auto store = [&](Transaction& transaction) -> absl::StatusOr<CorrectionRow> {
      const std::string& id = report.correction_id;
      const auto correction = FindChecked(transaction, id, report.requested_by, report.check);
      if (!correction.ok()) return correction.status();
      const std::string record_id = NewUuid();
      std::vector<std::string> groups, holes;
      for (const NamedHole& hole : report.holes) {
        groups.push_back(hole.group_name);
        holes.push_back(hole.hole_name);
      }
      Params params;
      params.Uuid(id).Texts(groups).Texts(holes);
      params.OptionalTime(report.cut_at);
      const auto inserted = transaction.Execute(kInsertCuts, params.Uuid(record_id));
      if (!inserted.ok()) return Meanwhile(inserted.status(), id);
      RecordEntry entry = EntryOf("cut", "cuts/" + record_id, *correction, report.requested_by, report.software_version,
                                  {{"hole_count", report.holes.size()}}, request);
      entry.measured_at = report.cut_at;
      if (const auto recorded = AppendRecord(transaction, record_id, entry); !recorded.ok()) return recorded.status();
      return ReadCorrectionAgain(transaction, id);
    };
    return RecordOnce<CorrectionRow>(*database_, request, deadline, FindOfReport, store);
  }

  absl::StatusOr<std::optional<ProgramFetchRow>> FindFetch(const RecordedRequest& request,
                                                           Deadline deadline) const override {
    return FindRecorded<ProgramFetchRow>(*database_, request, deadline, FindFetchNamed);
  }

  absl::StatusOr<ProgramFetchRow> RecordFetch(const RecordedRequest& request, const ProgramFetchRow& fetch,
                                              const CorrectionCheck& check, Deadline deadline) override {
    const auto store = [&](Transaction& transaction) -> absl::StatusOr<ProgramFetchRow> {
      // The blob first: the journal's lock is held for no longer than it must be.
      absl::StatusOr<std::string> sha256 = PutBlob(transaction, fetch.nc_program);
      if (!sha256.ok()) return sha256.status();
      const auto correction = FindChecked(transaction, fetch.correction_id, fetch.requested_by, check);
      if (!correction.ok()) return correction.status();
      const auto inserted = transaction.Execute(kInsertFetch, Params()
                                                                  .Uuid(fetch.fetch_id)
                                                                  .Uuid(fetch.correction_id)
                                                                  .Digest(*sha256)
                                                                  .Int(fetch.hole_count)
                                                                  .Int(fetch.cut_count)
                                                                  .Text(fetch.proof.reader_version)
                                                                  .Int(fetch.proof.pose_count)
                                                                  .Real(fetch.proof.greatest_difference_um)
                                                                  .Real(fetch.proof.greatest_tilt_deg)
                                                                  .Text(fetch.requested_by)
                                                                  .Text(fetch.software_version));
      if (!inserted.ok()) return inserted.status();
      const auto recorded = AppendRecord(
          transaction, fetch.fetch_id,
          EntryOf("fetch", "fetches/" + fetch.fetch_id, *correction, fetch.requested_by, fetch.software_version,
                  {{"program_sha256", *sha256}, {"hole_count", fetch.hole_count}, {"cut_count", fetch.cut_count}},
                  request));
      if (!recorded.ok()) return recorded.status();
      ProgramFetchRow stored = fetch;
      stored.program_sha256 = *std::move(sha256);
      return stored;
    };
    return RecordOnce<ProgramFetchRow>(*database_, request, deadline, FindFetchNamed, store);
  }

  absl::StatusOr<std::vector<CutHoleRow>> CutHoles(const std::string& blade_serial, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) -> absl::StatusOr<std::vector<CutHoleRow>> {
      return AllRows(t, kSelectCutHoles, Params().Text(blade_serial), [](const Rows& rows, int row) -> CutHoleRow {
        return {rows.Text(row, 0), {rows.Text(row, 1), rows.Text(row, 2)}, rows.Int(row, 3)};
      });
    });
  }

  absl::StatusOr<std::string> TemplateOf(const CorrectionRow& correction, Deadline deadline) const override {
    if (correction.template_sha256.empty()) return std::string();
    return OneRead(*database_, deadline, [&](Transaction& t) { return GetBlob(t, correction.template_sha256); });
  }
  absl::StatusOr<std::optional<std::string>> ScrappedBy(const std::string& blade_serial,
                                                        Deadline deadline) const override {
    return Scrapped(kSelectScrapped, Params().Text(blade_serial), deadline);
  }
  absl::StatusOr<std::optional<std::string>> ScrappedAgainst(const std::string& correction_id,
                                                             Deadline deadline) const override {
    return Scrapped(kSelectScrappedAgainst, Params().Uuid(correction_id), deadline);
  }

 private:
  absl::StatusOr<std::optional<std::string>> Scrapped(const char* sql, const Params& params, Deadline deadline) const {
    return OneRead(*database_, deadline, [&](Transaction& t) -> absl::StatusOr<std::optional<std::string>> {
      const absl::StatusOr<Rows> rows = t.Execute(sql, params);
      if (!rows.ok()) return rows.status();
      if (rows->IsNull(0, 0)) return std::nullopt;
      return rows->Checked(std::optional<std::string>(rows->Text(0, 0)));
    });
  }
  Database* const database_;
};

}  // namespace

std::shared_ptr<CorrectionEventStore> CorrectionEventsIn(Database* database) {
  return std::make_shared<PostgresCorrectionEvents>(database);
}

}  // namespace sixpoint::storage

#include "tests/support/fake_plant_stores.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "refusal/refusal.h"
#include "storage/blobs.h"

namespace sixpoint::testing {
namespace {

using storage::Deadline;

// A machining model, a drawing: of the same part for ever, and hidden with it.
template <typename Row>
constexpr bool kIsOfOnePart =
    std::is_same_v<Row, storage::MachiningModelRow> || std::is_same_v<Row, storage::DrawingRow>;

template <typename Row>
class FakeRevisions final : public storage::RevisionStore<Row> {
 public:
  // kind: machine, artefact, part, machining_model, drawing; id: the row's member.
  FakeRevisions(std::shared_ptr<FakeRecord> record, std::shared_ptr<FakeClearances> clearances, std::string kind,
                std::string Row::*id)
      : record_(std::move(record)), clearances_(std::move(clearances)), kind_(std::move(kind)), id_(id) {}

  absl::StatusOr<std::optional<Row>> Find(const std::string& id, int revision, Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    return Known(id, revision);
  }
  absl::StatusOr<std::vector<Row>> List(const storage::RegisteredFilter& filter, const std::string& after, int limit,
                                        Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    std::vector<Row> listed;
    for (auto row = revisions_.upper_bound(after); row != revisions_.end() && static_cast<int>(listed.size()) < limit;
         ++row)
      if (Contains(filter.recorded, row->second.back().recorded.recorded_at) && !Hides(filter.reader, row->first) &&
          (filter.part_id.empty() || IsOfPart(row->second.back(), filter.part_id)))
        listed.push_back(Listed(row->second.back(), filter.full));
    return listed;
  }
  absl::StatusOr<std::optional<Row>> FindRecorded(const storage::RecordedRequest& request, Deadline) const override {
    const auto lock = record_->Lock();
    return record_->template Kept<Row>(request, [this](const std::string& name) { return Named(name); });
  }
  absl::StatusOr<Row> Record(const storage::RecordedRequest& request, Row row, const storage::RecordEntry& entry,
                             Deadline) override {
    const auto lock = record_->Lock();
    const auto work = [&]() -> absl::StatusOr<Row> {
      if (Hides(entry.reader, row.*id_)) return storage::NotSeen("part_id", row.*id_, entry.reader);
      if (absl::Status stated = StateCustomer(entry.reader, &row); !stated.ok()) return stated;
      const auto known = revisions_.find(row.*id_);
      if (known != revisions_.end())
        if (absl::Status same = CheckSamePart(entry.reader, known->second.back(), row); !same.ok()) return same;
      if (known != revisions_.end() && known->second.back().content_sha256 == row.content_sha256)
        return known->second.back();
      if (absl::Status revises = CheckRevises(known, row); !revises.ok()) return revises;
      row.revision = known == revisions_.end() ? 1 : known->second.back().revision + 1;
      row.recorded = record_->Next();
      if constexpr (kIsOfOnePart<Row>) clearances_->part_of[kind_ + "s/" + row.*id_] = row.part_id;
      if constexpr (std::is_same_v<Row, storage::MachiningModelRow>)
        row.nc_template_sha256 = storage::Sha256Hex(row.nc_template);
      if constexpr (std::is_same_v<Row, storage::DrawingRow>)
        row.characteristic_count = static_cast<int>(row.characteristics.size());
      storage::RecordEntry named = entry;
      named.kind = kind_;
      named.name = NameOf(row);
      if (kind_ == "machine") named.machine = row.*id_;
      record_->Append(std::move(named), row.recorded);
      revisions_[row.*id_].push_back(row);
      return row;
    };
    return record_->template Once<Row>(
        request, [this](const std::string& name) { return Named(name); }, work,
        [this](const Row& recorded) { return NameOf(recorded); });
  }

 private:
  bool Hides(const storage::Reader& reader, const std::string& id) const {
    if constexpr (kIsOfOnePart<Row>) {
      const auto known = revisions_.find(id);
      return known != revisions_.end() && clearances_->Hides(reader, known->second.back().part_id);
    }
    return kind_ == "part" && clearances_->Hides(reader, id);
  }
  absl::Status CheckSamePart(const storage::Reader& reader, const Row& known, const Row& row) const {
    if constexpr (kIsOfOnePart<Row>) {
      if (known.part_id == row.part_id) return absl::OkStatus();
      if (clearances_->Hides(reader, known.part_id)) return storage::NotSeen(kind_ + "_id", row.*id_, reader);
      return absl::AlreadyExistsError(kind_ + ".part: parts/" + row.part_id + ", want parts/" + known.part_id);
    }
    return absl::OkStatus();
  }
  // What an order says of the newest revision that it knows.
  template <typename Known>
  absl::Status CheckRevises(const Known& known, const Row& row) const {
    if constexpr (std::is_same_v<Row, storage::DrawingRow>) {
      const int newest = known == revisions_.end() ? 0 : known->second.back().revision;
      if (row.revises && *row.revises != newest) return Refuse("revises", *row.revises, std::to_string(newest));
    }
    return absl::OkStatus();
  }
  static bool IsOfPart(const Row& row, const std::string& part_id) {
    if constexpr (kIsOfOnePart<Row>) return row.part_id == part_id;
    return true;
  }
  // As PostgreSQL's lists and its blobs have it.
  static Row Listed(Row row, bool full) {
    if constexpr (std::is_same_v<Row, storage::MachiningModelRow>) {
      static_cast<void>(full);
      row.nc_template.clear();
      for (storage::MachiningOperationRow& operation : row.operations)
        for (storage::MachiningToolPathRow& path : operation.paths) path.tips_in_part_mm = path.axes_in_part = {};
    }
    if constexpr (std::is_same_v<Row, storage::DrawingRow>) {
      if (full) return row;
      row.datum_systems.clear();
      row.sections.clear();
      row.regions.clear();
      row.characteristics.clear();
      row.product_requirements.clear();
    }
    return row;
  }
  // Once stated it stays until another is.
  absl::Status StateCustomer(const storage::Reader& reader, Row* row) {
    if constexpr (std::is_same_v<Row, storage::PartRow>) {
      clearances_->part_of["parts/" + row->part_id] = row->part_id;
      const auto before = clearances_->customers.find(row->part_id);
      if (row->customer_id.empty()) {
        if (before != clearances_->customers.end()) row->customer_id = before->second;
        return absl::OkStatus();
      }
      if (!clearances_->IsCleared(reader, "parts/" + row->part_id) &&
          !clearances_->IsCleared(reader, "customers/" + row->customer_id))
        return storage::NotSeen("part.customer", row->customer_id, reader);
      clearances_->customers[row->part_id] = row->customer_id;
    }
    return absl::OkStatus();
  }
  std::string NameOf(const Row& row) const { return kind_ + "s/" + row.*id_ + "@" + std::to_string(row.revision); }
  std::optional<Row> Named(const std::string& name) const {
    const storage::NamedId named = storage::IdOfName(name);
    return Known(named.id, named.revision);
  }
  std::optional<Row> Known(const std::string& id, int revision) const {
    const auto found = revisions_.find(id);
    const int count = found == revisions_.end() ? 0 : static_cast<int>(found->second.size());
    if (count == 0 || revision < 0 || revision > count) return std::nullopt;
    return found->second[static_cast<std::size_t>((revision == 0 ? count : revision) - 1)];
  }
  const std::shared_ptr<FakeRecord> record_;
  const std::shared_ptr<FakeClearances> clearances_;  // a change needs the record's lock
  const std::string kind_;
  std::string Row::*const id_;
  std::map<std::string, std::vector<Row>> revisions_;  // by id, from the first
};

class FakeBlades final : public storage::BladeStore {
 public:
  FakeBlades(std::shared_ptr<FakeRecord> record, std::shared_ptr<FakeClearances> clearances)
      : record_(std::move(record)), clearances_(std::move(clearances)) {}

  absl::StatusOr<std::optional<storage::BladeRow>> Find(const std::string& serial, Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    return Known(serial);
  }
  absl::StatusOr<storage::BladePage> List(const storage::BladeFilter& filter, const std::string& after, int limit,
                                          Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    storage::BladePage page;
    std::vector<storage::BladeRow>& listed = page.blades;
    for (auto blade = blades_.upper_bound(after); blade != blades_.end() && static_cast<int>(listed.size()) < limit;
         ++blade) {
      const storage::BladeRow& row = blade->second;
      if ((filter.part_id.empty() || filter.part_id == row.part_id) &&
          Contains(filter.recorded, row.recorded.recorded_at) && !clearances_->Hides(filter.reader, row.part_id))
        listed.push_back(row);
    }
    return page;
  }
  absl::StatusOr<std::optional<storage::BladeRow>> FindRecorded(const storage::RecordedRequest& request,
                                                                Deadline) const override {
    const auto lock = record_->Lock();
    return record_->Kept<storage::BladeRow>(request, [this](const std::string& serial) { return Known(serial); });
  }
  absl::StatusOr<storage::BladeRow> Record(const storage::RecordedRequest& request, storage::BladeRow blade,
                                           const storage::RecordEntry& entry, Deadline) override {
    const auto lock = record_->Lock();
    const auto work = [&]() -> absl::StatusOr<storage::BladeRow> {
      const auto known = blades_.find(blade.blade_serial);
      if (known != blades_.end() && known->second.part_id == blade.part_id) return known->second;
      if (known != blades_.end() && clearances_->Hides(entry.reader, known->second.part_id))
        return storage::NotSeen("serial", blade.blade_serial, entry.reader);
      if (known != blades_.end()) return absl::AlreadyExistsError("blade.part: parts/" + blade.part_id);
      storage::RecordEntry named = entry;
      named.kind = "blade";
      named.name = "blades/" + blade.blade_serial;
      named.blade = blade.blade_serial;
      clearances_->part_of[named.name] = blade.part_id;
      blade.recorded = record_->Next();
      record_->Append(std::move(named), blade.recorded);
      blades_[blade.blade_serial] = blade;
      return blade;
    };
    return record_->Once<storage::BladeRow>(
        request, [this](const std::string& serial) { return Known(serial); }, work,
        [](const storage::BladeRow& recorded) { return recorded.blade_serial; });
  }

 private:
  std::optional<storage::BladeRow> Known(const std::string& serial) const {
    const auto found = blades_.find(serial);
    return found == blades_.end() ? std::nullopt : std::optional(found->second);
  }
  const std::shared_ptr<FakeRecord> record_;
  const std::shared_ptr<FakeClearances> clearances_;
  std::map<std::string, storage::BladeRow> blades_;
};

class FakeSurfaces final : public storage::SurfaceStore {
 public:
  explicit FakeSurfaces(std::shared_ptr<FakeRecord> record) : record_(std::move(record)) {}

  absl::StatusOr<std::optional<storage::TessellationRow>> Find(const std::string& cad_sha256, const std::string& method,
                                                               Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    const auto found = tessellations_.find({cad_sha256, method});
    return found == tessellations_.end() ? std::nullopt : std::optional(found->second);
  }
  absl::StatusOr<std::string> Bytes(const std::string& surface_sha256, Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    const auto found = bytes_.find(surface_sha256);
    if (found == bytes_.end()) return absl::NotFoundError("blob " + surface_sha256);
    return found->second;
  }
  absl::StatusOr<storage::TessellationRow> Keep(const std::string& cad, const std::string& surface,
                                                storage::TessellationRow row, const std::string&, Deadline) override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    row.cad_sha256 = storage::Sha256Hex(cad);
    row.surface_sha256 = storage::Sha256Hex(surface);
    bytes_[row.surface_sha256] = surface;
    tessellations_.emplace(std::pair(row.cad_sha256, row.method), row);
    return row;
  }

 private:
  const std::shared_ptr<FakeRecord> record_;
  std::map<std::pair<std::string, std::string>, storage::TessellationRow> tessellations_;
  std::map<std::string, std::string> bytes_;
};

class FakeJournal final : public storage::JournalReader {
 public:
  using Entries = absl::StatusOr<std::vector<storage::JournalEntry>>;
  FakeJournal(std::shared_ptr<const FakeRecord> record, std::shared_ptr<const FakeClearances> clearances)
      : record_(std::move(record)), clearances_(std::move(clearances)) {}

  absl::StatusOr<std::optional<storage::JournalEntry>> FindEntry(const std::string& name, Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    for (const storage::JournalEntry& entry : record_->entries())
      if (entry.entry.name == name) return entry;
    return std::nullopt;
  }
  absl::StatusOr<bool> IsRecorded(const std::string& name, Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    const auto& entries = record_->entries();
    return std::any_of(entries.begin(), entries.end(),
                       [&](const storage::JournalEntry& entry) { return FakeRecord::Means(name, entry.entry.name); });
  }
  absl::StatusOr<std::vector<std::string>> Kinds(Deadline) const override { return FakeRecord::Kinds(); }
  Entries RecordOfBlade(const std::string& serial, const std::vector<std::string>& kinds,
                        const storage::JournalPage& page, Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    std::vector<storage::JournalEntry> within;
    for (const storage::JournalEntry& entry : record_->entries())
      if (storage::Contains(page.recorded, entry.recorded.recorded_at)) within.push_back(entry);
    return Page(within, page,
                [&](const storage::RecordEntry& entry) { return entry.blade == serial && IsAmong(kinds, entry.kind); });
  }
  Entries DerivedFrom(const std::string& name, const std::vector<std::string>& kinds, const storage::JournalPage& page,
                      Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    return Page(record_->DerivedFrom(name, page.recorded), page, [&](const storage::RecordEntry& entry) {
      return IsAmong(kinds, entry.kind) && IsSeen(entry, page.reader);
    });
  }
  // The fakes know of no work orders.
  Entries EntriesOfOrder(const std::string&, const std::string&, const std::vector<std::string>&,
                         const storage::JournalPage&, Deadline) const override {
    return std::vector<storage::JournalEntry>();
  }
  Entries MadeFrom(const std::string& name, const storage::JournalPage& page, Deadline) const override {
    const auto lock = record_->Lock();
    if (!record_->failure().ok()) return record_->failure();
    return Page(record_->MadeFrom(name), page,
                [&](const storage::RecordEntry& entry) { return IsSeen(entry, page.reader); });
  }

 private:
  static bool IsAmong(const std::vector<std::string>& kinds, const std::string& kind) {
    return kinds.empty() || std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
  }
  bool IsSeen(const storage::RecordEntry& entry, const storage::Reader& reader) const {
    const std::string of =
        entry.kind == "part" ? entry.name.substr(0, entry.name.find('@')) : "blades/" + entry.blade.value_or("");
    const auto part = clearances_->part_of.find(of);
    return part == clearances_->part_of.end() || !clearances_->Hides(reader, part->second);
  }
  template <typename Wanted>
  static std::vector<storage::JournalEntry> Page(const std::vector<storage::JournalEntry>& entries,
                                                 const storage::JournalPage& page, const Wanted& wanted) {
    std::vector<storage::JournalEntry> listed;
    for (const storage::JournalEntry& entry : entries)
      if (entry.recorded.sequence > page.after_sequence && static_cast<std::int64_t>(listed.size()) < page.limit &&
          wanted(entry.entry))
        listed.push_back(entry);
    return listed;
  }
  const std::shared_ptr<const FakeRecord> record_;
  const std::shared_ptr<const FakeClearances> clearances_;
};

}  // namespace

FakePlantStores::FakePlantStores() {
  using storage::ArtefactRow;
  using storage::MachineRow;
  using storage::PartRow;
  machines = std::make_shared<FakeRevisions<MachineRow>>(record, fake_clearances, "machine", &MachineRow::machine_id);
  artefacts =
      std::make_shared<FakeRevisions<ArtefactRow>>(record, fake_clearances, "artefact", &ArtefactRow::artefact_id);
  parts = std::make_shared<FakeRevisions<PartRow>>(record, fake_clearances, "part", &PartRow::part_id);
  using storage::MachiningModelRow;
  machining_models = std::make_shared<FakeRevisions<MachiningModelRow>>(record, fake_clearances, "machining_model",
                                                                        &MachiningModelRow::machining_model_id);
  drawings = std::make_shared<FakeRevisions<storage::DrawingRow>>(record, fake_clearances, "drawing",
                                                                  &storage::DrawingRow::drawing_id);
  blades = std::make_shared<FakeBlades>(record, fake_clearances);
  surfaces = std::make_shared<FakeSurfaces>(record);
  journal = std::make_shared<FakeJournal>(record, fake_clearances);
  clearances = fake_clearances;
}

}  // namespace sixpoint::testing

#include "storage/plant_store.h"

#include <utility>

#include "storage/blobs.h"
#include "storage/one_read.h"
#include "storage/requests.h"
#include "storage/work_orders.h"

namespace sixpoint::storage {
namespace {

// The row that insert gives may be one of before.
template <typename Row, typename Find>
absl::StatusOr<Row> RecordRow(Database& database, const RecordedRequest& request, const Row& row,
                              const RecordEntry& entry, Deadline deadline, const Find& find,
                              absl::StatusOr<Row> (*insert)(Transaction&, Row, RecordEntry)) {
  RecordEntry kept = entry;
  kept.request = KeptRequestOf(request);
  return RecordOnce<Row>(database, request, deadline, find, [&](Transaction& t) { return insert(t, row, kept); });
}

template <typename Row>
class PostgresRevisions final : public RevisionStore<Row> {
 public:
  // Each in a transaction of the caller's.
  struct Statements {
    absl::StatusOr<Row> (*insert)(Transaction&, Row, RecordEntry);
    absl::StatusOr<std::optional<Row>> (*find)(Transaction&, const std::string& id, int revision);
    Registered what;
    // As find, of what a list has of it; none: find.
    absl::StatusOr<std::optional<Row>> (*find_listed)(Transaction&, const std::string& id, int revision) = nullptr;
  };
  PostgresRevisions(Database* database, const Statements& statements) : database_(database), statements_(statements) {}

  absl::StatusOr<std::optional<Row>> Find(const std::string& id, int revision, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return statements_.find(t, id, revision); });
  }
  absl::StatusOr<std::vector<Row>> List(const RegisteredFilter& filter, const std::string& after, int limit,
                                        Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) -> absl::StatusOr<std::vector<Row>> {
      const absl::StatusOr<std::vector<std::string>> ids = ListRegistered(t, statements_.what, filter, after, limit);
      if (!ids.ok()) return ids.status();
      std::vector<Row> rows;
      for (const std::string& id : *ids) {
        absl::StatusOr<std::optional<Row>> row =
            (statements_.find_listed == nullptr ? statements_.find : statements_.find_listed)(t, id, 0);
        if (!row.ok()) return row.status();
        if (!row->has_value()) return absl::DataLossError(CollectionOf(statements_.what) + "/" + id + ": no revision");
        rows.push_back(**std::move(row));
      }
      return rows;
    });
  }
  absl::StatusOr<std::optional<Row>> FindRecorded(const RecordedRequest& request, Deadline deadline) const override {
    return storage::FindRecorded<Row>(*database_, request, deadline, finder());
  }
  absl::StatusOr<Row> Record(const RecordedRequest& request, Row row, const RecordEntry& entry,
                             Deadline deadline) override {
    return RecordRow(*database_, request, row, entry, deadline, finder(), statements_.insert);
  }

 private:
  auto finder() const {
    return [find = statements_.find](Transaction& t, const std::string& name) {
      const NamedId named = IdOfName(name);
      return find(t, named.id, named.revision);
    };
  }
  Database* const database_;
  const Statements statements_;
};

class PostgresBlades final : public BladeStore {
 public:
  explicit PostgresBlades(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<BladeRow>> Find(const std::string& serial, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return FindBlade(t, serial); });
  }
  absl::StatusOr<BladePage> List(const BladeFilter& filter, const std::string& after, int limit,
                                 Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return ListBlades(t, filter, after, limit); });
  }
  absl::StatusOr<std::optional<BladeRow>> FindRecorded(const RecordedRequest& request,
                                                       Deadline deadline) const override {
    return storage::FindRecorded<BladeRow>(*database_, request, deadline, FindNamed);
  }
  absl::StatusOr<BladeRow> Record(const RecordedRequest& request, BladeRow blade, const RecordEntry& entry,
                                  Deadline deadline) override {
    return RecordRow(*database_, request, blade, entry, deadline, FindNamed, InsertBlade);
  }

 private:
  static absl::StatusOr<std::optional<BladeRow>> FindNamed(Transaction& t, const std::string& name) {
    return FindBlade(t, IdOfName(name).id);
  }
  Database* const database_;
};

class PostgresWorkOrders final : public ResultWriter<BladeRow> {
 public:
  explicit PostgresWorkOrders(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<BladeRow>> FindRecorded(const RecordedRequest& request,
                                                       Deadline deadline) const override {
    return storage::FindRecorded<BladeRow>(*database_, request, deadline, FindAssigned);
  }
  absl::StatusOr<BladeRow> Record(const RecordedRequest& request, BladeRow blade, const RecordEntry& entry,
                                  Deadline deadline) override {
    return RecordRow(*database_, request, blade, entry, deadline, FindAssigned, AssignWorkOrder);
  }

 private:
  Database* const database_;
};

class PostgresSurfaces final : public SurfaceStore {
 public:
  explicit PostgresSurfaces(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<TessellationRow>> Find(const std::string& cad_sha256, const std::string& method,
                                                      Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return FindTessellation(t, cad_sha256, method); });
  }
  absl::StatusOr<std::string> Bytes(const std::string& surface_sha256, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return GetBlob(t, surface_sha256); });
  }
  absl::StatusOr<TessellationRow> Keep(const std::string& cad, const std::string& surface, TessellationRow row,
                                       const std::string& software_version, Deadline deadline) override {
    absl::StatusOr<Transaction> transaction = database_->Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    absl::StatusOr<std::string> cad_blob = PutBlob(*transaction, cad);
    if (!cad_blob.ok()) return cad_blob.status();
    absl::StatusOr<std::string> surface_blob = PutBlob(*transaction, surface);
    if (!surface_blob.ok()) return surface_blob.status();
    row.cad_sha256 = *std::move(cad_blob);
    row.surface_sha256 = *std::move(surface_blob);
    absl::Status status = InsertTessellation(*transaction, row, software_version);
    if (status.ok()) status = transaction->Commit();
    if (!status.ok()) return status;
    return row;
  }

 private:
  Database* const database_;
};

class PostgresJournal final : public JournalReader {
 public:
  explicit PostgresJournal(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<JournalEntry>> FindEntry(const std::string& name, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return storage::FindEntry(t, name); });
  }
  absl::StatusOr<bool> IsRecorded(const std::string& name, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return storage::IsRecorded(t, name); });
  }
  absl::StatusOr<std::vector<JournalEntry>> RecordOfBlade(const std::string& serial, const JournalPage& page,
                                                          Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return storage::RecordOfBlade(t, serial, page); });
  }
  absl::StatusOr<std::vector<JournalEntry>> DerivedFrom(const std::string& name, const std::vector<std::string>& kinds,
                                                        const JournalPage& page, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return storage::DerivedFrom(t, name, kinds, page); });
  }
  absl::StatusOr<std::vector<JournalEntry>> EntriesOfOrder(const std::string& work_order, const std::string& operation,
                                                           const std::vector<std::string>& kinds,
                                                           const JournalPage& page, Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return storage::EntriesOfOrder(t, work_order, operation, kinds, page); });
  }
  absl::StatusOr<std::vector<JournalEntry>> MadeFrom(const std::string& name, const JournalPage& page,
                                                     Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return storage::MadeFrom(t, name, page); });
  }

 private:
  Database* const database_;
};

}  // namespace

PlantStores PlantIn(Database* database) {
  using Machines = PostgresRevisions<MachineRow>;
  using Artefacts = PostgresRevisions<ArtefactRow>;
  using Parts = PostgresRevisions<PartRow>;
  using Models = PostgresRevisions<MachiningModelRow>;
  PlantStores stores;
  stores.machines =
      std::make_shared<Machines>(database, Machines::Statements{InsertMachine, FindMachine, Registered::kMachines});
  stores.artefacts = std::make_shared<Artefacts>(
      database, Artefacts::Statements{InsertArtefact, FindArtefact, Registered::kArtefacts});
  stores.parts = std::make_shared<Parts>(database, Parts::Statements{InsertPart, FindPart, Registered::kParts});
  stores.machining_models = std::make_shared<Models>(
      database, Models::Statements{InsertMachiningModel, FindMachiningModel, Registered::kMachiningModels,
                                   FindMachiningModelWithoutTemplate});
  stores.blades = std::make_shared<PostgresBlades>(database);
  stores.surfaces = std::make_shared<PostgresSurfaces>(database);
  stores.journal = std::make_shared<PostgresJournal>(database);
  stores.clearances = ClearancesIn(database);
  stores.work_orders = std::make_shared<PostgresWorkOrders>(database);
  return stores;
}

}  // namespace sixpoint::storage

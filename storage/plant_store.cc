#include "storage/plant_store.h"

#include <utility>

#include "storage/blobs.h"
#include "storage/events.h"
#include "storage/one_read.h"
#include "storage/postgres_revisions.h"
#include "storage/work_orders.h"

namespace sixpoint::storage {
namespace {

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
  absl::StatusOr<std::vector<JournalEntry>> RecordOfBlade(const std::string& serial,
                                                          const std::vector<std::string>& kinds,
                                                          const JournalPage& page, Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return storage::RecordOfBlade(t, serial, kinds, page); });
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
  absl::StatusOr<std::vector<std::string>> Kinds(Deadline deadline) const override {
    absl::StatusOr<JournalNow> now = OneRead(*database_, deadline, ReadJournalNow);
    if (!now.ok()) return now.status();
    return std::move(now->kinds);
  }

 private:
  Database* const database_;
};

template <Registered what>
absl::StatusOr<std::vector<std::string>> ListIds(Transaction& transaction, const RegisteredFilter& filter,
                                                 const std::string& after, int limit) {
  return ListRegistered(transaction, what, filter, after, limit);
}

}  // namespace

PlantStores PlantIn(Database* database) {
  using Machines = PostgresRevisions<MachineRow>;
  using Artefacts = PostgresRevisions<ArtefactRow>;
  using Parts = PostgresRevisions<PartRow>;
  using Models = PostgresRevisions<MachiningModelRow>;
  PlantStores stores;
  stores.machines = std::make_shared<Machines>(
      database, Machines::Statements{InsertMachine, FindMachine, ListIds<Registered::kMachines>});
  stores.artefacts = std::make_shared<Artefacts>(
      database, Artefacts::Statements{InsertArtefact, FindArtefact, ListIds<Registered::kArtefacts>});
  stores.parts =
      std::make_shared<Parts>(database, Parts::Statements{InsertPart, FindPart, ListIds<Registered::kParts>});
  stores.machining_models = std::make_shared<Models>(
      database, Models::Statements{InsertMachiningModel, FindMachiningModel, ListIds<Registered::kMachiningModels>,
                                   FindMachiningModelWithoutTemplate});
  stores.blades = std::make_shared<PostgresBlades>(database);
  stores.surfaces = std::make_shared<PostgresSurfaces>(database);
  stores.journal = std::make_shared<PostgresJournal>(database);
  stores.clearances = ClearancesIn(database);
  stores.work_orders = std::make_shared<PostgresWorkOrders>(database);
  return stores;
}

}  // namespace sixpoint::storage

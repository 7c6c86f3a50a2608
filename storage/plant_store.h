// What the plant service keeps, apart from where (storage/result_store.h says how): things with revisions, blades, surfaces,
// and the journal's reading side. PostgreSQL's and the tests' fakes of them pass the same suite (tests/storage/plant_store_test.cc).
// Thread-safe. No call holds a connection after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/clearances.h"
#include "storage/machining_models.h"
#include "storage/plant_registry.h"
#include "storage/record.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

template <typename Row>
class RevisionReader {
 public:
  virtual ~RevisionReader() = default;
  // Revision 0: the newest.
  virtual absl::StatusOr<std::optional<Row>> Find(const std::string& id, int revision, Deadline deadline) const = 0;
  // The newest revision of each, where that was recorded within the span, in order of id, from after `after` (empty: from the
  // first).
  virtual absl::StatusOr<std::vector<Row>> List(const RegisteredFilter& filter, const std::string& after, int limit,
                                                Deadline deadline) const = 0;
};

// Record makes the next revision and fills in its number, and the entry's kind and name. A description equal to the newest
// revision's (by content_sha256) is that revision: it is answered, and nothing is stored but the answer.
template <typename Row>
class RevisionStore : public RevisionReader<Row>, public ResultWriter<Row> {};

using MachineStore = RevisionStore<MachineRow>;
using ArtefactStore = RevisionStore<ArtefactRow>;
using PartStore = RevisionStore<PartRow>;  // a part's tessellation has to be kept before
// Lists leave templates out. Record answers ALREADY_EXISTS where the model is another part's.
using MachiningModelStore = RevisionStore<MachiningModelRow>;

class BladeReader {
 public:
  virtual ~BladeReader() = default;
  virtual absl::StatusOr<std::optional<BladeRow>> Find(const std::string& serial, Deadline deadline) const = 0;
  // In order of serial, from after `after` (empty: from the first).
  virtual absl::StatusOr<BladePage> List(const BladeFilter& filter, const std::string& after, int limit,
                                         Deadline deadline) const = 0;
};

// Record answers a blade that is there with the same part as it is; ALREADY_EXISTS: with another part.
class BladeStore : public BladeReader, public ResultWriter<BladeRow> {};

class SurfaceReader {
 public:
  virtual ~SurfaceReader() = default;
  virtual absl::StatusOr<std::optional<TessellationRow>> Find(const std::string& cad_sha256, const std::string& method,
                                                              Deadline deadline) const = 0;
  // The bytes of a kept surface. NOT_FOUND: never kept; DATA_LOSS: no longer those.
  virtual absl::StatusOr<std::string> Bytes(const std::string& surface_sha256, Deadline deadline) const = 0;
};

class SurfaceStore : public SurfaceReader {
 public:
  // CAD, surface and what is said of it, whose digests are filled in. Twice the same is once.
  virtual absl::StatusOr<TessellationRow> Keep(const std::string& cad, const std::string& surface, TessellationRow row,
                                               const std::string& software_version, Deadline deadline) = 0;
};

// As the functions of these names in storage/record.h.
class JournalReader {
 public:
  virtual ~JournalReader() = default;
  virtual absl::StatusOr<std::optional<JournalEntry>> FindEntry(const std::string& name, Deadline deadline) const = 0;
  virtual absl::StatusOr<bool> IsRecorded(const std::string& name, Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<JournalEntry>> RecordOfBlade(const std::string& serial,
                                                                  const std::vector<std::string>& kinds,
                                                                  const JournalPage& page, Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<JournalEntry>> DerivedFrom(const std::string& name,
                                                                const std::vector<std::string>& kinds,
                                                                const JournalPage& page, Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<JournalEntry>> EntriesOfOrder(const std::string& work_order,
                                                                   const std::string& operation,
                                                                   const std::vector<std::string>& kinds,
                                                                   const JournalPage& page,
                                                                   Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<JournalEntry>> MadeFrom(const std::string& name, const JournalPage& page,
                                                             Deadline deadline) const = 0;
  // That entries can have, in their order.
  virtual absl::StatusOr<std::vector<std::string>> Kinds(Deadline deadline) const = 0;
};

struct PlantStores {
  std::shared_ptr<MachineStore> machines;
  std::shared_ptr<ArtefactStore> artefacts;
  std::shared_ptr<PartStore> parts;
  std::shared_ptr<MachiningModelStore> machining_models;
  std::shared_ptr<BladeStore> blades;
  std::shared_ptr<SurfaceStore> surfaces;
  std::shared_ptr<const JournalReader> journal;
  std::shared_ptr<const ClearanceReader> clearances;
  std::shared_ptr<ResultWriter<BladeRow>> work_orders;  // records that one is assigned to a blade that is there
};
// In PostgreSQL; the database lives longer.
PlantStores PlantIn(Database* database);

}  // namespace sixpoint::storage

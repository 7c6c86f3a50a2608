#include "seed/seed_plant.h"

#include <nlohmann/json.hpp>

#include "refusal/refusal.h"
#include "seed/registry.h"
#include "seed/write_blades.h"

namespace sixpoint::seed {
namespace {

using nlohmann::json;
using storage::Database;
using storage::Transaction;

constexpr std::chrono::seconds kSeedPatience{30};

// Of what was not seeded, anything recorded at all: a plant where only a machine is registered is somebody's, too.
constexpr char kSelectReal[] =
    "SELECT n.name FROM record_entries e JOIN record_names n USING (record_id) WHERE e.software_version <> $1 "
    "ORDER BY e.record_sequence LIMIT 1";
constexpr char kSelectSown[] = "SELECT 1 FROM machines WHERE machine_id = $1";

absl::Status CheckPlant(Transaction& transaction, const Request& request, const Plan& plan) {
  const auto real = transaction.Execute(kSelectReal, storage::Params().Text(kSoftwareVersion));
  if (!real.ok()) return real.status();
  if (real->count() > 0 && !request.into_used_plant)
    return absl::FailedPreconditionError(
        "plant: holds " + real->Text(0, 0) +
        ", which was not seeded, want an empty plant: what is seeded stays in the record for ever");
  const auto sown = transaction.Execute(kSelectSown, storage::Params().Text(plan.machines().front().id));
  if (!sown.ok()) return sown.status();
  if (sown->count() > 0)
    return absl::FailedPreconditionError("--seed: " + std::to_string(request.options.seed) +
                                         ", sown in this plant already, want another number");
  return absl::OkStatus();
}

json ToJson(const Plan& plan, const Registry& registry, const Written& written, const Aftermath& aftermath) {
  const Options& options = plan.options();
  json planted = {{"seed", options.seed},
                  {"blades", options.blade_count},
                  {"scans", written.scans},
                  {"results", written.results},
                  {"machines", json::array()},
                  {"parts", json::array()},
                  {"drifting_machines", json::array()},
                  {"expired_machines", json::array()}};
  for (const Machine& machine : plan.machines()) {
    const std::string name = "machines/" + machine.id;
    planted["machines"].push_back(name);
    if (machine.drift_um_per_month > 0)
      planted["drifting_machines"].push_back({{"machine", name}, {"um_per_month", machine.drift_um_per_month}});
    if (machine.is_expired) planted["expired_machines"].push_back(name);
  }
  for (int part = 0; part < kPartCount; ++part) planted["parts"].push_back("parts/" + plan.PartId(part));
  planted["calibrations"] = json::array();
  for (const std::vector<Calibrations>& months : registry.by_machine)
    planted["calibrations"].push_back("calibrations/" + months.front().sensor_id);
  planted["withdrawn_calibrations"] = json::array();
  for (const Withdrawn& w : aftermath.withdrawn)
    planted["withdrawn_calibrations"].push_back({{"calibration", w.calibration}, {"machine", w.machine}});
  planted["rejudged"] = json::array();
  for (const Rejudged& r : aftermath.rejudged)
    planted["rejudged"].push_back(
        {{"inspection", r.inspection}, {"rejudges", r.rejudges}, {"was", r.was}, {"now", r.now}});
  planted["thick_castings"] = written.thick;
  planted["twisted_castings"] = written.twisted;
  return planted;
}

}  // namespace

absl::StatusOr<json> SeedPlant(const std::string& conninfo, const Request& request,
                               const std::function<void(int)>& on_blades) {
  // A crash of the server in these minutes may take some of it: the last commit makes all of it stay.
  const auto database = Database::Open(conninfo + " options='-c synchronous_commit=off'", 1);
  absl::StatusOr<Transaction> transaction = database->Begin(std::chrono::steady_clock::now() + kSeedPatience);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<storage::Instant> now = storage::NowOf(*transaction);
  if (!now.ok()) return now.status();
  const Plan plan(request.options, *now);
  if (absl::Status status = CheckPlant(*transaction, request, plan); !status.ok()) return status;
  if (absl::Status status = transaction->Commit(); !status.ok()) return status;
  const absl::StatusOr<Registry> registry = WriteRegistry(database.get(), plan);
  if (!registry.ok()) return registry.status();
  absl::StatusOr<Written> written = WriteBlades(database.get(), plan, *registry, on_blades);
  if (!written.ok()) return written.status();
  const absl::StatusOr<Aftermath> aftermath = WriteAftermath(database.get(), plan, *registry, &*written);
  if (!aftermath.ok()) return aftermath.status();
  return ToJson(plan, *registry, *written, *aftermath);
}

}  // namespace sixpoint::seed

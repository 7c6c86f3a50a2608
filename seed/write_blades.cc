#include "seed/write_blades.h"

#include <algorithm>
#include <utility>

#include "seed/blade_rows.h"
#include "storage/plant_registry.h"

namespace sixpoint::seed {
namespace {

using storage::Database;
using storage::Transaction;

constexpr std::chrono::minutes kBladePatience{2};
// One transaction writes so many blades: what the server plans once a transaction is shared, and whoever else records waits for the
// journal for a quarter of a second at most.
constexpr int kBladesATransaction = 50;

// The journal's plans are made of what the tables hold: those that were made of empty ones read all names for each entry, until the
// server looks again by itself.
constexpr int kFirstAnalysis = 100, kAnalysisGrowth = 10;

absl::Status Analyze(Database* database) {
  absl::StatusOr<Transaction> transaction = database->Begin(std::chrono::steady_clock::now() + kBladePatience);
  if (!transaction.ok()) return transaction.status();
  if (auto analyzed = transaction->Execute("ANALYZE"); !analyzed.ok()) return analyzed.status();
  return transaction->Commit();
}

absl::Status WriteScan(Transaction& transaction, const BladeRows& rows, const std::string& kind, Written* written) {
  const auto [scan, entry] = rows.Scan(kind);
  ++written->scans;
  return storage::InsertScan(transaction, scan, {rows.BlockOf(scan)}, entry).status();
}

class Writer {
 public:
  Writer(const Plan& plan, const Registry& registry) : plan_(plan), registry_(registry) {}

  absl::Status Write(Transaction& transaction, int index, Written* written) const {
    const BladeRows rows(plan_, registry_, index);
    const Blade& blade = rows.blade();
    absl::Status status =
        storage::InsertBlade(transaction, {blade.serial, plan_.PartId(blade.part), {}, rows.WorkOrder()},
                             rows.BladeEntry())
            .status();
    if (status.ok()) status = WriteScan(transaction, rows, "airfoil", written);
    if (!status.ok()) return status;
    const auto [registration, registered] = rows.Registration(blade.month);
    if (status = storage::InsertRegistration(transaction, registration, registered).status(); !status.ok())
      return status;
    ++written->results;
    if (blade.casting == Casting::kThick) written->thick.push_back(blade.serial);
    if (blade.casting == Casting::kTwisted) {
      written->twisted.push_back(blade.serial);
      return absl::OkStatus();  // nothing is drilled by a pose that there is not
    }
    const auto [correction, corrected] = rows.Correction(registration.registration_id);
    if (status = storage::InsertCorrection(transaction, correction, corrected).status(); !status.ok()) return status;
    if (status = WriteScan(transaction, rows, "pins", written); !status.ok()) return status;
    const auto [inspection, inspected] = rows.Inspection(registration.registration_id, blade.month);
    if (status = storage::InsertInspection(transaction, inspection, inspected).status(); !status.ok()) return status;
    written->results += 2;
    if (inspection.verdict == "NOT_CONFORM") {
      const auto [disposition, disposed] = rows.Disposition(inspection);
      if (status = storage::InsertDisposition(transaction, disposition, disposed).status(); !status.ok()) return status;
    }
    const auto& withdrawals = plan_.withdrawals();
    const bool is_withdrawn = std::any_of(withdrawals.begin(), withdrawals.end(), [&](const Plan::Withdrawal& w) {
      return w.machine == blade.machine && w.month == blade.month;
    });
    if (is_withdrawn && plan_.IsRejudged(index))
      written->to_rejudge.push_back({index, inspection.inspection_id, inspection.verdict});
    return absl::OkStatus();
  }

 private:
  const Plan& plan_;
  const Registry& registry_;
};

}  // namespace

absl::StatusOr<Written> WriteBlades(Database* database, const Plan& plan, const Registry& registry,
                                    const std::function<void(int)>& on_blades) {
  const Writer writer(plan, registry);
  Written written;
  int next_analysis = kFirstAnalysis;
  for (int index = 0; index < plan.options().blade_count;) {
    absl::StatusOr<Transaction> transaction = database->Begin(std::chrono::steady_clock::now() + kBladePatience);
    if (!transaction.ok()) return transaction.status();
    const int past = std::min(index + kBladesATransaction, plan.options().blade_count);
    for (; index < past; ++index)
      if (absl::Status status = writer.Write(*transaction, index, &written); !status.ok()) return status;
    if (absl::Status status = transaction->Commit(); !status.ok()) return status;
    on_blades(index);
    if (index < next_analysis && index < plan.options().blade_count) continue;
    if (absl::Status status = Analyze(database); !status.ok()) return status;
    next_analysis *= kAnalysisGrowth;
  }
  return written;
}

absl::StatusOr<Aftermath> WriteAftermath(Database* database, const Plan& plan, const Registry& registry,
                                         Written* written) {
  Aftermath aftermath;
  absl::StatusOr<Transaction> transaction = database->Begin(std::chrono::steady_clock::now() + kBladePatience);
  if (!transaction.ok()) return transaction.status();
  if (auto set = transaction->Execute("SET LOCAL synchronous_commit = on"); !set.ok()) return set.status();
  for (const Plan::Withdrawal& planned : plan.withdrawals()) {
    storage::CalibrationRow row;
    row.calibration_id =
        registry.by_machine[static_cast<std::size_t>(planned.machine)][static_cast<std::size_t>(planned.month)]
            .sensor_id;
    row.machine_id = plan.machines()[static_cast<std::size_t>(planned.machine)].id;
    row.sensor.emplace();
    const storage::CalibrationEvent event{"seeded: the plate stood on a chip", kSeeder, kSoftwareVersion, {}};
    if (auto gone = storage::WithdrawCalibration(*transaction, row, event); !gone.ok()) return gone.status();
    aftermath.withdrawn.push_back({row.name(), "machines/" + row.machine_id});
  }
  const int newest = plan.options().month_count - 1;
  for (const ToRejudge& old : written->to_rejudge) {
    const BladeRows rows(plan, registry, old.index);
    const auto [registration, registered] = rows.Registration(newest);
    absl::Status status = storage::InsertRegistration(*transaction, registration, registered).status();
    if (!status.ok()) return status;
    const auto [inspection, inspected] = rows.Inspection(registration.registration_id, newest, old.inspection_id);
    if (status = storage::InsertInspection(*transaction, inspection, inspected).status(); !status.ok()) return status;
    aftermath.rejudged.push_back({"inspections/" + inspection.inspection_id, "inspections/" + old.inspection_id,
                                  old.verdict, inspection.verdict});
    written->results += 2;
  }
  if (absl::Status status = transaction->Commit(); !status.ok()) return status;
  return aftermath;
}

}  // namespace sixpoint::seed

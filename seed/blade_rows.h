// The rows of one seeded blade, as the services would leave them.
#pragma once

#include <string>
#include <utility>

#include "seed/plan.h"
#include "seed/registry.h"
#include "storage/corrections.h"
#include "storage/dispositions.h"
#include "storage/inspections.h"
#include "storage/registrations.h"
#include "storage/scans.h"

namespace sixpoint::seed {

// A row and its entry of the journal.
template <typename Row>
using Made = std::pair<Row, storage::RecordEntry>;

class BladeRows {
 public:
  // All of them live longer. Ids are drawn here.
  BladeRows(const Plan& plan, const Registry& registry, int index);

  const Blade& blade() const { return blade_; }
  storage::RecordEntry BladeEntry() const;
  // kind: airfoil, pins.
  Made<storage::ScanRow> Scan(const std::string& kind) const;
  storage::ScanBlockRow BlockOf(const storage::ScanRow& scan) const;
  // Of a twisted casting one that did not converge. month: whose calibrations; that of the blade, or a later one to judge it again.
  Made<storage::RegistrationRow> Registration(int month) const;
  Made<storage::CorrectionRow> Correction(const std::string& registration_id) const;
  // rejudges_id: the inspection that it judges anew; empty: none.
  Made<storage::InspectionRow> Inspection(const std::string& registration_id, int month,
                                          const std::string& rejudges_id = "") const;
  // Of one that is not conform.
  Made<storage::DispositionRow> Disposition(const storage::InspectionRow& inspection) const;
  std::string WorkOrder() const;

 private:
  template <typename Row>
  void Fill(int month, Row* row) const;
  storage::RecordEntry Entry(const std::string& kind, const std::string& name, int month) const;
  std::string ScanId(const std::string& kind) const { return blade_.serial + "-" + kind; }
  const Calibrations& CalibrationsOf(int month) const {
    return registry_.by_machine[static_cast<std::size_t>(blade_.machine)][static_cast<std::size_t>(month)];
  }

  const Plan& plan_;
  const Registry& registry_;
  const int index_;
  const Blade blade_;
  const std::string machine_id_, part_id_;
};

}  // namespace sixpoint::seed

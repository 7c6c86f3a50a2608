// The stand-ins for other services, and the rows of theirs that correction's, inspection's and registration's own rows refer to.
#pragma once

#include <string>
#include <vector>

#include "storage/machining_models.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {

class JudgedPlant : public StandIns {
 public:
  JudgedPlant();

  // In the record, as the calibration service does it; the stand-in still answers as before.
  // The machine's newest, by the name kArmStudy; recorded.
  void StudyArm(calibration::v1::Study study);
  void Withdraw(const std::string& calibration);
  // From then on this sensor calibration is in force; recorded.
  void Remount(calibration::v1::Calibration anew, std::int64_t from_s);
  // The stand-in's and its row.
  void Characterise(bool is_b, const std::vector<double>& forward_error_deg,
                    const std::vector<double>& backward_error_deg, double standard_uncertainty_deg);

  // As the plant keeps machining_models/edm, so that a correction's row has something to refer to.
  void StoreModel(const std::vector<storage::MachiningOperationRow>& operations);
  // A registration of this name in the record, beside kRegistration.
  void StoreRegistration(const std::string& name);

  ThrowawayDatabase database;

 private:
  void StoreRows();
};

}  // namespace sixpoint::testing

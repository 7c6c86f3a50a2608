#include "services/calibration/metrics.h"

#include <vector>

#include "services/runtime/metrics.h"
#include "storage/observed.h"

namespace sixpoint::calibration {
namespace {

class Ages : public runtime::Sampled {
 public:
  absl::Status Read(storage::Transaction& transaction) override {
    const auto ages = storage::CalibrationAges(transaction, kMostAges);
    if (!ages.ok()) return ages.status();
    std::vector<runtime::Reading> age_s, left_s;
    for (const storage::CalibrationAge& each : *ages) {
      const std::vector<std::string> whose = {each.machine_id, each.kind, each.axis};
      age_s.push_back({whose, each.age_s});
      if (each.left_s) left_s.push_back({whose, *each.left_s});
    }
    age_s_.Set(std::move(age_s));
    left_s_.Set(std::move(left_s));
    return absl::OkStatus();
  }
  void Forget() override {
    age_s_.Forget();
    left_s_.Forget();
  }

 private:
  runtime::Readings age_s_{"sixpoint_calibration_age_seconds",
                           "Time since the calibration in force, or where none is the last one, became valid.",
                           {"machine", "kind", "axis"}};
  runtime::Readings left_s_{"sixpoint_calibration_expiry_seconds",
                            "Time until that calibration ends; below 0 after it.",
                            {"machine", "kind", "axis"}};
};

}  // namespace

std::unique_ptr<runtime::Sampled> CalibrationsSampled() { return std::make_unique<Ages>(); }

}  // namespace sixpoint::calibration

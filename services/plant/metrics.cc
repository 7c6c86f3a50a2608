#include "services/plant/metrics.h"

#include <optional>

#include "services/runtime/metrics.h"
#include "storage/observed.h"

namespace sixpoint::plant {
namespace {

class Record : public runtime::Sampled {
 public:
  absl::Status Read(storage::Transaction& transaction) override {
    const absl::StatusOr<std::int64_t> head = storage::RecordHead(transaction);
    if (!head.ok()) return head.status();
    const absl::StatusOr<std::optional<int>> months = storage::MonthsAhead(transaction);
    if (!months.ok()) return months.status();
    head_.Set({{{}, static_cast<double>(*head)}});
    if (months->has_value())
      months_.Set({{{}, static_cast<double>(**months)}});
    else
      months_.Forget();
    return absl::OkStatus();
  }
  void Forget() override {
    head_.Forget();
    months_.Forget();
  }

 private:
  runtime::Readings head_{"sixpoint_record_head_sequence", "The journal's newest sequence.", {}};
  runtime::Readings months_{
      "sixpoint_record_months_ahead", "Months after this one for which every table kept by months has its place.", {}};
};

}  // namespace

std::unique_ptr<runtime::Sampled> RecordSampled() { return std::make_unique<Record>(); }

}  // namespace sixpoint::plant

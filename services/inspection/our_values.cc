#include "services/inspection/our_values.h"

#include <set>
#include <utility>

#include "services/runtime/errors.h"

namespace sixpoint::inspection {
namespace {

// Of a blade; older ones have been taken the place of.
constexpr int kMostAssessments = 10;
constexpr std::size_t kMostComparedValues = 200'000;

class AssessedValues final : public OurValues {
 public:
  explicit AssessedValues(std::shared_ptr<const storage::AssessmentStore> store) : store_(std::move(store)) {}

  absl::StatusOr<std::vector<OurValue>> Of(const std::string& drawing_id, int drawing_revision,
                                           const std::vector<std::string>& blade_serials,
                                           storage::Deadline deadline) const override {
    std::vector<OurValue> values;
    storage::AssessmentFilter filter;
    filter.reader = storage::Reader::Everything();  // the blades are seen by who asks
    filter.drawing_id = drawing_id;
    filter.drawing_revision = drawing_revision;
    for (const std::string& serial : blade_serials) {
      filter.blade_serial = serial;
      const auto rows = store_->List(filter, 0, kMostAssessments, deadline);
      if (!rows.ok()) return rows.status();
      std::set<std::pair<std::string, std::string>> known;
      for (const storage::AssessmentRow& row : *rows) Add(row, &known, &values);
      if (values.size() > kMostComparedValues)
        return runtime::Refuse("recorded", "more than " + std::to_string(kMostComparedValues) + " values",
                               "an instrument or a time with fewer of them");
    }
    return values;
  }

 private:
  // What was not positioned by this plant is another instrument's.
  static void Add(const storage::AssessmentRow& row, std::set<std::pair<std::string, std::string>>* known,
                  std::vector<OurValue>* values) {
    for (const storage::CharacteristicFindingRow& finding : row.findings)
      if (finding.value && !finding.method.empty() && known->insert({finding.characteristic, finding.feature}).second)
        values->push_back({row.blade_serial, finding.characteristic, finding.feature, finding.unit, *finding.value,
                           finding.expanded_uncertainty});
  }

  const std::shared_ptr<const storage::AssessmentStore> store_;
};

}  // namespace

std::shared_ptr<const OurValues> OurValuesOf(std::shared_ptr<const storage::AssessmentStore> store) {
  return std::make_shared<AssessedValues>(std::move(store));
}

}  // namespace sixpoint::inspection

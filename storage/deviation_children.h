// Regions, profile tolerances and their areas of deviation maps. Private to storage.
#pragma once

#include <absl/status/status.h>

#include "storage/children.h"
#include "storage/database.h"
#include "storage/deviations.h"

namespace sixpoint::storage {

absl::Status InsertDeviationChildren(Transaction& transaction, const DeviationMapRow& map);
// Of all the maps at once.
absl::Status ReadDeviationChildren(Transaction& transaction, const ParentRows<DeviationMapRow>& maps);

}  // namespace sixpoint::storage
